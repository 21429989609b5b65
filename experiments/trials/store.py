"""Finished trials in one SQLite file: one writer, a trial's key is the primary key, a second copy is ignored.

Every trial is one transaction, so a killed run keeps whole trials and nothing else.
"""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import astuple
from pathlib import Path
from types import TracebackType
from typing import Any

from deskew.errors import InputError, StepError
from experiments.trials.record import Outcome
from experiments.trials.schema import Failure, Row, TrialKey

NAME = "results.sqlite"
_VERSION = 1

_SCHEMA = """
CREATE TABLE IF NOT EXISTS trials (
    id INTEGER PRIMARY KEY, fingerprint TEXT NOT NULL,
    experiment TEXT NOT NULL, condition TEXT NOT NULL, method TEXT NOT NULL,
    trial INTEGER NOT NULL, seed INTEGER NOT NULL,
    lost INTEGER NOT NULL, UNIQUE (fingerprint, experiment, condition, method, trial, seed));
CREATE TABLE IF NOT EXISTS numbers (
    id INTEGER NOT NULL REFERENCES trials ON DELETE CASCADE, kind TEXT NOT NULL,
    condition TEXT NOT NULL, method TEXT NOT NULL, metric TEXT NOT NULL, value REAL NOT NULL, unit TEXT NOT NULL,
    PRIMARY KEY (id, kind, condition, method, metric)) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS failures (
    id INTEGER NOT NULL REFERENCES trials ON DELETE CASCADE,
    condition TEXT NOT NULL, method TEXT NOT NULL, reason TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS pictures (
    id INTEGER NOT NULL REFERENCES trials ON DELETE CASCADE, name TEXT NOT NULL, png BLOB NOT NULL,
    PRIMARY KEY (id, name)) WITHOUT ROWID;
"""
_KEY = "experiment, condition, method, trial, seed"


class Store:
    """The finished trials of one fingerprint under an output folder.

    Parameters
    ----------
    folder : Path
        Made if it is missing, and removed again if the run stores nothing in it.
    fingerprint : str
        What the trials are computed from; rows of any other fingerprint are neither read nor touched.
    """

    def __init__(self, folder: Path, fingerprint: str) -> None:
        self.fingerprint = fingerprint
        self._path = folder / NAME
        self._made: list[Path] = []
        try:
            # os.path answers for names that pathlib raises on.
            places = (self._path, folder, *folder.parents)
            self._made = [path for path in places if not os.path.lexists(path)]
            folder.mkdir(parents=True, exist_ok=True)
            self._connection = _opened(self._path)
        except (OSError, ValueError) as error:
            self._leave_nothing()
            reason = error.strerror if isinstance(error, OSError) else error
            raise InputError(f"`out` must be a folder that can be written, got {folder}: {reason}.") from error
        except sqlite3.OperationalError as error:
            self._leave_nothing()
            raise InputError(
                f"`out` must be a free, writable folder, got {folder}, whose store says: {error}."
            ) from error
        except sqlite3.DatabaseError as error:
            raise InputError(f"`out` must hold a store of this program or none, got {self._path}: {error}.") from error

    def __enter__(self) -> Store:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        empty = False
        with suppress(sqlite3.Error):
            empty = self._connection.execute("SELECT COUNT(*) FROM trials").fetchone()[0] == 0
        self._connection.close()
        if empty:
            self._path.unlink(missing_ok=True)
            self._leave_nothing()

    def _leave_nothing(self) -> None:
        """Remove what this store made, as far as nobody else put something there."""
        for path in self._made:
            with suppress(OSError, ValueError):
                if path.is_dir():
                    path.rmdir()
                else:
                    path.unlink(missing_ok=True)

    @contextmanager
    def _as_step(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.IntegrityError:
            raise  # a study's fault, not the disk's
        except sqlite3.DatabaseError as error:
            remedy = "finished trials are kept; make room or mend it, and run the same command again"
            raise StepError(f"Keeping results in `{self._path}` failed: {error}; {remedy}.") from error

    def _read(self, query: str, *values: str) -> list[tuple[Any, ...]]:
        with self._as_step():
            return self._connection.execute(query, values).fetchall()

    def forget_lost(self) -> None:
        """Drop the trials whose worker died, so that this run tries them again."""
        with self._as_step(), self._connection:
            self._connection.execute("DELETE FROM trials WHERE lost AND fingerprint = ?", (self.fingerprint,))

    def finished(self) -> set[TrialKey]:
        """Return the keys of the trials that need not be run again."""
        query = f"SELECT {_KEY} FROM trials WHERE fingerprint = ?"
        return {TrialKey(*cells) for cells in self._read(query, self.fingerprint)}

    def record(self, key: TrialKey, outcome: Outcome) -> bool:
        """Keep a finished trial; return False, and change nothing, if it is already kept."""
        with self._as_step(), self._connection:
            insert = f"INSERT OR IGNORE INTO trials (fingerprint, {_KEY}, lost) VALUES (?, ?, ?, ?, ?, ?, ?)"
            cursor = self._connection.execute(insert, (self.fingerprint, *astuple(key), outcome.lost))
            if cursor.rowcount == 0:
                return False
            for kind, rows in (("result", outcome.rows), ("timing", outcome.timings)):
                self._connection.executemany(
                    "INSERT INTO numbers VALUES (?, ?, ?, ?, ?, ?, ?)",
                    [(cursor.lastrowid, kind, r.condition, r.method, r.metric, r.value, r.unit) for r in rows],
                )
            self._connection.executemany(
                "INSERT INTO failures VALUES (?, ?, ?, ?)",
                [(cursor.lastrowid, item.condition, item.method, item.reason) for item in outcome.failures],
            )
            self._connection.executemany(
                "INSERT INTO pictures VALUES (?, ?, ?)",
                [(cursor.lastrowid, name, png) for name, png in outcome.pictures.items()],
            )
        return True

    def rows(self, keys: Iterable[TrialKey], kind: str = "result") -> list[Row]:
        """Return the sorted rows of the given trials; `kind` is "result" or "timing".

        Raises
        ------
        StepError
            If two trials gave the same row a value.
        """
        query = (
            "SELECT experiment, n.condition, n.method, trial, seed, metric, value, unit, "
            "t.condition, t.method FROM numbers n JOIN trials t USING (id) WHERE fingerprint = ? AND kind = ?"
        )
        wanted = set(keys)
        found: dict[tuple[object, ...], Row] = {}
        for *cells, condition, method in self._read(query, self.fingerprint, kind):
            row = Row(*cells)
            if TrialKey(row.experiment, condition, method, row.trial, row.seed) not in wanted:
                continue
            place = tuple(cells[:6])
            if place in found:
                raise StepError(
                    f"Two trials of {row.experiment} both gave {place[1:]}; a study must name each row once."
                )
            found[place] = row
        return sorted(found.values())

    def failures(self, keys: Iterable[TrialKey]) -> list[Failure]:
        """Return the reasons of the given trials' failures, sorted."""
        query = (
            "SELECT experiment, t.condition, t.method, trial, seed, f.condition, f.method, reason "
            "FROM failures f JOIN trials t USING (id) WHERE fingerprint = ?"
        )
        wanted = set(keys)
        return sorted(
            Failure(condition, method, cells[3], cells[4], reason)
            for *cells, condition, method, reason in self._read(query, self.fingerprint)
            if TrialKey(*cells) in wanted
        )

    def pictures(self, keys: Iterable[TrialKey]) -> dict[str, bytes]:
        """Return the PNG bytes of the given trials' pictures by name."""
        query = f"SELECT {_KEY}, name, png FROM pictures JOIN trials USING (id) WHERE fingerprint = ? ORDER BY name"
        wanted = set(keys)
        found = self._read(query, self.fingerprint)
        return {name: png for *cells, name, png in found if TrialKey(*cells) in wanted}


def _opened(path: Path) -> sqlite3.Connection:
    """Open a store or make one; a file of somebody else is closed as it was."""
    connection = sqlite3.connect(path, timeout=0.2)
    try:
        # One driver at a time: the lock lasts as long as the connection.
        connection.execute("PRAGMA locking_mode = EXCLUSIVE")
        connection.execute("PRAGMA foreign_keys = ON")
        version = connection.execute("PRAGMA user_version").fetchone()[0]
        if version not in (0, _VERSION):
            raise sqlite3.DatabaseError(f"its version is {version}, this program writes {_VERSION}")
        columns = {name for (name,) in connection.execute("SELECT name FROM pragma_table_info('trials')")}
        n_tables = connection.execute("SELECT COUNT(*) FROM sqlite_master").fetchone()[0]
        if n_tables and (version == 0 or not {"fingerprint", "lost"} <= columns):
            raise sqlite3.DatabaseError("it holds tables of another program")
        connection.executescript(f"BEGIN EXCLUSIVE; {_SCHEMA} PRAGMA user_version = {_VERSION}; COMMIT;")
    except sqlite3.Error:
        connection.close()
        raise
    return connection

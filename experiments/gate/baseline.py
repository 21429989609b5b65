"""A baseline on disk: NAME.csv, the rows; NAME.json, what produced them; NAME.floors.csv, what noise does to them.

NAME.csv has the columns of `results.csv`. NAME.json has

- `version`: 1;
- `runs`: for each run the arguments of `python -m experiments`, without `out`;
- `settings`: for each run the settings that its rows depend on, as in `run.json`;
- `commit`, `versions`, `machine`: where the rows come from, as in `run.json`.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from io import StringIO
from pathlib import Path
from typing import Any

from deskew.errors import InputError, require
from deskew.io import write_bytes
from deskew.io.files import read_bytes
from experiments.gate.floors import Figure, Noise, floors_text, read_floors
from experiments.reporting.export import csv_text
from experiments.trials import Row

VERSION = 1
Arguments = tuple[str, ...]
Place = tuple[str, str, str, int, int, str]
"""What a row is of: experiment, condition, method, trial, seed, metric."""


@dataclass(frozen=True, slots=True)
class Baseline:
    """Rows to be held, how they were made, and the noise of each figure.

    Attributes
    ----------
    name : str
        Of the file.
    runs : tuple of tuples of str
        Arguments of each run.
    settings : tuple of mappings
        Settings of each run.
    rows : tuple of Row
        Sorted.
    floors : mapping of Figure to Noise
        Empty until they are derived.
    origin : mapping
        Commit, versions, machine.
    """

    name: str
    runs: tuple[Arguments, ...]
    settings: tuple[Mapping[str, Any], ...]
    rows: tuple[Row, ...]
    floors: Mapping[Figure, Noise]
    origin: Mapping[str, Any]


def read_baseline(path: Path) -> Baseline:
    """Read NAME.csv with what lies beside it.

    Raises
    ------
    InputError
        If a file is missing, of another format or damaged.
    """
    require(path.suffix == ".csv", "--baseline", "name a file NAME.csv", path)
    rows, about = read_rows(path), _read_about(path.with_suffix(".json"))
    floors_path = floors_of(path)
    floors = read_floors(floors_path) if floors_path.exists() else {}
    runs = tuple(tuple(run) for run in about["runs"])
    origin = {name: about.get(name) for name in ("commit", "versions", "machine")}
    return Baseline(path.stem, runs, tuple(about["settings"]), tuple(rows), floors, origin)


def floors_of(path: Path) -> Path:
    """Return where the floors of a baseline lie."""
    return path.with_suffix(".floors.csv")


def read_rows(path: Path) -> list[Row]:
    """Read a `results.csv`, sorted.

    Raises
    ------
    InputError
        If it is none.
    """
    columns = [item.name for item in fields(Row)]
    try:
        reader = csv.reader(StringIO(read_bytes(path).decode("utf-8"), newline=""))
        heading = next(reader, [])
        if heading != columns:
            raise ValueError(f"the columns {','.join(heading)[:100] or '(none)'}")
        rows = sorted(_row(cells) for cells in reader)
    except (ValueError, csv.Error) as error:
        reason = " ".join(str(error).split())
        raise InputError(
            f"`{path}` must be a results.csv with the columns {','.join(columns)}, got: {reason}."
        ) from error
    require(bool(rows), str(path), "hold rows", "none")
    places = {place_of(row) for row in rows}
    require(len(places) == len(rows), str(path), "hold each row once", "a row twice")
    return rows


def place_of(row: Row) -> Place:
    """Return what a row is of: the same in the baseline and in a rerun."""
    return row.experiment, row.condition, row.method, row.trial, row.seed, row.metric


def _row(cells: Sequence[str]) -> Row:
    if len(cells) != len(fields(Row)):
        raise ValueError(f"a line of {len(cells)} cells")
    experiment, condition, method, trial, seed, metric, value, unit = cells
    return Row(experiment, condition, method, int(trial), int(seed), metric, float(value), unit)


def _read_about(path: Path) -> dict[str, Any]:
    try:
        about = json.loads(read_bytes(path))
    except (ValueError, RecursionError) as error:
        reason = " ".join(str(error).split())
        raise InputError(f"`{path}` must say what produced the baseline, got: {reason}.") from error
    version = about.get("version") if isinstance(about, dict) else None
    require(version == VERSION, str(path), f"be of version {VERSION}", f"version {version}")
    runs, settings = about.get("runs"), about.get("settings")
    listed = isinstance(runs, list) and all(isinstance(run, list) for run in runs)
    sound = listed and all(isinstance(argument, str) for run in runs for argument in run)
    require(sound and bool(runs), str(path), "list the arguments of each of its `runs`", repr(runs)[:100])
    sound = isinstance(settings, list) and len(settings) == len(runs)
    sound = sound and all(isinstance(item, dict) and {"experiment", "seed", "method"} <= set(item) for item in settings)
    require(sound, str(path), "hold the `settings` of each of its runs", repr(settings)[:100])
    found: dict[str, Any] = about
    return found


def write_baseline(path: Path, baseline: Baseline) -> None:
    """Write NAME.csv and NAME.json; floors of other rows are taken away, for they are none of these."""
    about = {"version": VERSION, "runs": baseline.runs, "settings": baseline.settings, **baseline.origin}
    path.parent.mkdir(parents=True, exist_ok=True)
    floors_of(path).unlink(missing_ok=True)
    write_bytes(csv_text(baseline.rows).encode(), path)
    write_bytes((json.dumps(about, indent=2, sort_keys=True) + "\n").encode(), path.with_suffix(".json"))
    if baseline.floors:
        write_bytes(floors_text(baseline.floors).encode(), floors_of(path))

"""A report's folder as its run left it: rows, failures, what produced them, and its figures."""

from __future__ import annotations

import csv
import json
import re
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from datetime import date
from io import StringIO
from pathlib import Path
from typing import Any

from deskew.errors import DeskewError, InputError, require
from deskew.io.files import read_bytes
from experiments.reporting import Layout
from experiments.reporting.blocks import Block
from experiments.reporting.tables import table_blocks
from experiments.studies import STUDIES, find_study
from experiments.trials.schema import Failure, Row

_ROOT = Path(__file__).resolve().parents[2]
_COMMIT = re.compile(r"[0-9a-f]{7,64}")
_COLUMNS = [item.name for item in fields(Row)]


@dataclass(frozen=True, slots=True)
class Run:
    """One report.

    Attributes
    ----------
    name : str
        Of its folder.
    about : mapping
        Its `run.json`.
    rows, timings : sequences of Row
        Its `results.csv` and `timings.csv`.
    failures : sequence of Failure
        With their reasons.
    layout : Layout
        Of its study.
    figures : sequence of Path
        Its PNG files, by name.
    """

    name: str
    about: Mapping[str, Any]
    rows: Sequence[Row]
    timings: Sequence[Row]
    failures: Sequence[Failure]
    layout: Layout
    figures: Sequence[Path]

    @property
    def commit(self) -> str:
        """The commit that it was run at, ten digits of it."""
        return str(self.about["commit"])[:10]

    @property
    def n_trials(self) -> int:
        """How many trials it was asked for: one more than the last that is in it."""
        return 1 + max(row.trial for row in self.rows)

    @property
    def day(self) -> date | None:
        """The day of its commit: its own `run.json` has it, or the repository does; None where neither knows."""
        text = str(self.about.get("commit_date") or _day_in_history(str(self.about["commit"])))
        try:
            return date.fromisoformat(text)
        except ValueError:
            return None

    def blocks(self) -> list[Block]:
        """Return its tables, as `table.md` has them."""
        return table_blocks(self.layout, self.rows, self.failures, self.timings)


def read_runs(reports: Path) -> list[Run]:
    """Read every report under a folder, in the order of the studies.

    Raises
    ------
    InputError
        If there is none, or one is damaged.
    """
    require(reports.is_dir(), "--reports", "be a folder", f"{reports}, where there is none")
    runs = [_read(path.parent) for path in sorted(reports.glob("*/run.json"))]
    require(bool(runs), "--reports", "hold the reports of runs, NAME/run.json", f"{reports}, which has none")
    order = list(STUDIES)
    return sorted(runs, key=lambda run: (order.index(run.about["experiment"]), run.name))


def _read(folder: Path) -> Run:
    try:
        about = json.loads(read_bytes(folder / "run.json"))
        require(about["experiment"] in STUDIES, f"{folder}: experiment", "be one of the studies", about["experiment"])
        rows = _rows(folder / "results.csv")
        require(bool(rows), str(folder / "results.csv"), "hold a row", "none")
        seeded = "commit" in about and "seed" in about["config"]
        require(seeded, str(folder / "run.json"), "say the commit and the seed of its run", "others alone")
        return Run(
            folder.name,
            about,
            rows,
            _rows(folder / "timings.csv") if (folder / "timings.csv").is_file() else (),
            [Failure(**failure) for failure in about["failures"]],
            find_study(about["experiment"]).layout,
            sorted((folder / "figures").glob("*.png")),
        )
    except DeskewError:
        raise
    except (KeyError, TypeError, ValueError, AttributeError, RecursionError, csv.Error) as error:
        raise InputError(f"`{folder}` must hold a run's own results.csv and run.json, got {error!r}.") from error


def _rows(path: Path) -> list[Row]:
    lines = csv.DictReader(StringIO(read_bytes(path).decode("utf-8"), newline=""))
    require(lines.fieldnames == _COLUMNS, str(path), f"have the columns {','.join(_COLUMNS)}", lines.fieldnames)
    return [
        Row(
            line["experiment"],
            line["condition"],
            line["method"],
            int(line["trial"]),
            int(line["seed"]),
            line["metric"],
            float(line["value"]),
            line["unit"],
        )
        for line in lines
    ]


def _day_in_history(commit: str) -> str:
    """Ask the repository for a commit's day; "" where it does not know."""
    if not _COMMIT.fullmatch(commit):
        return ""
    command = ("git", "show", "--no-patch", "--format=%cs", commit, "--")
    try:
        done = subprocess.run(command, cwd=_ROOT, capture_output=True, text=True, timeout=20, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""

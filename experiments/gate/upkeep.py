"""Making a baseline, and deriving its floors from reruns with redrawn noise on the same sheets."""

from __future__ import annotations

import csv
import gzip
import json
import shlex
import zlib
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from deskew.errors import InputError, require
from deskew.io import write_bytes
from deskew.io.files import require_file
from experiments.gate.baseline import Baseline, Place, place_of, read_baseline, write_baseline
from experiments.gate.directions import direction_of
from experiments.gate.floors import Figure, Noise, noise_of
from experiments.gate.rerun import rerun
from experiments.trials import Row, unit_of
from experiments.trials.record import FAILED

_KEY = ("experiment", "condition", "method", "trial", "seed", "metric")


def record(path: Path, runs: Sequence[str]) -> None:
    """Run trials and keep their rows as a baseline.

    Parameters
    ----------
    path : Path
        NAME.csv, replaced if it is there; its floors are taken away.
    runs : sequence of str
        Arguments of each run, as a shell reads them; none for those that the baseline has already.

    Raises
    ------
    InputError
        If a run is refused or a trial failed: a baseline holds no failures.
    """
    arguments = tuple(tuple(shlex.split(run)) for run in runs) or read_baseline(path).runs
    with TemporaryDirectory(prefix="gate.") as folder:
        found = rerun(Baseline(path.stem, arguments, (), (), {}, {}), Path(folder))
        failed = [row for row in found.rows if row.metric == FAILED]
        sound = not failed and len(found.settings) == len(arguments)
        require(sound, "the baseline", "hold no failed trial", f"{len(failed)} failed rows")
        about = json.loads((Path(folder) / "run_0" / "run.json").read_text(encoding="utf-8"))
    origin = {name: about[name] for name in ("commit", "versions", "machine")}
    write_baseline(path, Baseline(path.stem, arguments, found.settings, found.rows, {}, origin))


def redraw(path: Path, table: Path, draws: Iterable[int]) -> None:
    """Run a baseline's trials once for each draw of the noise and add what is judged to a table.

    Draws that the table has already are not run again.
    """
    baseline = read_baseline(path)
    columns = read_table(table) if table.exists() else {}
    for draw in draws:
        if draw not in columns:
            with TemporaryDirectory(prefix="gate.") as folder:
                found = rerun(baseline, Path(folder), more=(f"rig.noise_draw={draw}",))
            columns[draw] = {place_of(row): row.value for row in found.rows if judged(row)}
            write_table(table, columns)


def judged(row: Row) -> bool:
    """Say whether a row belongs into a table of redraws: a figure with a direction, or a failure."""
    return row.metric == FAILED or direction_of(row.condition, row.metric) is not None


def write_table(path: Path, columns: Mapping[int, Mapping[Place, float]]) -> None:
    """Write rows by draw as compressed CSV, one column a draw, six digits; the same rows give the same bytes."""
    places = sorted({place for column in columns.values() for place in column})
    lines = [",".join((*_KEY, *(str(draw) for draw in sorted(columns))))]
    for place in places:
        values = (columns[draw].get(place) for draw in sorted(columns))
        cells = ("" if value is None else f"{value:.6g}" for value in values)
        lines.append(",".join((*(str(part) for part in place), *cells)))
    write_bytes(gzip.compress(("\n".join(lines) + "\n").encode(), mtime=0), path)


def read_table(path: Path) -> dict[int, dict[Place, float]]:
    """Read what :func:`write_table` wrote.

    Raises
    ------
    InputError
        If the file is no such table.
    """
    try:
        require_file(path)
        with gzip.open(path, "rt", encoding="utf-8", newline="") as file:
            heading, *lines = csv.reader(file)
        if tuple(heading[: len(_KEY)]) != _KEY:
            raise ValueError(f"the columns {','.join(heading)[:100]}")
        found: dict[int, dict[Place, float]] = {int(name): {} for name in heading[len(_KEY) :]}
        for experiment, condition, method, trial, seed, metric, *values in lines:
            place = experiment, condition, method, int(trial), int(seed), metric
            for column, value in zip(found.values(), values, strict=True):
                if value:
                    column[place] = float(value)
    except (OSError, EOFError, ValueError, csv.Error, zlib.error) as error:
        reason = " ".join(str(error).split())
        raise InputError(f"`{path}` must be a table of redraws, got: {reason}.") from error
    return found


def rows_of(column: Mapping[Place, float]) -> list[Row]:
    """Return one draw of a table as rows."""
    return [Row(*place, value, unit_of(place[-1])) for place, value in column.items()]


def derive(path: Path, table: Path, draws: Sequence[int]) -> None:
    """Derive a baseline's floors from some draws and write them beside it."""
    columns = read_table(table)
    absent = [draw for draw in draws if draw not in columns]
    require(not absent, "--draws", f"be in {table}", f"{absent[0] if absent else ''}, which is not")
    baseline = read_baseline(path)
    write_baseline(path, replace(baseline, floors=floors_from([columns[draw] for draw in draws])))


def floors_from(draws: Sequence[Mapping[Place, float]]) -> dict[Figure, Noise]:
    """Return the noise of every figure that all draws have on the same pages.

    Raises
    ------
    InputError
        If a trial failed in one of them, or a row is missing.
    """
    values: dict[Figure, dict[tuple[int, int], list[float]]] = defaultdict(lambda: defaultdict(list))
    for column in draws:
        for (experiment, condition, method, trial, seed, metric), value in column.items():
            direction = direction_of(condition, metric)
            if direction is None:
                raise InputError(f"The draws must hold judged figures and no failures, got {condition} {metric}.")
            figure = Figure(experiment, condition, method, metric)
            values[figure][trial, seed].append(direction.badness(value))
    found = {}
    for figure, pages in values.items():
        whole = all(len(page) == len(draws) for page in pages.values())
        require(whole, " ".join(figure), "be there in every draw", "a draw without it")
        found[figure] = noise_of(np.array([pages[page] for page in sorted(pages)]).T)
    return found

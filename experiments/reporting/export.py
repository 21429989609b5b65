"""Everything that a run leaves beside its store, all of it or nothing."""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from importlib.util import find_spec
from io import BytesIO, StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, get_type_hints

from deskew.errors import StepError, require
from experiments.reporting.curves import curve_plot
from experiments.reporting.diagrams import diagram_plot, shares_plot
from experiments.reporting.figure_pages import figure_page, pictures_on
from experiments.reporting.figures import dot_plot, picture_wall, png_bytes
from experiments.reporting.ladders import ladder_plot
from experiments.reporting.layout import Layout
from experiments.reporting.tables import table, times_page
from experiments.trials.schema import Failure, Row

_PARQUET = "results.parquet"


@dataclass(frozen=True, slots=True)
class Results:
    """All finished trials of a run, each list sorted."""

    rows: Sequence[Row]
    timings: Sequence[Row]
    failures: Sequence[Failure]
    pictures: Mapping[str, bytes]


def write_report(out: Path, layout: Layout, results: Results, about: Mapping[str, Any]) -> None:
    """Write `results.csv`, `timings.csv`, `table.md`, `figures/*.png`, `run.json` and any `profile.md` under `out`.

    `results.parquet`, the same rows with types, is written where pyarrow is installed; elsewhere an old one goes, for
    its rows would not be those of `results.csv`. Everything is made before the first file is replaced, so what fails
    leaves the old report standing.
    """
    run = dict(about) | {"failures": [asdict(failure) for failure in results.failures]}
    files: dict[str, bytes] = {
        "results.csv": csv_text(results.rows).encode(),
        "timings.csv": csv_text(results.timings).encode(),
        "table.md": table(layout, results.rows, results.failures, results.timings).encode(),
        "run.json": (json.dumps(run, indent=2, sort_keys=True) + "\n").encode(),
    }
    if find_spec("pyarrow") is not None:
        files[_PARQUET] = parquet_bytes(results.rows)
    if layout.profile is not None:
        files["profile.md"] = times_page(layout.profile, results.timings).encode()
    files |= {f"figures/{name}.png": png for name, png in _figures(layout, results).items()}
    _replace_all(out, files)


def _figures(layout: Layout, results: Results) -> dict[str, bytes]:
    """Draw what the layout asks for, and add the recorded pictures that stand in no figure: PNG by name."""
    rows, pictures = results.rows, results.pictures
    timed = [*rows, *results.timings]
    drawn = [
        *((plot.name, dot_plot(plot, rows)) for plot in layout.plots),
        *((curve.name, curve_plot(curve, rows)) for curve in layout.curves),
        *((diagram.name, diagram_plot(diagram, timed)) for diagram in layout.diagrams),
        *((shares.name, shares_plot(shares, rows)) for shares in layout.shares),
        *((ladder.name, ladder_plot(ladder, rows)) for ladder in layout.ladders),
        *((montage.name, picture_wall(montage, pictures)) for montage in layout.montages),
    ]
    pages = [(page.name, figure_page(page, layout.columns, rows, pictures)) for page in layout.pages]
    shown = {n.format(trial=row.trial) for montage in layout.montages for _, n in montage.lines for row in rows}
    shown = shown.union(*(pictures_on(page, rows) for page in layout.pages))
    return (
        {name: png_bytes(figure) for name, figure in drawn if figure is not None}
        | {name: png for name, png in pages if png is not None}
        | {name: png for name, png in pictures.items() if name not in shown}
    )


def require_targets(out: Path, layout: Layout) -> None:
    """Raise an InputError where a report could not be written under `out`: to be asked before the trials."""
    figures = (
        layout.plots,
        layout.curves,
        layout.diagrams,
        layout.shares,
        layout.ladders,
        layout.montages,
        layout.pages,
    )
    drawn = [item.name for kind in figures for item in kind]
    names = [
        "results.csv",
        _PARQUET,
        "timings.csv",
        "table.md",
        "profile.md",
        "run.json",
        *(f"figures/{name}.png" for name in drawn),
    ]
    _require_replaceable(out, names)


def _require_replaceable(out: Path, names: Iterable[str]) -> None:
    figures = out / "figures"
    kind = "a folder" if figures.is_dir() else "a file"
    usable = not os.path.lexists(figures) or (figures.is_dir() and os.access(figures, os.W_OK))
    require(usable, str(figures), "be a writable folder or not there", kind)
    for name in names:
        require(not (out / name).is_dir(), str(out / name), "be a file or not there", "a folder")


def _replace_all(out: Path, files: Mapping[str, bytes]) -> None:
    """Write every file beside the old ones first, then rename: a full disk leaves the old report as it was."""
    _require_replaceable(out, files)
    try:
        with TemporaryDirectory(prefix=".report.", dir=out, ignore_cleanup_errors=True) as scratch:
            for folder in (Path(scratch), out):
                (folder / "figures").mkdir(exist_ok=True)
            for name, content in files.items():
                (Path(scratch) / name).write_bytes(content)
            for name in files:
                (Path(scratch) / name).replace(out / name)
            if _PARQUET not in files:
                (out / _PARQUET).unlink(missing_ok=True)
    except OSError as error:
        reason = f"{error.strerror or error}; choose a writable folder with room, finished trials are kept"
        raise StepError(f"Writing the report under `{out}` failed: {reason}.") from error


def csv_text(rows: Sequence[Row]) -> str:
    """Return rows as CSV with a heading; the same rows give the same text, to the byte."""
    buffer = StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow([item.name for item in fields(Row)])
    writer.writerows(row.cells() for row in sorted(rows))
    return buffer.getvalue()


def parquet_bytes(rows: Sequence[Row]) -> bytes:
    """Return rows as Parquet, sorted and with the columns of the CSV; `trial` and `seed` int64, `value` a double.

    The same rows give the same bytes by the same pyarrow, which must be installed.
    """
    import pyarrow as pa
    from pyarrow import parquet

    types = {int: pa.int64(), float: pa.float64(), str: pa.string()}
    ordered = sorted(rows)
    columns = {
        name: pa.array([getattr(row, name) for row in ordered], types[kind])
        for name, kind in get_type_hints(Row).items()
    }
    buffer = BytesIO()
    parquet.write_table(pa.table(columns), buffer, compression="zstd")
    return buffer.getvalue()

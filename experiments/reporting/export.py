"""Everything that a run leaves beside its store, each file whole or not at all."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from io import StringIO
from pathlib import Path
from typing import Any

from deskew.io import write_bytes
from experiments.reporting.figures import dot_plot, picture_wall, png_bytes
from experiments.reporting.layout import Layout
from experiments.reporting.tables import table
from experiments.trials.schema import Failure, Row


@dataclass(frozen=True, slots=True)
class Results:
    """All finished trials of a run, each list sorted."""

    rows: Sequence[Row]
    timings: Sequence[Row]
    failures: Sequence[Failure]
    pictures: Mapping[str, bytes]


def write_report(out: Path, layout: Layout, results: Results, about: Mapping[str, Any]) -> None:
    """Write `results.csv`, `timings.csv`, `table.md`, `figures/*.png` and `run.json` under `out`.

    Everything is made before the first file is replaced, so what fails leaves the old report standing.
    """
    run = dict(about) | {"failures": [asdict(failure) for failure in results.failures]}
    files: dict[str, bytes] = {
        "results.csv": csv_text(results.rows).encode(),
        "timings.csv": csv_text(results.timings).encode(),
        "table.md": table(layout, results.rows, results.failures).encode(),
        "run.json": (json.dumps(run, indent=2, sort_keys=True) + "\n").encode(),
    }
    for plot in layout.plots:
        figure = dot_plot(plot, results.rows)
        if figure is not None:
            files[f"figures/{plot.name}.png"] = png_bytes(figure)
    shown = set()
    for montage in layout.montages:
        wall = picture_wall(montage, results.pictures)
        if wall is not None:
            files[f"figures/{montage.name}.png"] = png_bytes(wall)
        shown |= {name.format(trial=row.trial) for _, name in montage.lines for row in results.rows}
    alone = {name: png for name, png in results.pictures.items() if name not in shown}
    files |= {f"figures/{name}.png": png for name, png in alone.items()}
    for name, content in files.items():
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        write_bytes(content, out / name)


def csv_text(rows: Sequence[Row]) -> str:
    """Return rows as CSV with a heading; the same rows give the same text, to the byte."""
    buffer = StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow([item.name for item in fields(Row)])
    writer.writerows(row.cells() for row in sorted(rows))
    return buffer.getvalue()

"""Rows to pictures: a dot a trial, so that nobody mistakes a mean for the data."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from io import BytesIO
from statistics import median

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from experiments.reporting.layout import Plot
from experiments.trials.schema import Row


def png_bytes(figure: Figure) -> bytes:
    """Return a figure as PNG, without the date and version that matplotlib would write into it."""
    FigureCanvasAgg(figure)
    buffer = BytesIO()
    figure.savefig(buffer, format="png", dpi=120, metadata={"Software": None})
    return buffer.getvalue()


def dot_plot(plot: Plot, rows: Sequence[Row]) -> Figure | None:
    """Draw one metric, a row of dots for each condition and method with the median as a bar; None without data."""
    values: dict[tuple[str, str], list[float]] = defaultdict(list)
    for row in rows:
        if row.metric == plot.metric:
            values[row.condition, row.method].append(row.value)
    if not values:
        return None
    places = sorted(values, reverse=True)
    figure = Figure(figsize=(7.0, 1.2 + 0.35 * len(places)), layout="constrained")
    axes = figure.subplots()
    for height, place in enumerate(places):
        axes.plot(values[place], [height] * len(values[place]), "o", color="tab:blue", alpha=0.6, markersize=5)
        middle = median(values[place])
        axes.plot([middle, middle], [height - 0.3, height + 0.3], color="black", linewidth=1.5)
    if plot.paper is not None:
        axes.axvline(plot.paper, color="tab:red", linestyle="--", label=f"the paper: {plot.paper:g}")
        axes.legend(loc="best", frameon=False)
    axes.set_yticks(range(len(places)), [" ".join(part for part in place if part != "-") for place in places])
    axes.set_ylim(-0.6, len(places) - 0.4)
    axes.set_xlim(left=0.0)
    axes.set_xlabel(plot.label)
    axes.grid(axis="x", alpha=0.3)
    return figure

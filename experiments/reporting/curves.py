"""Rows to curves: means with their intervals against what was varied."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import fmean
from typing import Any

from matplotlib.figure import Figure
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter

from experiments.reporting.figure_layout import Curve
from experiments.reporting.statistics import Summary, summarise
from experiments.trials.schema import Row

_BAND_COLOURS = ("tab:red", "tab:green")


@dataclass(frozen=True, slots=True)
class Point:
    """One condition of a line: where it stands across, and its trials upwards."""

    x: float
    y: Summary


def curve_points(curve: Curve, rows: Sequence[Row]) -> dict[str, list[Point]]:
    """Return each line's points from left to right, by the line's name: condition and method.

    Parameters
    ----------
    curve : Curve
        What to draw.
    rows : sequence of Row
        All results.
    """
    values: dict[tuple[str, str, str], list[float]] = defaultdict(list)
    for row in rows:
        values[row.condition, row.method, row.metric].append(row.value)
    lines: dict[str, list[Point]] = defaultdict(list)
    for line in curve.conditions:
        for condition, method, metric in sorted(values):
            if metric != curve.y or (condition != line and not condition.startswith(f"{line}/")):
                continue
            elsewhere = curve.conditions[0] + condition.removeprefix(line), "-", curve.x
            across = values.get((condition, method, curve.x)) or values.get(elsewhere)
            if across:
                name = line if method == "-" else f"{line} {method}"
                lines[name].append(Point(fmean(across), summarise(values[condition, method, metric])))
    return {name: sorted(points, key=lambda point: point.x) for name, points in lines.items()}


def label_by_numbers(axis: Any) -> None:
    """Label a logarithmic axis of three decades at most by plain numbers, with a 2 and a 5 between powers of ten."""
    low, high = axis.get_view_interval()
    if high <= 1000 * low:
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(FormatStrFormatter("%g"))
        axis.set_minor_formatter(NullFormatter())


def curve_plot(curve: Curve, rows: Sequence[Row]) -> Figure | None:
    """Draw the means with their intervals; None without data."""
    lines = curve_points(curve, rows)
    if not lines:
        return None
    figure = Figure(figsize=(7.0, 4.2), layout="constrained")
    axes = figure.subplots()
    for (text, low, high), colour in zip(curve.bands, _BAND_COLOURS, strict=False):
        axes.axhspan(low, high, color=colour, alpha=0.12, linewidth=0, label=text)
    reached = [point.x for points in lines.values() for point in points]
    aside = 0.004 * (max(reached) - min(reached))
    for i, (name, points) in enumerate(lines.items()):
        means = [point.y.mean for point in points]
        ends = [point.y.interval or (point.y.mean, point.y.mean) for point in points]
        reach = [
            [mean - low for mean, (low, _) in zip(means, ends, strict=True)],
            [high - mean for mean, (_, high) in zip(means, ends, strict=True)],
        ]
        # Side by side, so that intervals at one place do not hide each other.
        across = [point.x * 1.04**i if curve.log else point.x + aside * i for point in points]
        axes.errorbar(across, means, reach, marker="o", markersize=4, capsize=3, linewidth=1.2, label=name)
    axes.set(xlabel=curve.x_label, ylabel=curve.y_label)
    if curve.log:
        axes.set(xscale="log", yscale="log")
        label_by_numbers(axes.xaxis)
        label_by_numbers(axes.yaxis)
    else:
        axes.set_ylim(bottom=0.0)
    axes.grid(alpha=0.3)
    axes.legend(loc="best" if curve.log else "upper left", frameon=False, fontsize=8)
    numbers = sorted({point.y.n for points in lines.values() for point in points})
    pages = f"{numbers[0]}" if len(numbers) == 1 else f"{numbers[0]} to {numbers[-1]}"
    axes.set_title(f"means with their 95 % bootstrap intervals; trials a point: {pages}", fontsize=9)
    return figure

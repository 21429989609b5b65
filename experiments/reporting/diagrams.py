"""Rows to diagrams: what a method costs against what it gives, and how its trials end."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from math import isfinite
from statistics import fmean, median
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from experiments.reporting.figure_layout import Diagram, Panel, Shares
from experiments.trials.schema import Row

Values = Mapping[tuple[str, str, str], Sequence[float]]
_MARKERS = "osD^vPX*"


def _by_place(rows: Sequence[Row]) -> Values:
    values: dict[tuple[str, str, str], list[float]] = defaultdict(list)
    for row in rows:
        values[row.condition, row.method, row.metric].append(row.value)
    return values


def panel_points(panel: Panel, values: Values, metric: str) -> dict[str, list[tuple[float, float]]]:
    """Return each line's points (x, y), y being a metric.

    Parameters
    ----------
    panel : Panel
        What to draw.
    values : mapping of (condition, method, metric) to the trials' values
        All results and times.
    metric : str
        The panel's `y` or `theory`.
    """
    lines: dict[str, list[tuple[float, float, float]]] = defaultdict(list)
    for beginning, text in panel.conditions:
        for condition, method, name in values:
            if name != metric or method == "-" or not condition.startswith(beginning):
                continue
            x = values.get((condition, method, panel.x), ()) if panel.x else [_number(condition)]
            if x:
                point = _number(condition), median(x), median(values[condition, method, name])
                lines[method + text].append(point)
    return {name: [(x, y) for _, x, y in sorted(points)] for name, points in lines.items()}


def _number(condition: str) -> float:
    return float(condition.rpartition("=")[2])


def diagram_plot(diagram: Diagram, rows: Sequence[Row]) -> Figure | None:
    """Draw a diagram; None without data."""
    values = _by_place(rows)
    methods = sorted({m for panel in diagram.panels for m in panel_points(panel, values, panel.y)})
    if not methods:
        return None
    figure = Figure(figsize=(1.2 + 3.9 * len(diagram.panels), 4.4), layout="constrained")
    places = figure.subplots(1, len(diagram.panels), squeeze=False)[0]
    for axes, panel in zip(places, diagram.panels, strict=True):
        _draw(axes, panel, values, methods)
    named = _legend(places)
    figure.legend(named.values(), named.keys(), loc="outside lower center", ncols=6, frameon=False, fontsize=8)
    figure.suptitle(diagram.title, fontsize=10)
    return figure


def _legend(places: Sequence[Any]) -> dict[str, Any]:
    """Return the lines of all panels by name."""
    found = [axes.get_legend_handles_labels() for axes in places]
    return {name: line for lines, names in found for line, name in zip(lines, names, strict=True)}


def _draw(axes: Any, panel: Panel, values: Values, methods: Sequence[str]) -> None:
    found, theory = (panel_points(panel, values, metric) for metric in (panel.y, panel.theory))
    for i, method in enumerate(methods):
        style = {"color": f"C{i}", "linewidth": 1.2}
        if method in found:
            x, y = zip(*found[method], strict=True)
            axes.plot(x, y, marker=_MARKERS[i % len(_MARKERS)], markersize=4, label=method, **style)
        if method in theory:
            x, y = zip(*theory[method], strict=True)
            axes.plot(x, y, linestyle="--", alpha=0.6, **style)
    for text, condition, metric in panel.levels:
        level = values.get((condition, "-", metric), ())
        if level and isfinite(median(level)):
            axes.axhline(median(level), color="black", linestyle=":", linewidth=1.0)
            axes.annotate(
                text, (0.98, median(level)), xycoords=("axes fraction", "data"), fontsize=7, ha="right", va="bottom"
            )
    if not panel.linear:
        axes.set(xscale="log", yscale="log")
    axes.set(xlabel=panel.x_label, ylabel=panel.y_label)
    axes.grid(alpha=0.3)


def shares_plot(shares: Shares, rows: Sequence[Row]) -> Figure | None:
    """Draw outcomes as divided bars, a row of them for each method; None without data."""
    values = _by_place(rows)
    places = {(c, m) for c, m, metric in values if c.startswith(shares.conditions) and metric == shares.metrics[0][0]}
    if not places:
        return None
    methods = sorted({method for _, method in places})
    conditions = sorted({condition for condition, _ in places}, key=_number)
    figure = Figure(figsize=(7.0, 0.9 + 2.0 * len(methods)), layout="constrained")
    for axes, method in zip(figure.subplots(len(methods), 1, squeeze=False)[:, 0], methods, strict=True):
        bottom = np.zeros(len(conditions))
        for metric, colour in shares.metrics:
            share = np.array([fmean(values.get((c, method, metric), (0.0,))) for c in conditions])
            axes.bar(
                range(len(conditions)), share, bottom=bottom, color=colour, width=0.85, label=metric.replace("_", " ")
            )
            bottom += share
        axes.set_xticks(range(len(conditions)), [f"{_number(condition):g}" for condition in conditions])
        axes.set(ylim=(0, 1), ylabel="share of the pages", title=method)
        axes.title.set_fontsize(9)
    axes.set_xlabel(shares.label)
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), frameon=False, fontsize=8)
    figure.suptitle(shares.title, fontsize=10)
    return figure

"""Rows to ladders: what is left of an error after each step, and what each step takes off by itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure

from experiments.reporting.curves import label_by_numbers
from experiments.reporting.figure_layout import Ladder
from experiments.reporting.pages import Place, PlacePages, pages_by_place
from experiments.reporting.statistics import compare, summarise
from experiments.trials.schema import Row

_NO_METHOD = "-"
_WORTH_COLOURS = ("tab:orange", "tab:green")
_NONE = PlacePages({}, frozenset())


def ladder_plot(ladder: Ladder, rows: Sequence[Row]) -> Figure | None:
    """Draw a ladder from the top down, a step a line; None without data of its start.

    On the left each page is a small dot and the mean a large one with its 95 % bootstrap interval; on the right stand
    the means of the pages' differences with theirs.
    """
    places = pages_by_place(rows)
    if not _pages(places, ladder.rungs[0][1], ladder.metric):
        return None
    figure = Figure(figsize=(10.5, 1.6 + 0.5 * len(ladder.rungs)), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(1.15, 1.0))
    _draw_rungs(left, ladder, places)
    _draw_worth(right, ladder, places)
    heights = range(len(ladder.rungs))
    left.set_yticks(heights, [text for text, _ in ladder.rungs])
    left.set_ylim(len(ladder.rungs) - 0.5, -0.5)
    n = len(_pages(places, ladder.rungs[0][1], ladder.metric))
    figure.suptitle(f"{ladder.title} ({n} pages, means with their 95 % bootstrap intervals)", fontsize=10)
    return figure


def _draw_rungs(axes: Any, ladder: Ladder, places: Mapping[Place, PlacePages]) -> None:
    before: float | None = None
    for height, (_, condition) in enumerate(ladder.rungs):
        values = list(_pages(places, condition, ladder.metric).values())
        if not values:
            continue
        # Below the line, so that the interval does not hide them.
        axes.plot(values, [height + 0.16] * len(values), "o", color="tab:blue", alpha=0.4, markersize=3, zorder=1)
        found = summarise(values)
        low, high = found.interval or (found.mean, found.mean)
        reach = [[found.mean - low], [high - found.mean]]
        axes.errorbar([found.mean], [height], xerr=reach, fmt="o", color="black", capsize=3, markersize=6, zorder=3)
        axes.annotate(
            f"{found.mean:.3f}", (found.mean, height), (0, 7), textcoords="offset points", ha="center", size=8
        )
        if before is not None:
            axes.plot([before, before, found.mean], [height - 1, height, height], color="0.6", linewidth=1.0, zorder=0)
        before = found.mean
    if ladder.paper is not None:
        axes.axvline(ladder.paper, color="tab:red", linestyle="--", linewidth=1.0, label=f"the paper: {ladder.paper:g}")
        axes.legend(loc="upper left", frameon=False, fontsize=8)
    axes.set(xscale="log", xlabel=ladder.label, title="one step after another")
    label_by_numbers(axes.xaxis)
    axes.title.set_fontsize(9)
    axes.grid(axis="x", alpha=0.3)


def _draw_worth(axes: Any, ladder: Ladder, places: Mapping[Place, PlacePages]) -> None:
    for (text, pairs), colour, aside in zip(ladder.worth, _WORTH_COLOURS, (-0.13, 0.13), strict=False):
        name: str | None = text
        for height, (with_it, without_it) in enumerate(pairs, start=1):
            worse, better = (_pages(places, c, ladder.metric) for c in (without_it, with_it))
            both = sorted(worse.keys() & better.keys())
            if not both:
                continue
            found = compare([worse[page] for page in both], [better[page] for page in both])
            low, high = found.interval or (found.difference, found.difference)
            reach = [[found.difference - low], [high - found.difference]]
            style = {"fmt": "o", "color": colour, "capsize": 3, "markersize": 5, "label": name}
            axes.errorbar([found.difference], [height + aside], xerr=reach, **style)
            name = None
    axes.axvline(0.0, color="0.4", linewidth=0.8)
    unit = ladder.label[ladder.label.rfind("[") :]
    axes.set(xlabel=f"taken off the error, page by page {unit}", title="each step by itself")
    axes.title.set_fontsize(9)
    axes.legend(loc="best", frameon=False, fontsize=8)
    axes.grid(axis="x", alpha=0.3)


def _pages(places: Mapping[Place, PlacePages], condition: str, metric: str) -> Mapping[Any, float]:
    return places.get((condition, _NO_METHOD), _NONE).values.get(metric, {})

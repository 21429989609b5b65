"""Rows to `table.md`: a summary, each trial in the paper's manner, then all of them with their spread."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from statistics import median

from experiments.reporting.layout import Column, Layout, Section, Times
from experiments.reporting.statistics import share_interval, summarise
from experiments.trials.schema import Failure, Row

# Beyond this many a line a trial is no longer read; `results.csv` has them all.
_MAX_TRIALS_SHOWN = 10
_NONE = "–"

Place = tuple[str, str]


def markdown_table(headings: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table; the first column is text, the others are set flush right."""
    rule = ["---"] + ["---:"] * (len(headings) - 1)
    return "\n".join("| " + " | ".join(cells) + " |" for cells in (headings, rule, *lines))


def table(layout: Layout, rows: Sequence[Row], failures: Sequence[Failure], timings: Sequence[Row] = ()) -> str:
    """Return the text of `table.md`.

    Parameters
    ----------
    layout : Layout
        The study's columns and the paper's figures.
    rows : sequence of Row
        All results.
    failures : sequence of Failure
        Each is listed with its reason.
    timings : sequence of Row
        Shown where the layout asks for times.
    """
    parts = [f"# {layout.title}", layout.note]
    for times in layout.times:
        parts += [f"## {times.title}", times.note, _times(times, timings)]
    headlines = [column for column in layout.columns if column.headline]
    if headlines or layout.sections:
        parts += [
            "## Summary",
            "Mean over the trials (of root mean squares the pooled one) with its 95 % bootstrap interval; shares with "
            "Wilson's, a failed trial counting against them.",
        ]
    if headlines:
        parts.append(_headlines(headlines, _by_place(rows)))
    for section in layout.sections:
        parts += [f"**{section.title}.** {section.note}", _section(layout, section, rows)]
    if not layout.sections and len({row.trial for row in rows}) <= _MAX_TRIALS_SHOWN:
        parts += ["## Each trial", _each_trial(layout, rows)]
    parts += ["## All trials", _all_trials(layout, rows)]
    if failures:
        lines = [[str(f.trial), str(f.seed), f.condition, f.method, f.reason.replace("|", "/")] for f in failures]
        parts += ["## Failed", markdown_table(("trial", "seed", "condition", "method", "reason"), lines)]
    return "\n\n".join(parts) + "\n"


def times_page(times: Times, timings: Sequence[Row]) -> str:
    """Return a table of times as a page of its own."""
    return "\n\n".join((f"# {times.title}", times.note, _times(times, timings))) + "\n"


def _times(times: Times, timings: Sequence[Row]) -> str:
    """Return a line a condition and method; of several trials the median."""
    found = [
        (place, [median(metrics[column.metric]) if column.metric in metrics else None for column in times.columns])
        for place, metrics in _by_place(timings).items()
    ]
    ranks = {condition: rank for rank, condition in enumerate(times.order)}
    found.sort(key=lambda item: (ranks.get(item[0][0], len(ranks)), item[0][0], -(item[1][0] or 0.0), item[0][1]))
    lines = [
        [
            *place,
            *(
                _NONE if value is None else f"{value:.{c.digits}f}"
                for value, c in zip(values, times.columns, strict=True)
            ),
        ]
        for place, values in found
        if values[0] is not None
    ]
    return markdown_table(("condition", "method", *(column.heading for column in times.columns)), lines)


def _each_trial(layout: Layout, rows: Sequence[Row]) -> str:
    cells: dict[tuple[str, str, int, int], dict[str, float]] = defaultdict(dict)
    for row in rows:
        cells[row.condition, row.method, row.trial, row.seed][row.metric] = row.value
    shown = [column for column in layout.columns if any(column.metric in found for found in cells.values())]
    lines = [
        [condition, method, str(trial), *(_cell(found, column) for column in shown)]
        for (condition, method, trial, _), found in sorted(cells.items())
        if "failed" in found or any(column.metric in found for column in shown)
    ]
    return markdown_table(("condition", "method", "trial", *(column.heading for column in shown)), lines)


def _cell(found: dict[str, float], column: Column) -> str:
    if column.metric in found:
        return f"{found[column.metric]:.{column.digits}f}"
    return "failed" if "failed" in found else _NONE


def _by_place(rows: Sequence[Row]) -> dict[Place, dict[str, list[float]]]:
    values: dict[Place, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    for row in rows:
        values[row.condition, row.method][row.metric].append(row.value)
    return dict(sorted(values.items()))


def _section(layout: Layout, section: Section, rows: Sequence[Row]) -> str:
    """Return a part of the summary: its own conditions in their order, and those of its columns that have data."""
    ranks = {condition: section.rank(condition) for condition in {row.condition for row in rows}}
    places = _by_place([row for row in rows if ranks[row.condition] is not None])
    if not places and section.absent:
        return section.absent
    measured = {metric for metrics in places.values() for metric in metrics}
    columns = [column for column in layout.columns if column.metric in measured.intersection(section.metrics)]
    return _headlines(columns, dict(sorted(places.items(), key=lambda item: (ranks[item[0][0]], *item[0]))))


def _headlines(columns: Sequence[Column], places: Mapping[Place, Mapping[str, Sequence[float]]]) -> str:
    """Return a line a condition and method (if there are any), a column a metric, the paper's figures below."""
    lines = []
    for (condition, method), metrics in places.items():
        if not any(column.metric in metrics for column in columns) and "failed" not in metrics:
            continue
        counts = [len(metrics[column.metric]) for column in columns if column.metric in metrics]
        n_failed = len(metrics.get("failed", ()))
        cells = [_headline(column, metrics.get(column.metric, ()), n_failed) for column in columns]
        lines.append([condition, method, str(max(counts, default=0)), str(n_failed), *cells])
    paper = [next(iter(column.paper.values()), _NONE) for column in columns]
    if set(paper) != {_NONE}:
        lines.append(["the paper", _NONE, _NONE, _NONE, *paper])
    headings = ["condition", "method", "n", "failed", *(column.heading for column in columns)]
    if all(method == "-" for _, method in places):
        headings, *lines = ([line[0], *line[2:]] for line in (headings, *lines))
    return markdown_table(headings, lines)


def _headline(column: Column, values: Sequence[float], n_failed: int) -> str:
    """Return mean, pooled root mean square or share of one column, with its 95 % interval."""
    if not values:
        return _NONE
    if column.share:
        n, n_ones = len(values) + n_failed, int(sum(values))
        low, high = share_interval(n_ones, n)
        return f"{n_ones} of {n} ({100 * low:.0f}..{100 * high:.0f} %)"
    found = summarise([value**2 for value in values]) if column.rms else summarise(values)
    middle, ends = found.mean, found.interval
    if column.rms:
        middle, ends = math.sqrt(middle), None if ends is None else (math.sqrt(ends[0]), math.sqrt(ends[1]))
    interval = "" if ends is None else f" ({ends[0]:.{column.digits}f}..{ends[1]:.{column.digits}f})"
    return f"{middle:.{column.digits}f}{interval}"


def _all_trials(layout: Layout, rows: Sequence[Row]) -> str:
    lines = []
    for (condition, method), metrics in _by_place(rows).items():
        n_failed = len(metrics.get("failed", ()))
        named = [column for column in layout.columns if column.metric in metrics]
        lines += [
            [condition, method, *_summary(column, metrics[column.metric], n_failed, condition)] for column in named
        ]
        if n_failed and not named:
            lines.append([condition, method, _NONE, "0", str(n_failed), *[_NONE] * 6])
    headings = ("condition", "method", "metric", "n", "failed", "mean", "95 % of mean", "median", "min", "max", "paper")
    return markdown_table(headings, lines)


def _summary(column: Column, values: Sequence[float], n_failed: int, condition: str) -> list[str]:
    found = summarise(values)
    digits = column.digits
    interval = _NONE if found.interval is None else f"{found.interval[0]:.{digits}f}..{found.interval[1]:.{digits}f}"
    spread = (f"{value:.{digits}f}" for value in (found.median, found.minimum, found.maximum))
    paper = column.paper_figure(condition) or _NONE
    return [column.heading, str(found.n), str(n_failed), f"{found.mean:.{digits}f}", interval, *spread, paper]

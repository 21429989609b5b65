"""Rows to `table.md`: a summary, tails, comparisons by page, each trial in the paper's manner, all and their spread."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from statistics import median

from experiments.reporting.blocks import Block, Heading, Note, Table, markdown_page
from experiments.reporting.layout import Column, Layout, Section, Times
from experiments.reporting.markdown import NONE, share, with_interval
from experiments.reporting.pages import Place, PlacePages, pages_by_place
from experiments.reporting.statistics import share_interval, summarise
from experiments.reporting.tails import tails_table
from experiments.reporting.versus import HOW_TO_READ, condition_against_condition, method_against_method
from experiments.trials.schema import Failure, Row

# Beyond this many a line a trial is no longer read; `results.csv` has them all.
_MAX_TRIALS_SHOWN = 10
_HOW_TO_READ = (
    "Mean over the trials (of root mean squares the pooled one) with its 95 % bootstrap interval; shares with "
    "Wilson's, a failed trial counting against them."
)
_FEW = 12
_OF_FEW = (
    f" Under {_FEW} trials the intervals of means hold the truth less often than they say: with 5 in some 88 cases of "
    "100 (docs/adr/0025)."
)


def table(layout: Layout, rows: Sequence[Row], failures: Sequence[Failure], timings: Sequence[Row] = ()) -> str:
    """Return the text of `table.md`; parameters as of :func:`table_blocks`."""
    return markdown_page(table_blocks(layout, rows, failures, timings))


def table_blocks(
    layout: Layout, rows: Sequence[Row], failures: Sequence[Failure], timings: Sequence[Row] = ()
) -> list[Block]:
    """Return the parts of a study's page of tables.

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
    places = pages_by_place(rows)
    parts: list[Block] = [Heading(layout.title, 1), Note(layout.note)]
    for times in layout.times:
        parts += [Heading(times.title), Note(times.note), _times(times, timings)]
    parts += _summary(layout, places)
    for tails in layout.tails:
        spread = tails_table(tails, layout.columns, places)
        parts += [] if spread is None else [Heading(tails.title), Note(tails.note), spread]
    parts += _comparisons(layout, places)
    if not layout.sections and len({row.trial for row in rows}) <= _MAX_TRIALS_SHOWN:
        parts += [Heading("Each trial"), _each_trial(layout, rows)]
    parts += [Heading("All trials"), _all_trials(layout, places)]
    if failures:
        lines = [[str(f.trial), str(f.seed), f.condition, f.method, f.reason.replace("|", "/")] for f in failures]
        parts += [Heading("Failed"), Table(("trial", "seed", "condition", "method", "reason"), lines)]
    return parts


def times_page(times: Times, timings: Sequence[Row]) -> str:
    """Return a table of times as a page of its own."""
    return markdown_page([Heading(times.title, 1), Note(times.note), _times(times, timings)])


def _times(times: Times, timings: Sequence[Row]) -> Table:
    """Return a line a condition and method; of several trials the median."""
    metrics = [column.metric for column in times.columns]
    found = [
        (place, [median(pages.of(metric)) if metric in pages.values else None for metric in metrics])
        for place, pages in pages_by_place(timings).items()
    ]
    ranks = {condition: rank for rank, condition in enumerate(times.order)}
    found.sort(key=lambda item: (ranks.get(item[0][0], len(ranks)), item[0][0], -(item[1][0] or 0.0), item[0][1]))
    lines = [
        [*place, *(with_interval(value, None, c.digits) for value, c in zip(values, times.columns, strict=True))]
        for place, values in found
        if values[0] is not None
    ]
    headings = "condition", "method", *(column.heading for column in times.columns)
    return Table(headings, lines, of_columns=("", "", *metrics))


def _summary(layout: Layout, places: Mapping[Place, PlacePages]) -> list[Block]:
    headlines = [column for column in layout.columns if column.headline]
    if not headlines and not layout.sections:
        return []
    few = any(len(pages.of(metric)) < _FEW for pages in places.values() for metric in pages.values)
    parts: list[Block] = [Heading("Summary"), Note(_HOW_TO_READ + (_OF_FEW if few else ""))]
    if headlines:
        parts.append(_headlines(headlines, places))
    for section in layout.sections:
        parts += [Note(f"**{section.title}.** {section.note}"), _section(layout, section, places)]
    return parts


def _section(layout: Layout, section: Section, places: Mapping[Place, PlacePages]) -> Block:
    """Return a part of the summary: its own conditions in their order, and those of its columns that have data."""
    ranks = {place: section.rank(place[0]) for place in places}
    shown = {place: pages for place, pages in places.items() if ranks[place] is not None}
    if not shown and section.absent:
        return Note(section.absent)
    measured = {metric for pages in shown.values() for metric in pages.values}
    columns = [column for column in layout.columns if column.metric in measured.intersection(section.metrics)]
    return _headlines(columns, dict(sorted(shown.items(), key=lambda item: ranks[item[0]] or 0)))


def _headlines(columns: Sequence[Column], places: Mapping[Place, PlacePages]) -> Table:
    """Return a line a condition and method (if there are any), a column a metric, the paper's figures below."""
    lines = []
    for (condition, method), pages in places.items():
        counts = [len(pages.values[column.metric]) for column in columns if column.metric in pages.values]
        if not counts and not pages.failed:
            continue
        cells = [_headline(column, pages.of(column.metric), len(pages.failed)) for column in columns]
        lines.append([condition, method, str(max(counts, default=0)), str(len(pages.failed)), *cells])
    paper = [next(iter(column.paper.values()), NONE) for column in columns]
    if set(paper) != {NONE}:
        lines.append(["the paper", NONE, NONE, NONE, *paper])
    headings = ["condition", "method", "n", "failed", *(column.heading for column in columns)]
    metrics = ["", "", "", "", *(column.metric for column in columns)]
    if all(method == "-" for _, method in places):
        headings, metrics, *lines = ([line[0], *line[2:]] for line in (headings, metrics, *lines))
    return Table(headings, lines, of_columns=metrics)


def _headline(column: Column, values: Sequence[float], n_failed: int) -> str:
    """Return mean, pooled root mean square or share of one column, with its 95 % interval."""
    if not values:
        return NONE
    if column.share:
        return share(int(sum(values)), len(values) + n_failed)
    if not column.rms:
        found = summarise(values)
        return with_interval(found.mean, found.interval, column.digits)
    found = summarise([value**2 for value in values])
    ends = None if found.interval is None else (math.sqrt(found.interval[0]), math.sqrt(found.interval[1]))
    return with_interval(math.sqrt(found.mean), ends, column.digits)


def _comparisons(layout: Layout, places: Mapping[Place, PlacePages]) -> list[Block]:
    """Return the sections that compare by page."""
    found = []
    if layout.versus is not None:
        title = f"Method against method: `{layout.versus.baseline}`"
        found.append((title, layout.versus.note, method_against_method(layout.versus, layout.columns, places)))
    for changes in layout.changes:
        found.append((changes.title, changes.note, condition_against_condition(changes, layout.columns, places)))
    parts: list[Block] = []
    for title, note, compared in found:
        if compared is not None:
            # Said once, above the first of them.
            parts += [Heading(title), Note(note if parts else f"{note} {HOW_TO_READ}".strip()), compared]
    return parts


def _each_trial(layout: Layout, rows: Sequence[Row]) -> Table:
    cells: dict[tuple[str, str, int, int], dict[str, float]] = defaultdict(dict)
    for row in rows:
        cells[row.condition, row.method, row.trial, row.seed][row.metric] = row.value
    shown = [column for column in layout.columns if any(column.metric in found for found in cells.values())]
    lines = [
        [condition, method, str(trial), *(_cell(found, column) for column in shown)]
        for (condition, method, trial, _), found in sorted(cells.items())
        if "failed" in found or any(column.metric in found for column in shown)
    ]
    headings = "condition", "method", "trial", *(column.heading for column in shown)
    return Table(headings, lines, of_columns=("", "", "", *(column.metric for column in shown)))


def _cell(found: dict[str, float], column: Column) -> str:
    if column.metric in found:
        return f"{found[column.metric]:.{column.digits}f}"
    return "failed" if "failed" in found else NONE


def _all_trials(layout: Layout, places: Mapping[Place, PlacePages]) -> Table:
    lines, metrics = [], list[str]()
    for (condition, method), pages in places.items():
        n_failed = len(pages.failed)
        named = [column for column in layout.columns if column.metric in pages.values]
        lines += [
            [condition, method, *_spread(column, pages.of(column.metric), n_failed, condition)] for column in named
        ]
        metrics += [column.metric for column in named]
        if n_failed and not named:
            lines.append([condition, method, NONE, "0", str(n_failed), *[NONE] * 7])
            metrics.append("")
    headings = ["condition", "method", "metric", "n", "failed", "mean", "95 % of mean"]
    return Table([*headings, "median", "min", "9 in 10 below", "max", "paper"], lines, of_lines=metrics)


def _spread(column: Column, values: Sequence[float], n_failed: int, condition: str) -> list[str]:
    found, digits = summarise(values), column.digits
    mean, interval = found.mean, found.interval
    if column.share:
        # As in the summary: a failed trial counts against it.
        n, n_ones = len(values) + n_failed, int(sum(values))
        mean, interval = n_ones / n, share_interval(n_ones, n)
    ends = NONE if interval is None else f"{interval[0]:.{digits}f}..{interval[1]:.{digits}f}"
    spread = [with_interval(value, None, digits) for value in (found.median, found.minimum, found.p90, found.maximum)]
    paper = column.paper_figure(condition) or NONE
    return [column.heading, str(found.n), str(n_failed), f"{mean:.{digits}f}", ends, *spread, paper]

"""The numbers on a figure page: which stand in its table, a line a column of pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import fmean

from matplotlib.textpath import TextPath

from experiments.reporting.figure_layout import FigurePage
from experiments.reporting.layout import Column
from experiments.trials.record import FAILED
from experiments.trials.schema import Row

FONT_PT = 8.0
"""Size of all text on a page but its title."""

GAP_MM = 3.0
"""Between two columns of a table."""

_NONE = "–"
_MM_PER_PT = 25.4 / 72

Figures = Mapping[tuple[str, str, str], Mapping[int, float]]
"""The value of each trial by condition, method and metric."""


@dataclass(frozen=True, slots=True)
class Group:
    """Columns of a table under one heading.

    Attributes
    ----------
    heading : str
        Condition, and on a line below it the method, if any.
    subheadings : tuple of str
        One a column: metric and, on a line below, its unit.
    cells : tuple of tuples of str
        One tuple a line of the table, each as long as `subheadings`.
    """

    heading: str
    subheadings: tuple[str, ...]
    cells: tuple[tuple[str, ...], ...]

    @property
    def widths_mm(self) -> list[float]:
        """Width of each column, with the gap before it [mm]."""
        texts = [[*sub.split("\n"), *(line[i] for line in self.cells)] for i, sub in enumerate(self.subheadings)]
        widths = [GAP_MM + max(text_width_mm(text) for text in column) for column in texts]
        heading = GAP_MM + max(text_width_mm(text) for text in self.heading.split("\n"))
        return [width * max(1.0, heading / sum(widths)) for width in widths]


@dataclass(frozen=True, slots=True)
class NumbersTable:
    """A table ready to be printed.

    Attributes
    ----------
    labels : tuple of str
        The first column, one a line.
    groups : tuple of Group
        The others, left to right.
    n_below : int
        Lines at the foot that are set apart: the mean, the paper's.
    """

    labels: tuple[str, ...]
    groups: tuple[Group, ...]
    n_below: int

    @property
    def label_width_mm(self) -> float:
        """Width of the first column [mm]."""
        return max(text_width_mm(label) for label in self.labels)

    @property
    def width_mm(self) -> float:
        """Width of the whole table [mm]."""
        return self.label_width_mm + sum(sum(group.widths_mm) for group in self.groups)

    @property
    def head_lines(self) -> tuple[int, int]:
        """Lines of text in the tallest heading and in the tallest subheading."""
        headings = [group.heading for group in self.groups]
        subheadings = [text for group in self.groups for text in group.subheadings]
        return max(text.count("\n") for text in headings) + 1, max(text.count("\n") for text in subheadings) + 1

    def within(self, width_mm: float) -> NumbersTable:
        """Return the table without the last groups that go beyond a width [mm]; `table.md` has all."""
        table = self
        while len(table.groups) > 1 and table.width_mm > width_mm:
            table = replace(table, groups=table.groups[:-1])
        return table


def numbers_table(
    page: FigurePage, shown: Sequence[tuple[str, str]], columns: Sequence[Column], rows: Sequence[Row]
) -> NumbersTable | None:
    """Put the numbers of a page into a table; None without any.

    Parameters
    ----------
    page : FigurePage
        Asks for the numbers.
    shown : sequence of (heading, column)
        The page's columns, a line each.
    columns : sequence of Column
        The study's, which name and round the metrics.
    rows : sequence of Row
        All results.
    """
    if page.numbers is None:
        return None
    figures, by_name = _figures(rows), {column.metric: column for column in columns}
    metrics = [by_name[metric] for metric in page.numbers.metrics]
    with_paper = any(column.paper_figure(condition) for column in metrics for _, condition in page.numbers.conditions)
    groups = []
    for heading, condition in page.numbers.conditions:
        lines = [_Line(condition.format(column=name), None if page.columns else int(name)) for _, name in shown]
        lines += [] if page.columns else [_Line(condition, None)]
        places = {line.place for line in lines}
        for method in sorted({method for place, method, _ in figures if place in places}):
            measured = [c for c in metrics if any((place, method, c.metric) in figures for place in places)] or metrics
            cells = [tuple(line.cell(figures, method, column) for column in measured) for line in lines]
            if with_paper:
                cells.append(tuple(column.paper_figure(condition) or _NONE for column in measured))
            named = heading if method == "-" else f"{heading}\n{method}"
            groups.append(Group(named, tuple(c.heading.replace(" ", "\n") for c in measured), tuple(cells)))
    conditions = {condition for _, condition in page.numbers.conditions}
    n_trials = len({row.trial for row in rows if row.condition in conditions})
    mean = [] if page.columns else [f"mean of {n_trials}"]
    below = [*mean, *(["the paper"] if with_paper else [])]
    return NumbersTable((*(heading for heading, _ in shown), *below), tuple(groups), len(below)) if groups else None


def text_width_mm(text: str) -> float:
    """Width of a line of text in the page's font [mm]."""
    return float(TextPath((0, 0), text, size=FONT_PT).get_extents().width) * _MM_PER_PT if text.strip() else 0.0


@dataclass(frozen=True, slots=True)
class _Line:
    """Where a line's numbers come from: a condition, and one trial or all of them."""

    place: str
    trial: int | None

    def cell(self, figures: Figures, method: str, column: Column) -> str:
        """Return a number, or what there is in its place: no mean hides a trial that failed."""
        found = figures.get((self.place, method, column.metric), {})
        failed = figures.get((self.place, method, FAILED), {})
        if self.trial is not None:
            value = found.get(self.trial)
            missing = "failed" if self.trial in failed else _NONE
        else:
            value = fmean(found.values()) if found and not failed else None
            missing = f"{len(failed)} failed" if failed else _NONE
        return missing if value is None else f"{value:.{column.digits}f}"


def _figures(rows: Sequence[Row]) -> Figures:
    figures: dict[tuple[str, str, str], dict[int, float]] = {}
    for row in rows:
        figures.setdefault((row.condition, row.method, row.metric), {})[row.trial] = row.value
    return figures

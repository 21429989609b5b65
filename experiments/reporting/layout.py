"""How a study's table and figures look, as data: each study declares it, nothing here knows any study."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from experiments.reporting.figure_layout import Curve, Diagram, FigurePage, Ladder, Montage, Plot, Shares


@dataclass(frozen=True, slots=True)
class Column:
    """A metric in the table.

    Attributes
    ----------
    metric : str
        Column `metric` of `results.csv`.
    heading : str
        What the table calls it, with its unit.
    digits : int
        Decimals shown.
    paper : mapping of condition to text
        The paper's figure beside ours; a condition also stands for those that go on with "/".
    headline : bool
        Whether the summary at the head of the table shows it.
    share : bool
        0 or 1 a trial: the summary counts the ones, and a failed trial as none.
    rms : bool
        Root mean squares: the summary pools them as one.
    """

    metric: str
    heading: str
    digits: int = 3
    paper: Mapping[str, str] = field(default_factory=dict)
    headline: bool = False
    share: bool = False
    rms: bool = False

    def paper_figure(self, condition: str) -> str:
        """Return the paper's figure for a condition, "" where it has none."""
        return self.paper.get(condition, self.paper.get(condition.split("/")[0], ""))


def named_by(wanted: str, condition: str) -> bool:
    """Whether a condition is the wanted one, or goes on where that ends with "/" or "="."""
    return condition == wanted or (wanted.endswith(("/", "=")) and condition.startswith(wanted))


@dataclass(frozen=True, slots=True)
class Section:
    """A part of the summary: some conditions by some metrics.

    Attributes
    ----------
    title, note : str
        Heading and the sentences under it.
    conditions : tuple of str
        A line each, in this order; one without data has none. One that ends with "/" or "=" stands for all that go
        on there.
    metrics : tuple of str
        A column each, in the layout's order; one without data has none.
    absent : str
        What stands in the table's place if none of it has data; "" for an empty table.
    """

    title: str
    note: str
    conditions: tuple[str, ...]
    metrics: tuple[str, ...]
    absent: str = ""

    def rank(self, condition: str) -> int | None:
        """Return the place of a condition from the top, None if it is none of this section's."""
        return next((place for place, wanted in enumerate(self.conditions) if named_by(wanted, condition)), None)


@dataclass(frozen=True, slots=True)
class Times:
    """A table of `timings.csv`: a line a condition and method that has the first column.

    Attributes
    ----------
    title, note : str
        Heading, and the sentences under it.
    columns : tuple of Column
        Metrics of the timings, left to right; within a condition the lines fall in the first one.
    order : tuple of str
        The conditions from top to bottom; others follow by name.
    """

    title: str
    note: str
    columns: tuple[Column, ...]
    order: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Tails:
    """A part of the table: how a metric is spread over the pages, and on how many of them all is well.

    Attributes
    ----------
    title, note : str
        Heading and the sentences under it.
    conditions : tuple of str
        Lines, as in `Section`; only those that have the metrics.
    metrics : tuple of str
        A line each.
    share : str
        A metric that is 0 or 1 a trial, which each line shows too.
    """

    title: str
    note: str
    conditions: tuple[str, ...]
    metrics: tuple[str, ...]
    share: str


@dataclass(frozen=True, slots=True)
class Versus:
    """Method against method on the same pages: a line a condition, method and metric.

    Attributes
    ----------
    note : str
        The sentences above it.
    baseline : str
        The method that all others are compared with; a run without it has no such table.
    conditions : tuple of str
        As in `Section`.
    metrics : tuple of str
        Those of which less is better.
    """

    note: str
    baseline: str
    conditions: tuple[str, ...]
    metrics: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Changes:
    """Condition against condition on the same pages: a line a pair and method, a column a metric.

    Attributes
    ----------
    title, note : str
        Heading and the sentences under it.
    pairs : tuple of (condition, against)
        From top to bottom; a condition that ends with "/" or "=" stands for all that go on there, and where `against`
        ends so too, each is compared with the one that goes on alike.
    metrics : tuple of str
        Those of which less is better; of the first one the ratio is shown too, and on how many pages it is better.
    """

    title: str
    note: str
    pairs: tuple[tuple[str, str], ...]
    metrics: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Layout:
    """Table and figures of one study.

    Attributes
    ----------
    title, note : str
        Heading of `table.md` and the sentences under it.
    columns : tuple of Column
        The metrics, left to right; the table of single trials shows these in the paper's manner, a line a trial.
    plots : tuple of Plot
        The figures.
    montages : tuple of Montage
        Figures of pictures; a picture in one of them, or on a page, is not written by itself.
    sections : tuple of Section
        Parts of the summary, instead of one table of all conditions by the headline metrics.
    times : tuple of Times
        Tables of times that head `table.md`.
    profile : Times or None
        Of a study of speed: what is written as `profile.md`.
    pages : tuple of FigurePage
        Printed pages of pictures and numbers.
    curves : tuple of Curve
        Figures of one metric against another.
    diagrams : tuple of Diagram
        Figures of panels, times included.
    shares : tuple of Shares
        Figures of outcomes.
    tails : tuple of Tails
        Quantiles, after the summary.
    versus : Versus or None
        Method against method, after those.
    changes : tuple of Changes
        Condition against condition, after that.
    ladders : tuple of Ladder
        Figures of steps.
    """

    title: str
    note: str
    columns: tuple[Column, ...]
    plots: tuple[Plot, ...] = ()
    montages: tuple[Montage, ...] = ()
    sections: tuple[Section, ...] = ()
    times: tuple[Times, ...] = ()
    profile: Times | None = None
    pages: tuple[FigurePage, ...] = ()
    curves: tuple[Curve, ...] = ()
    diagrams: tuple[Diagram, ...] = ()
    shares: tuple[Shares, ...] = ()
    tails: tuple[Tails, ...] = ()
    versus: Versus | None = None
    changes: tuple[Changes, ...] = ()
    ladders: tuple[Ladder, ...] = ()

"""How a study's table and figures look, as data: each study declares it, nothing here knows any study."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


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


@dataclass(frozen=True, slots=True)
class Plot:
    """A figure: one metric, a dot a trial, one row of dots for each condition and method.

    Attributes
    ----------
    name : str
        Written as `figures/NAME.png`.
    metric, label : str
        What is drawn and how its axis is called, with the unit.
    paper : float or None
        The paper's figure, drawn as a line; in the metric's unit.
    """

    name: str
    metric: str
    label: str
    paper: float | None = None


@dataclass(frozen=True, slots=True)
class Montage:
    """A figure of pictures: a column a trial, a line a kind of picture, as in the paper's figure 3.

    Attributes
    ----------
    name : str
        Written as `figures/NAME.png`.
    lines : tuple of (heading, picture)
        The trial's number stands for "{trial}" in the picture's name.
    item : str
        What a trial shows: "page 1", ...
    caption : str
        Written under it; "" for none.
    """

    name: str
    lines: tuple[tuple[str, str], ...]
    item: str = "page"
    caption: str = ""


@dataclass(frozen=True, slots=True)
class Section:
    """A part of the summary: some conditions by some metrics.

    Attributes
    ----------
    title, note : str
        Heading and the sentences under it.
    conditions : tuple of str
        A line each, in this order; one without data has none.
    metrics : tuple of str
        A column each, in the layout's order; one without data has none.
    """

    title: str
    note: str
    conditions: tuple[str, ...]
    metrics: tuple[str, ...]


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
        Figures of pictures; a picture in one of them is not written by itself.
    sections : tuple of Section
        Parts of the summary, instead of one table of all conditions by the headline metrics.
    times : tuple of Times
        Tables of times that head `table.md`.
    profile : Times or None
        Of a study of speed: what is written as `profile.md`.
    """

    title: str
    note: str
    columns: tuple[Column, ...]
    plots: tuple[Plot, ...] = ()
    montages: tuple[Montage, ...] = ()
    sections: tuple[Section, ...] = ()
    times: tuple[Times, ...] = ()
    profile: Times | None = None

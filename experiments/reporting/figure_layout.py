"""How a study's figures look, as data."""

from __future__ import annotations

from dataclasses import dataclass


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
class Curve:
    """A figure: the mean of one metric against that of another, with its 95 % interval, a line a condition and method.

    Attributes
    ----------
    name : str
        Written as `figures/NAME.png`.
    x, x_label, y, y_label : str
        The metrics, and how their axes are called, with the unit.
    conditions : tuple of str
        A line each; its points are the condition and those that go on with "/" after it. A point's own rows tell where
        it stands across, or else those of the first line.
    bands : tuple of (text, low, high)
        The paper's figures, drawn as bands across; in y's unit.
    log : bool
        Whether both axes are logarithmic; all figures are positive then.
    """

    name: str
    x: str
    x_label: str
    y: str
    y_label: str
    conditions: tuple[str, ...]
    bands: tuple[tuple[str, float, float], ...] = ()
    log: bool = False


@dataclass(frozen=True, slots=True)
class Panel:
    """A pair of axes, logarithmic unless said otherwise: a line a method, its points the medians of conditions.

    Attributes
    ----------
    conditions : tuple of (beginning, text)
        The conditions that are points, joined in the order of the number after their last "="; the text is added to
        the method's name, so that each beginning is a line of its own.
    x, y : str
        Metrics of results or timings; an empty x stands for that number.
    x_label, y_label : str
        How the axes are called, with the unit.
    theory : str
        A metric drawn as a broken line of the same colour; "" for none.
    levels : tuple of (text, condition, metric)
        Broken lines across, at a metric's median under method "-".
    linear : bool
        Plain axes.
    """

    conditions: tuple[tuple[str, str], ...]
    x: str
    y: str
    x_label: str
    y_label: str
    theory: str = ""
    levels: tuple[tuple[str, str, str], ...] = ()
    linear: bool = False


@dataclass(frozen=True, slots=True)
class Diagram:
    """A figure of panels side by side, with one legend.

    Attributes
    ----------
    name, title : str
        Written as `figures/NAME.png`, and what stands above.
    panels : tuple of Panel
        From left to right.
    """

    name: str
    title: str
    panels: tuple[Panel, ...]


@dataclass(frozen=True, slots=True)
class Shares:
    """A figure of outcomes: for each method a bar a condition, divided by the share of its trials that ended so.

    Attributes
    ----------
    name, title, label : str
        Written as `figures/NAME.png`, what stands above, and what the bars' numbers are.
    conditions : str
        Beginning of the conditions; the bars are numbered by what follows the last "=".
    metrics : tuple of (metric, colour)
        Metrics that are 0 or 1 a trial, from the bottom up.
    """

    name: str
    title: str
    label: str
    conditions: str
    metrics: tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class Montage:
    """A figure of pictures: a column a trial, a line a kind of picture.

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
class Numbers:
    """The table on a figure page: a line for each of its columns of pictures, then the mean and the paper's figures.

    Across, each condition stands once for every method that has rows; under it its metrics, named and rounded as the
    layout's columns. What has no rows has no place.

    Attributes
    ----------
    conditions : tuple of (heading, condition)
        Left to right. "{column}" in a condition stands for the line's column, as in `FigurePage.lines`.
    metrics : tuple of str
        The metrics of each condition, left to right; each must be a column of the layout.
    """

    conditions: tuple[tuple[str, str], ...]
    metrics: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class FigurePage:
    """A printed page of pictures and their numbers, like the paper's figures 3, 4 and 5.

    Lines of pictures under Roman numerals, then the control beside the table of numbers, then the caption. Pictures
    are those that trials record (`Recorder.picture`).

    Attributes
    ----------
    name : str
        Written as `figures/NAME.png`: as wide as the text of an A4 page, at most as tall, below 2 MB.
    title, caption : str
        Heading, and what is printed under the page.
    lines : tuple of (heading, picture)
        One kind of picture each. In the picture's name "{column}" stands for the column; "{method}" for a method: the
        line is drawn once for each that has pictures, which the heading names.
    columns : tuple of (heading, column)
        What stands side by side, from left to right: cases, for example. Empty for a column a trial, by its number
        from 0, eight at most; more than five are drawn in two blocks.
    item : str
        What a column of a trial is called: "page 1", ...
    control : (heading, picture) or None
        Drawn once, larger; "{column}" stands for the first column that has one.
    numbers : Numbers or None
        With a column a trial its lines are that trial's figures and their mean over all trials, the shown ones or not;
        with `columns` each line is the mean over the trials, and nothing is pooled across lines.
    """

    name: str
    title: str
    caption: str
    lines: tuple[tuple[str, str], ...]
    columns: tuple[tuple[str, str], ...] = ()
    item: str = "page"
    control: tuple[str, str] | None = None
    numbers: Numbers | None = None


@dataclass(frozen=True, slots=True)
class Ladder:
    """A figure of steps from one way to another: what is left after each, and what each is worth by itself.

    Attributes
    ----------
    name, title : str
        Written as `figures/NAME.png`, and what stands above.
    metric, label : str
        What is drawn, and how its axis is called, with the unit.
    rungs : tuple of (text, condition)
        The start, then what stands after each step; a rung's text names the step.
    worth : tuple of (text, pairs)
        For each step, in the same order, the condition with it and the one without it: drawn beside the step as the
        mean of the pages' differences, the one without less the one with it.
    paper : float or None
        The paper's figure, drawn as a line.
    """

    name: str
    title: str
    metric: str
    label: str
    rungs: tuple[tuple[str, str], ...]
    worth: tuple[tuple[str, tuple[tuple[str, str], ...]], ...]
    paper: float | None = None

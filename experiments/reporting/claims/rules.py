"""When a claim counts as reproduced: written rules from a measured figure to a verdict."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from math import inf, isinf
from typing import Protocol

from deskew.errors import require

FEWEST = 5
"""Trials without which a share says nothing: as many as the paper's own experiments had."""


class Verdict(StrEnum):
    """What a test says of a claim."""

    EXCEEDED = "exceeded"
    REPRODUCED = "reproduced"
    NOT_REPRODUCED = "not reproduced"
    UNDECIDED = "undecided"
    NOT_TESTED = "not tested: report missing"


@dataclass(frozen=True, slots=True)
class Figure:
    """A measured figure with how sure it is.

    Attributes
    ----------
    value : float
        In `unit`; of a share, in [0, 1].
    interval : (low, high) or None
        95 % interval in `unit`; None where there are too few trials for one.
    n : int
        Trials behind it, the failed ones of a share included; 0 where every trial failed.
    unit : str
        "" for a plain number.
    digits : int
        Decimals shown.
    n_failed : int
        Trials that gave no value.
    share : bool
        A share of the trials.
    """

    value: float
    interval: tuple[float, float] | None
    n: int
    unit: str = ""
    digits: int = 3
    n_failed: int = 0
    share: bool = False

    def __post_init__(self) -> None:
        require(self.n > 0 or self.n_failed > 0, "n", "be 1 or more", self.n)

    @property
    def text(self) -> str:
        """The figure and its interval."""
        if self.n == 0:
            return f"all {self.n_failed} failed"
        if self.share:
            ends = "" if self.interval is None else f" ({100 * self.interval[0]:.0f}..{100 * self.interval[1]:.0f} %)"
            return f"{round(self.value * self.n)} of {self.n}{ends}"
        ends = "" if self.interval is None else f" ({self._number(self.interval[0])}..{self._number(self.interval[1])})"
        return f"{self._number(self.value)}{ends}{self.unit and ' '}{self.unit}"

    @property
    def counted(self) -> str:
        """The same with the number of trials, where a share does not say it anyway."""
        if self.share or self.n == 0:
            return self.text
        return f"{self.text}, n = {self.n}" + (f", {self.n_failed} failed" if self.n_failed else "")

    def _number(self, value: float) -> str:
        return f"{value:.{self.digits}f}"


class Rule(Protocol):
    """From a figure to a verdict."""

    @property
    def text(self) -> str:
        """The rule in words."""

    def verdict(self, figure: Figure) -> Verdict:
        """Judge a figure."""


@dataclass(frozen=True, slots=True)
class Between:
    """A range whose one end is better: 0.25 to 0.5 mm, of which 0.25 is.

    The whole interval beyond the good end exceeds the claim; with its worst end inside, it reproduces it; the whole
    interval beyond the bad end does not; one that lies across the bad end decides nothing. A mean over the trials that
    succeeded would flatter, so with a failed trial no claim about a mean is reproduced.

    Attributes
    ----------
    good, bad : float
        Both the same for a single figure; an infinite good end cannot be exceeded.
    """

    good: float
    bad: float

    @property
    def text(self) -> str:
        """The rule in words."""
        less = self.good <= self.bad
        beyond, within = ("below", "at most") if less else ("above", "at least")
        exceeded = "" if isinf(self.good) else f", exceeded if it is {beyond} {self.good:g}"
        return f"the whole interval is {within} {self.bad:g}{exceeded}"

    def verdict(self, figure: Figure) -> Verdict:
        """Judge a figure by the ends of its interval."""
        if figure.n_failed:
            return Verdict.NOT_REPRODUCED
        if figure.interval is None:
            return Verdict.UNDECIDED
        sign = 1.0 if self.good <= self.bad else -1.0
        best, worst = sorted(sign * end for end in figure.interval)
        if worst < sign * self.good:
            return Verdict.EXCEEDED
        if worst <= sign * self.bad:
            return Verdict.REPRODUCED
        return Verdict.NOT_REPRODUCED if best > sign * self.bad else Verdict.UNDECIDED


def at_most(limit: float) -> Between:
    """Return the rule of a bound that is kept or not."""
    return Between(-inf, limit)


def within(limit: float) -> Between:
    """Return the rule of "within so much", which counts as exceeded by half of it."""
    return Between(limit / 2, limit)


def stated(value: float) -> Between:
    """Return the rule of a single figure, less of which is better."""
    return Between(value, value)


@dataclass(frozen=True, slots=True)
class Band:
    """A range no end of which is better: the whole interval in it, out of it, or across an end of it."""

    low: float
    high: float

    @property
    def text(self) -> str:
        """The rule in words."""
        return f"the whole interval lies within {self.low:g} and {self.high:g}"

    def verdict(self, figure: Figure) -> Verdict:
        """Judge a figure by the ends of its interval."""
        if figure.n_failed:
            return Verdict.NOT_REPRODUCED
        if figure.interval is None:
            return Verdict.UNDECIDED
        low, high = figure.interval
        if self.low <= low and high <= self.high:
            return Verdict.REPRODUCED
        return Verdict.NOT_REPRODUCED if high < self.low or low > self.high else Verdict.UNDECIDED


@dataclass(frozen=True, slots=True)
class Above:
    """What must be more than a number, such as a gain more than none."""

    limit: float

    @property
    def text(self) -> str:
        """The rule in words."""
        return f"the whole interval is above {self.limit:g}"

    def verdict(self, figure: Figure) -> Verdict:
        """Judge a figure by the ends of its interval."""
        if figure.n_failed:
            return Verdict.NOT_REPRODUCED
        if figure.interval is None:
            return Verdict.UNDECIDED
        low, high = figure.interval
        if low > self.limit:
            return Verdict.REPRODUCED
        return Verdict.NOT_REPRODUCED if high <= self.limit else Verdict.UNDECIDED


@dataclass(frozen=True, slots=True)
class Every:
    """What has to hold in every trial, a failed one being one in which it does not."""

    @property
    def text(self) -> str:
        """The rule in words."""
        return f"it holds in every trial, of {FEWEST} or more"

    def verdict(self, figure: Figure) -> Verdict:
        """Judge a share."""
        require(figure.share, "figure", "be a share", "a number")
        if round(figure.value * figure.n) < figure.n:
            return Verdict.NOT_REPRODUCED
        return Verdict.REPRODUCED if figure.n >= FEWEST else Verdict.UNDECIDED

"""Figures that stand beside each other, and how a cell shows them."""

from __future__ import annotations

from dataclasses import dataclass, replace

from experiments.reporting.claims.claim import mean
from experiments.reporting.claims.measures import Evidence, Mean, Measure, MissingError, Values
from experiments.reporting.claims.rules import Figure
from experiments.reporting.markdown import NONE, with_interval

__all__ = ["Once", "Rest", "cell", "mean", "sources"]


@dataclass(frozen=True, slots=True)
class Once:
    """One figure that all trials of a run share, such as its calibration's; recorded in each, it is one all the same.

    Attributes
    ----------
    values : Values
        Equal in all trials.
    unit, digits, scale : str, int, float
        As in `Mean`.
    """

    values: Values
    unit: str = ""
    digits: int = 3
    scale: float = 1.0

    @property
    def reports(self) -> tuple[str, ...]:
        """The report that it reads."""
        return (self.values.report,)

    def figure(self, evidence: Evidence) -> Figure:
        """Return the figure, without an interval."""
        found = set(self.values.read(evidence).values())
        if len(found) != 1:
            raise MissingError(self.values.report)
        return Figure(self.scale * found.pop(), None, 1, self.unit, self.digits)


@dataclass(frozen=True, slots=True)
class Rest:
    """What a mean leaves of a whole, such as the letters read of those not missed.

    Attributes
    ----------
    whole : float
        In the mean's unit.
    part : Mean
        Taken from it.
    """

    whole: float
    part: Mean

    @property
    def reports(self) -> tuple[str, ...]:
        """The reports that it reads."""
        return self.part.reports

    def figure(self, evidence: Evidence) -> Figure:
        """Return the rest, its interval turned round."""
        found = self.part.figure(evidence)
        ends = None if found.interval is None else (self.whole - found.interval[1], self.whole - found.interval[0])
        return replace(found, value=self.whole - found.value, interval=ends)


def cell(measure: Measure | None, evidence: Evidence) -> list[str]:
    """Return two cells, the figure with its interval and the number of trials; dashes where there is none."""
    if measure is None:
        return [NONE, NONE]
    try:
        found = measure.figure(evidence)
    except MissingError:
        return [NONE, NONE]
    failed = f" ({found.n_failed} failed)" if found.n_failed else ""
    return [with_interval(found.value, found.interval, found.digits), f"{found.n}{failed}"]


def sources(measure: Measure | None) -> str:
    """Return links to the reports behind a figure."""
    return "" if measure is None else ", ".join(f"[{name}]({name}/table.md)" for name in measure.reports)

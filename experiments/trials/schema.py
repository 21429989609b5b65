"""The key of a trial and the row of a result: the columns that everything downstream reads."""

from __future__ import annotations

from dataclasses import astuple, dataclass
from math import isfinite

import numpy as np

from deskew.errors import require

# The unit is the name's last word; a metric without one is a count, a ratio or a flag.
_UNITS = {name: name for name in ("px", "mm", "deg", "rad", "units", "s")}
_UNITS |= {"percent": "%", "grey": "grey levels", "mb": "MB"}


def unit_of(metric: str) -> str:
    """Return a metric's unit, by its name: `corner_mean_px` px, `seconds_render` s, `shrink_true` %, `flips` 1."""
    if metric.startswith("seconds_"):
        return "s"
    if metric.startswith("shrink_"):
        return "%"
    return _UNITS.get(metric.rsplit("_", 1)[-1], "1")


@dataclass(frozen=True, slots=True, order=True)
class TrialKey:
    """One planned piece of work; the store's primary key, together with the fingerprint of what produced it.

    Attributes
    ----------
    experiment : str
        Name of the study.
    condition, method : str
        What the trial covers; "-" where one trial covers several. A trial that fails as a whole is reported here.
    trial : int
        0, 1, ...: which sheet, plane or board.
    seed : int
        Seed of the run.
    """

    experiment: str
    condition: str = "-"
    method: str = "-"
    trial: int = 0
    seed: int = 0

    def generator(self) -> np.random.Generator:
        """Return this trial's random numbers: trial i of seed s uses ``SeedSequence([s, i])``."""
        return np.random.default_rng(np.random.SeedSequence([self.seed, self.trial]))


@dataclass(frozen=True, slots=True, order=True)
class Row:
    """One number: a line of `results.csv` or `timings.csv`, in this order of columns."""

    experiment: str
    condition: str
    method: str
    trial: int
    seed: int
    metric: str
    value: float
    unit: str

    def __post_init__(self) -> None:
        # A number that cannot be had is a failure with a reason, never a NaN in a table.
        require(isfinite(self.value), self.metric, "be finite", self.value)

    @classmethod
    def of(cls, key: TrialKey, condition: str, method: str, metric: str, value: float) -> Row:
        """Return the row of a metric measured in a trial."""
        number = float(value)
        return cls(key.experiment, condition, method, key.trial, key.seed, metric, number, unit_of(metric))

    def cells(self) -> tuple[str, ...]:
        """Return the row as text; the value as the shortest digits that give the same double again."""
        return tuple(repr(cell) if isinstance(cell, float) else str(cell) for cell in astuple(self))


@dataclass(frozen=True, slots=True, order=True)
class Failure:
    """Why a trial, or one method in it, gave no numbers."""

    condition: str
    method: str
    trial: int
    seed: int
    reason: str

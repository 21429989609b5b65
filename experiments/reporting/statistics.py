"""What is said of a set of trials: centre, spread and how sure the mean is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from deskew.errors import require

_N_RESAMPLES = 10_000


@dataclass(frozen=True, slots=True)
class Summary:
    """One metric over the trials of one condition and method, in the metric's unit.

    Attributes
    ----------
    n : int
        Trials that gave a value.
    mean, median, minimum, maximum : float
        Of those values.
    interval : (low, high) or None
        95 % percentile bootstrap interval of the mean; None under 3 trials, where resampling says nothing.
    """

    n: int
    mean: float
    median: float
    minimum: float
    maximum: float
    interval: tuple[float, float] | None


def summarise(values: Sequence[float]) -> Summary:
    """Summarise finite values, at least one; the resampling has its own fixed seed, so the interval repeats."""
    require(len(values) > 0, "values", "hold at least one number", "none")
    data = np.sort(np.asarray(values, dtype=np.float64))
    interval = _interval(data) if len(data) >= 3 else None
    mean, median = float(data.mean()), float(np.median(data))
    return Summary(len(data), mean, median, float(data[0]), float(data[-1]), interval)


def _interval(data: np.ndarray) -> tuple[float, float]:
    picks = np.random.default_rng(0).integers(len(data), size=(_N_RESAMPLES, len(data)))
    low, high = np.percentile(data[picks].mean(axis=1), [2.5, 97.5])
    return float(low), float(high)

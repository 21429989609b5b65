"""What is said of a set of trials: centre, spread and how sure the mean is."""

from __future__ import annotations

import math
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


def share_interval(n_ones: int, n: int) -> tuple[float, float]:
    """Return Wilson's 95 % interval of a share; unlike a bootstrap's it has a width when all trials agree.

    References
    ----------
    E. B. Wilson, "Probable inference, the law of succession, and statistical inference", JASA 22, 1927.
    """
    require(0 <= n_ones <= n and n > 0, "n_ones", f"be in [0, {n}] with n > 0", n_ones)
    z = 1.959963984540054
    share, spread = n_ones / n, z * z / n
    middle = (share + spread / 2) / (1 + spread)
    half = z / (1 + spread) * math.sqrt(share * (1 - share) / n + spread / (4 * n))
    return max(0.0, middle - half), min(1.0, middle + half)


def _interval(data: np.ndarray) -> tuple[float, float]:
    picks = np.random.default_rng(0).integers(len(data), size=(_N_RESAMPLES, len(data)))
    low, high = np.percentile(data[picks].mean(axis=1), [2.5, 97.5])
    return float(low), float(high)

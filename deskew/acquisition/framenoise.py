"""Noise of a camera's frames by how bright they are: read noise plus shot noise, a straight line in the variance."""

from __future__ import annotations

import numpy as np

from deskew.types import Floats

ROUNDING_VARIANCE = 1.0 / 12.0
"""No camera is quieter than the rounding of its grey levels [grey levels^2]."""

_LEVELS = 8


def variance_line(deviations: Floats, brightness: Floats, median: float) -> Floats:
    """Fit the variance as a straight line in the brightness, robustly.

    Parameters
    ----------
    deviations : (height, width) array
        A square, or a mean of squares, of what is noise alone [grey levels^2].
    brightness : (height, width) array
        What the noise depends on [grey levels].
    median : float
        Median of `deviations` where their expectation is 1.

    Returns
    -------
    (8,) array
        Variance [grey levels^2] at even steps of brightness from 0 to its largest.
    """
    edges = np.unique(np.quantile(brightness, np.linspace(0.0, 1.0, _LEVELS + 1)))
    members = np.clip(np.searchsorted(edges, brightness, side="right") - 1, 0, max(len(edges) - 2, 0))
    levels, variances = [], []
    for i in range(max(len(edges) - 1, 1)):
        chosen = members == i
        levels.append(float(brightness[chosen].mean()))
        variances.append(float(np.median(deviations[chosen])) / median)
    line = np.polynomial.Polynomial.fit(levels, variances, 1 if len(levels) > 2 else 0)
    return np.asarray(line(np.linspace(0.0, 1.0, _LEVELS) * float(brightness.max())))


def noise_at(variances: Floats, brightness: Floats) -> Floats:
    """Return each pixel's standard deviation [grey levels] from a :func:`variance_line`, never below rounding's."""
    levels = np.linspace(0.0, 1.0, len(variances)) * float(brightness.max())
    return np.asarray(np.sqrt(np.maximum(np.interp(brightness, levels, variances), ROUNDING_VARIANCE)))

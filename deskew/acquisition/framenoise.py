"""Noise of a camera's frames by how bright they are, from what is left over where frames have to agree."""

from __future__ import annotations

import numpy as np

from deskew.types import Floats

ROUNDING_VARIANCE = 1.0 / 12.0
"""No camera is quieter than the rounding of its grey levels [grey levels^2]."""

_LEVELS = 12
_FEWEST = 200  # pixels that make a median


def variance_by_level(deviations: Floats, brightness: Floats, median: float) -> Floats:
    """Measure the variance at even steps of brightness, robustly.

    Even steps and not even shares of the pixels: a little ink on a white page has a noise of its own, which nothing
    that lies at the page's brightness can be extrapolated to.

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
    (13,) array
        Variance [grey levels^2] at even steps of brightness from 0 to its largest, straight lines between those that
        enough pixels have.
    """
    top = max(float(brightness.max()), 1e-9)
    members = np.clip((brightness * (_LEVELS / top)).astype(int), 0, _LEVELS - 1)
    levels, variances = [], []
    for i in range(_LEVELS):
        chosen = members == i
        if chosen.sum() >= _FEWEST:
            levels.append(float(brightness[chosen].mean()))
            variances.append(float(np.median(deviations[chosen])) / median)
    if not levels:
        levels, variances = [0.0], [float(np.median(deviations)) / median]
    return np.interp(np.linspace(0.0, top, _LEVELS + 1), levels, variances)


def noise_at(variances: Floats, brightness: Floats) -> Floats:
    """Return each pixel's standard deviation [grey levels] from a :func:`variance_by_level`, not below rounding's."""
    levels = np.linspace(0.0, max(float(brightness.max()), 1e-9), len(variances))
    return np.asarray(np.sqrt(np.maximum(np.interp(brightness, levels, variances), ROUNDING_VARIANCE)))

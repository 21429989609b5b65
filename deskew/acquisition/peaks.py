"""Sub-pixel position of one stripe's profile: a least-squares Gaussian over a few samples (section 2.3).

The bound that any estimator meets under additive noise: ``sigma_c >= (noise / A) sqrt(2 s / sqrt(pi))`` for a Gaussian
of amplitude A and width s sampled once a unit. Least squares reaches it; a parabola or a centroid does not.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from deskew.types import Array, Floats

# Beyond these a profile is no stripe: narrower than the sampling can show, or wider than the window.
_NARROWEST = 0.25
_START_WIDTH = 1.2


@numba.njit(cache=True)
def _start(samples: Floats, first: int, last: int, peak: int) -> tuple[float, float]:
    """Position and width of the log-parabola through the highest sample and its two neighbours."""
    low, top, high = samples[max(peak - 1, first)], samples[peak], samples[min(peak + 1, last)]
    if top <= 0.0 or min(low, high) <= 0.02 * top:  # a logarithm there would only show the noise
        return float(peak), _START_WIDTH
    left, right = math.log(top / low), math.log(top / high)
    curvature = left + right
    if curvature <= 1e-3:
        return float(peak), _START_WIDTH
    return peak + 0.5 * (left - right) / curvature, min(1.0 / math.sqrt(curvature), 1.0 + 0.5 * (last - first))


@numba.njit(cache=True)
def _step(
    samples: Floats, first: int, last: int, amplitude: float, position: float, width: float, fixed: bool
) -> tuple[float, float, float, bool]:
    """One Gauss-Newton step in (A, A dc/s, A ds/s); its normal matrix holds the moments of g^2 in u = (x - c)/s."""
    m0 = m1 = m2 = m3 = m4 = r0 = r1 = r2 = 0.0
    u = (first - position) / width
    du = 1.0 / width
    # g(x) at unit steps by recurrence: three exponentials however many samples there are.
    g, ratio, shrink = math.exp(-0.5 * u * u), math.exp(-du * (u + 0.5 * du)), math.exp(-du * du)
    for i in range(first, last + 1):
        residual = (samples[i] - amplitude * g) * g
        gg, uu = g * g, u * u
        m0, m1, m2, m3, m4 = m0 + gg, m1 + gg * u, m2 + gg * uu, m3 + gg * uu * u, m4 + gg * uu * uu
        r0, r1, r2 = r0 + residual, r1 + residual * u, r2 + residual * uu
        g, ratio, u = g * ratio, ratio * shrink, u + du
    if fixed:
        determinant = m0 * m2 - m1 * m1
        if determinant <= 1e-12 * m0 * m0:
            return 0.0, 0.0, 0.0, False
        return (m2 * r0 - m1 * r1) / determinant, (m0 * r1 - m1 * r0) / determinant, 0.0, True
    c00, c01, c02 = m2 * m4 - m3 * m3, m2 * m3 - m1 * m4, m1 * m3 - m2 * m2
    determinant = m0 * c00 + m1 * c01 + m2 * c02
    if determinant <= 1e-12 * m0 * m0 * m0:
        return 0.0, 0.0, 0.0, False
    c11, c12, c22 = m0 * m4 - m2 * m2, m1 * m2 - m0 * m3, m0 * m2 - m1 * m1
    scale = 1.0 / determinant
    return (
        (c00 * r0 + c01 * r1 + c02 * r2) * scale,
        (c01 * r0 + c11 * r1 + c12 * r2) * scale,
        (c02 * r0 + c12 * r1 + c22 * r2) * scale,
        True,
    )


@numba.njit(cache=True)
def fit_gaussian(
    samples: Floats, first: int, last: int, peak: int, known_width: float = 0.0
) -> tuple[float, float, float]:
    """Least-squares Gaussian through samples[first .. last], started from the highest sample.

    Parameters
    ----------
    samples : (n,) float64 array
        Profile above the black level [grey levels].
    first, last : int
        First and last valid index, ``last - first >= 3``.
    peak : int
        Index of the highest sample, inside (first, last).
    known_width : float
        Width to hold fixed [samples]; 0 to fit it.

    Returns
    -------
    position, amplitude, width : float
        Centre [samples], height [grey levels] and standard deviation [samples]; an amplitude of 0 says that the fit
        found no peak near `peak`.
    """
    amplitude = samples[peak]
    position, width = _start(samples, first, last, peak)
    fixed = known_width > 0.0
    if fixed:
        position, width = float(peak), known_width
    widest = 1.0 + 0.5 * (last - first)
    for _ in range(12):
        da, dc, ds, solved = _step(samples, first, last, amplitude, position, width, fixed)
        amplitude += da
        if not solved or amplitude <= 0.0:
            return float(peak), 0.0, 0.0
        move = min(max(dc * width / amplitude, -0.5), 0.5)
        position += move
        grown = width * min(max(1.0 + ds / amplitude, 0.6), 1.6)
        settled = abs(move) < 1e-3 and abs(grown - width) < 1e-2
        width = min(max(grown, _NARROWEST), widest)
        if abs(position - peak) > 1.5:
            return float(peak), 0.0, 0.0
        if settled:
            break
    # A width at its limit was not measured.
    if not fixed and (width <= _NARROWEST or width >= widest):
        return float(peak), 0.0, 0.0
    return position, amplitude, width


@numba.njit(cache=True)
def fit_profiles(
    profiles: Array, level: Floats, index: Array, n_samples: int, known_width: float, position: Floats,
    amplitude: Floats, width: Floats,
) -> None:  # fmt: skip
    """Fit the profile kept around each peak, in place.

    Parameters
    ----------
    profiles : (n, 2 w + 1) array
        Samples around the peak [grey levels]; those that would lie outside [0, n_samples) are not read.
    level : (n,) float array
        Level without the stripe [grey levels].
    index : (n,) int array
        Sample number of each peak, negative for a profile to leave alone.
    n_samples : int
        Length of the line or sweep that the profiles were cut from.
    known_width : float
        Width to hold fixed [samples]; 0 to fit it.
    position, amplitude, width : (n,) float arrays
        Results; amplitude 0 where the fit found no peak.
    """
    n, length = profiles.shape
    half = length // 2
    samples = np.empty(length)
    for p in range(n):
        at = index[p]
        if at < 0:
            continue
        amplitude[p] = 0.0
        if at < 1 or at > n_samples - 2:  # half a profile has no peak
            continue
        for j in range(length):
            samples[j] = profiles[p, j] - level[p]
        first, last = max(0, half - at), min(length - 1, half + n_samples - 1 - at)
        centre, height, spread = fit_gaussian(samples, first, last, half, known_width)
        centre += at - half
        if 0.5 <= centre <= n_samples - 1.5:
            position[p], amplitude[p], width[p] = centre, height, spread

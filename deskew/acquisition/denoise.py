"""An edge-preserving denoiser of depth maps by local planes, with the noise level estimated from the map itself.

In inverse depth a plane is linear in the pixel. Overlapping windows of several sizes are each fitted a plane, robustly
and weighted by the local noise. Every pixel is given the mean of what the windows around it predict, weighted by how
much each can be believed there: a window that bends, or whose plane the pixel's own measurement contradicts, counts for
little. So next to a fold the windows that lie on one side of it decide.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from deskew.acquisition.noiselevel import noise_level
from deskew.errors import require
from deskew.types import DepthMap, Floats

_FEWEST = 6  # pixels that a plane is fitted to
# Residuals [standard deviations] at which a pixel's weight has fallen to a quarter in a fit, to a half in the mean.
_FIT_SCALE, _MEAN_SCALE = 2.0, 3.0
_TOGETHER_SCALE = 3.0  # of the agreement of nine pixels together, a Gaussian in their mean's standard deviations
_CLIP = 4.0  # larger residuals count as this among the nine: one wild pixel does not speak for all
_RESIDUAL_MAX = 3.0  # larger residuals count as this in a window's misfit
_MISFIT_OK = 1.3  # mean square residual that noise alone explains
_BIAS = 0.02  # error of a window's plane, squared, per unit of misfit beyond and noise variance
_SELF = 0.1  # weight of the measurement itself: it leads where no plane fits
_LEVEL_MIN, _ROUND_OFF = 0.25, 1e-9  # least noise level, as shares of the map's median level and of its depth


@dataclass(frozen=True, slots=True)
class DenoiseSettings:
    """How far planes reach.

    Attributes
    ----------
    radii_px : tuple of int
        Half-widths of the square windows, each in [2, 15]: wide ones against noise and beside ink, narrow ones for
        what bends. Their centres lie (radius + 1) // 2 apart.
    n_reweightings : int
        Robust refits of each window's plane, in [0, 20].
    noise_radius_px : int
        Half-width of the window in which the noise level is estimated, 2, 3 or 4.
    """

    radii_px: tuple[int, ...] = (7, 4, 2)
    n_reweightings: int = 2
    noise_radius_px: int = 2

    def __post_init__(self) -> None:
        inside = len(self.radii_px) > 0 and all(
            isinstance(radius, int) and 2 <= radius <= 15 for radius in self.radii_px
        )
        require(inside, "radii_px", "be one or more whole numbers in [2, 15] px", self.radii_px)
        require(0 <= self.n_reweightings <= 20, "n_reweightings", "be in [0, 20]", self.n_reweightings)
        require(self.noise_radius_px in (2, 3, 4), "noise_radius_px", "be 2, 3 or 4 px", self.noise_radius_px)


@numba.njit(cache=True)
def _solve(m: Floats, plane: Floats) -> bool:
    """Solve the normal equations `m` (9,): S, Sx, Sy, Sxx, Sxy, Syy, and right-hand sides T, Tx, Ty.

    `plane` (9,) receives value and slopes at the window's centre and their covariance (6,); False if the pixels lie on
    one line.
    """
    c00, c01, c02 = m[3] * m[5] - m[4] * m[4], m[4] * m[2] - m[1] * m[5], m[1] * m[4] - m[3] * m[2]
    determinant = m[0] * c00 + m[1] * c01 + m[2] * c02
    if not determinant > 1e-9 * m[0] * m[3] * m[5]:
        return False
    plane[3], plane[4], plane[5] = c00 / determinant, c01 / determinant, c02 / determinant
    plane[6] = (m[0] * m[5] - m[2] * m[2]) / determinant
    plane[7] = (m[1] * m[2] - m[0] * m[4]) / determinant
    plane[8] = (m[0] * m[3] - m[1] * m[1]) / determinant
    plane[0] = plane[3] * m[6] + plane[4] * m[7] + plane[5] * m[8]
    plane[1] = plane[4] * m[6] + plane[6] * m[7] + plane[7] * m[8]
    plane[2] = plane[5] * m[6] + plane[7] * m[7] + plane[8] * m[8]
    return True


@numba.njit(cache=True)
def _fit(f: Floats, precision: Floats, y: int, x: int, radius: int, n_reweightings: int, m: Floats, p: Floats) -> bool:
    """Fit a plane around (x, y), iteratively reweighted by Geman-McClure; `m` and `p` as in :func:`_solve`."""
    y0, y1 = max(0, y - radius), min(f.shape[0], y + radius + 1)
    x0, x1 = max(0, x - radius), min(f.shape[1], x + radius + 1)
    for n in range(n_reweightings + 1):
        a, b, c = p[0], p[1], p[2]
        s = sx = sy = sxx = sxy = syy = t = tx = ty = 0.0
        for i in range(y0, y1):
            dy = float(i - y)
            for j in range(x0, x1):
                w = precision[i, j]
                if w == 0.0:
                    continue
                dx, value = float(j - x), f[i, j]
                if n > 0:
                    share = 1.0 / (1.0 + (value - (a + b * dx + c * dy)) ** 2 * w / _FIT_SCALE**2)
                    w *= share * share
                s, sx, sy = s + w, sx + w * dx, sy + w * dy
                sxx, sxy, syy = sxx + w * dx * dx, sxy + w * dx * dy, syy + w * dy * dy
                t, tx, ty = t + w * value, tx + w * value * dx, ty + w * value * dy
        m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8] = s, sx, sy, sxx, sxy, syy, t, tx, ty
        if not _solve(m, p):
            return False
    return True


@numba.njit(cache=True)
def _misfit(f: Floats, precision: Floats, y: int, x: int, radius: int, p: Floats) -> tuple[float, float]:
    """Mean square residual in units of the noise (about 1 on a plane), and the harmonic mean of the noise variance."""
    n, square, total = 0, 0.0, 0.0
    for i in range(max(0, y - radius), min(f.shape[0], y + radius + 1)):
        for j in range(max(0, x - radius), min(f.shape[1], x + radius + 1)):
            w = precision[i, j]
            if w > 0.0:
                residual = f[i, j] - (p[0] + p[1] * (j - x) + p[2] * (i - y))
                n, total = n + 1, total + w
                square += min(residual * residual * w, _RESIDUAL_MAX**2)
    if n < _FEWEST:
        return np.inf, 0.0
    return square / n, n / total


@numba.njit(cache=True)
def _residuals(f: Floats, precision: Floats, y: int, x: int, radius: int, p: Floats, out: Floats) -> None:
    """Residuals from a window's plane in units of the noise, clipped, into `out` (2 radius + 3, 2 radius + 3).

    The window with a rim of one pixel; 0 where nothing was measured.
    """
    height, width = f.shape
    for i in range(y - radius - 1, y + radius + 2):
        for j in range(x - radius - 1, x + radius + 2):
            residual = 0.0
            if 0 <= i < height and 0 <= j < width and precision[i, j] > 0.0:
                residual = (f[i, j] - (p[0] + p[1] * (j - x) + p[2] * (i - y))) * np.sqrt(precision[i, j])
            out[i - y + radius + 1, j - x + radius + 1] = min(max(residual, -_CLIP), _CLIP)


@numba.njit(cache=True)
def _contradiction(residuals: Floats, v: int, u: int) -> float:
    """Squared mean residual of 3 x 3 pixels over its variance: about 1 on the plane, whatever the noise."""
    total, n = 0.0, 0
    for k in range(v - 1, v + 2):
        for m in range(u - 1, u + 2):
            total += residuals[k, m]
            n += residuals[k, m] != 0.0
    return total * total / max(n, 1)


@numba.njit(cache=True)
def _vote(
    f: Floats, precision: Floats, y: int, x: int, radius: int, p: Floats, misfit: float, bias: float,
    residuals: Floats, sums: Floats,
) -> None:  # fmt: skip
    """Add a window's predictions to `sums` (height, width, 2): weighted changes of each pixel, and weights.

    A weight is the inverse square of the prediction's expected squared error, variance and squared bias, times the
    agreement of what was measured at the pixel, and at it and its eight neighbours together: what one pixel may be by
    noise, nine are not. `residuals` is scratch, as :func:`_residuals` fills it.
    """
    _residuals(f, precision, y, x, radius, p, residuals)
    inflation = max(1.0, misfit)
    for i in range(max(0, y - radius), min(f.shape[0], y + radius + 1)):
        dy = float(i - y)
        for j in range(max(0, x - radius), min(f.shape[1], x + radius + 1)):
            w = precision[i, j]
            if w == 0.0:
                continue
            dx = float(j - x)
            change = p[0] + p[1] * dx + p[2] * dy - f[i, j]
            variance = p[3] + 2.0 * (p[4] * dx + p[5] * dy + p[7] * dx * dy) + p[6] * dx * dx + p[8] * dy * dy
            together = _contradiction(residuals, i - y + radius + 1, j - x + radius + 1)
            agreement = np.exp(-0.5 * together / _TOGETHER_SCALE**2) / (1.0 + change * change * w / _MEAN_SCALE**2)
            weight = agreement / (inflation * variance + bias) ** 2
            sums[i, j, 0] += weight * change
            sums[i, j, 1] += weight


@numba.njit(cache=True)
def _vote_all(f: Floats, precision: Floats, radius: int, stride: int, n_reweightings: int, sums: Floats) -> None:
    """Fit and vote in every window of one size; their centres are `stride` apart."""
    m, p = np.zeros(9), np.zeros(9)
    residuals = np.zeros((2 * radius + 3, 2 * radius + 3))
    for y in range((f.shape[0] - 1) % stride // 2, f.shape[0], stride):
        for x in range((f.shape[1] - 1) % stride // 2, f.shape[1], stride):
            if not _fit(f, precision, y, x, radius, n_reweightings, m, p):
                continue
            misfit, variance = _misfit(f, precision, y, x, radius, p)
            if misfit < np.inf:
                bias = _BIAS * max(0.0, misfit - _MISFIT_OK) * variance
                _vote(f, precision, y, x, radius, p, misfit, bias, residuals, sums)


def denoise_depth(depth: DepthMap, settings: DenoiseSettings | None = None) -> DepthMap:
    """Remove noise from a depth map, keeping folds and jumps.

    Parameters
    ----------
    depth : DepthMap
        As measured. Its noise may differ from pixel to pixel; the level is estimated from the map.
    settings : DenoiseSettings, optional
        Reach of the windows.

    Returns
    -------
    DepthMap
        The same pixels, with the same reasons for those that are missing: nothing is interpolated. A noiseless map
        comes back as it is where it is plane, folded or stepped; uneven curvature reads as noise of less than 1e-3 mm.
    """
    settings = settings or DenoiseSettings()
    measured = np.isfinite(depth.z)
    if not measured.any():
        return depth
    require(bool((depth.z[measured] > 0).all()), "depth", "lie before the camera", float(depth.z[measured].min()))
    middle = float(np.median(depth.z[measured]))
    # In millimetres near the middle: about z - middle, and linear in 1 / z.
    f = middle - middle**2 / depth.z
    level = noise_level(f, settings.noise_radius_px)
    least = max(_LEVEL_MIN * float(np.median(level[measured])), _ROUND_OFF * middle)
    precision = np.where(measured, 1.0 / np.maximum(np.where(measured, level, 1.0), least) ** 2, 0.0)
    sums = np.stack([np.zeros(f.shape), _SELF * precision**2], axis=-1)
    for radius in settings.radii_px:
        _vote_all(f, precision, radius, (radius + 1) // 2, settings.n_reweightings, sums)
    z = np.full(f.shape, np.nan)
    z[measured] = middle**2 / (middle - (f + sums[..., 0] / np.where(measured, sums[..., 1], 1.0))[measured])
    return DepthMap(z, depth.reason, depth.camera)


def depth_noise(depth: DepthMap, settings: DenoiseSettings | None = None) -> Floats:
    """Estimate the standard deviation of a depth map's noise [mm], (height, width); NaN where there is no depth."""
    settings = settings or DenoiseSettings()
    return np.asarray(depth.z**2 * noise_level(1.0 / depth.z, settings.noise_radius_px))

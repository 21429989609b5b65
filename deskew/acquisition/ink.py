"""Take out what ink does to decoded coordinates: a pixel's footprint is weighted by how light the paper is under it.

At the edge of ink a pixel sees mostly the light side, so it decodes the coordinate of a place beside its own. For a
Gaussian footprint of standard deviation sigma the centre of what it sees is shifted by exactly
``sigma^2 grad ln(white - black)``, whatever is printed. Sigma is the calibration's own; nothing else need be known.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numba
import numpy as np
import numpy.typing as npt
from scipy import ndimage

from deskew.acquisition.grey import grey_levels
from deskew.errors import StepError, require
from deskew.types import Array, Calibration, Capture, Correspondence, Floats, Reason

# Sixth-order derivative: half a lens's blur is in frequencies where a central difference reads a third too low.
_DERIVATIVE = np.array([-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0]) / 60.0
_DERIVATIVE_GAIN = float((_DERIVATIVE**2).sum())  # of white noise: variance out over variance in
# Second differences both ways: next to nothing of a blurred picture passes, and all of the noise.
_RESIDUAL = np.array([1.0, -2.0, 1.0])
_RESIDUAL_GAIN = float((_RESIDUAL**2).sum()) ** 2
_LEVELS = 8  # of brightness, at which noise is measured
_ROUNDING = 2.0 / 12.0  # variance of white - black that rounding alone makes [grey levels^2]
_DARKEST = 3.0  # standard deviations: a logarithm of less is noise
_MAD = 1.4826
_SMALLEST_PX = 0.005  # shift worth a slope: less is a hundredth of a millimetre of depth at most
_FEWEST = 3  # differences that make a slope


@dataclass(frozen=True, slots=True)
class InkSettings:
    """How the correction guards itself against noise.

    Attributes
    ----------
    slope_radius_px : int
        Half-width of the window whose median gives the local slope of the projector's coordinates, in [2, 15].
    noise_guard : float
        This many times the power that noise alone gives a gradient is taken off its power, >= 0: a gradient lost in
        noise corrects nothing.
    shift_max : float
        Longest shift, in standard deviations of the footprint, > 0: its centre cannot leave it.
    """

    slope_radius_px: int = 4
    noise_guard: float = 1.0
    shift_max: float = 2.0

    def __post_init__(self) -> None:
        require(2 <= self.slope_radius_px <= 15, "slope_radius_px", "be in [2, 15] px", self.slope_radius_px)
        require(0 <= self.noise_guard < np.inf, "noise_guard", "be at least 0 and finite", self.noise_guard)
        require(0 < self.shift_max < np.inf, "shift_max", "be positive and finite [sigma]", self.shift_max)


def correct_ink(
    calibration: Calibration, correspondence: Correspondence, capture: Capture, settings: InkSettings | None = None
) -> Correspondence:
    """Move decoded coordinates from where each pixel looked to the pixel itself.

    Reading per pixel, a line sweep or a Gray code, decodes the coordinate at the footprint's centre. Reading per curve
    sees a stripe of width w [camera px] whose brightness also changes along the line of search: it is pulled by
    ``w^2`` times the gradient along that line, the other way.

    Parameters
    ----------
    calibration : Calibration
        Its `camera_psf_px` is used.
    correspondence : Correspondence
        The capture, decoded.
    capture : Capture
        Its white and black frames are used.
    settings : InkSettings, optional
        Guards.

    Returns
    -------
    Correspondence
        The same pixels; their coordinates corrected where ink shows.

    Raises
    ------
    InputError
        If correspondence and capture differ in size.
    StepError
        If the calibration does not know the camera's point spread.
    """
    settings = settings or InkSettings()
    sigma = calibration.camera_psf_px
    if sigma is None:
        raise StepError(
            "ink correction: the calibration states no `camera_psf_px`; calibrate again on boards whose edges are "
            "sharp in the picture, or scan without the correction."
        )
    shape = capture.white.shape[:2]
    decoded = correspondence.column.shape
    require(decoded == shape, "correspondence", f"have the capture's shape {shape}", decoded)
    shift = footprint_shift(capture.white, capture.black, sigma, settings)
    moved = (np.hypot(shift[..., 0], shift[..., 1]) > _SMALLEST_PX) & (correspondence.reason == Reason.OK)
    widths = correspondence.stripe_px or (0.0, 0.0)
    corrected = []
    for axis, coordinate in enumerate((correspondence.column, correspondence.row)):
        slope = np.zeros((*shape, 2))
        _local_slopes(coordinate.astype(np.float64), moved, settings.slope_radius_px, slope)
        along_search = np.array([1.0, 1.0])
        along_search[axis] -= (widths[axis] / sigma) ** 2
        change = (slope * shift * along_search).sum(axis=-1)
        corrected.append((coordinate - change).astype(coordinate.dtype))
    return replace(correspondence, column=corrected[0], row=corrected[1])


def footprint_shift(white: Array, black: Array, sigma_px: float, settings: InkSettings | None = None) -> Floats:
    """Where the light that a pixel sees is centred, relative to the pixel.

    Parameters
    ----------
    white, black : (height, width[, 3]) arrays
        The scene under the fully lit and the dark projector.
    sigma_px : float
        Standard deviation of a pixel's footprint, lens and pixel area together [px].
    settings : InkSettings, optional
        Guards.

    Returns
    -------
    (height, width, 2) array
        ``sigma^2 grad ln(white - black)``, x and y [px]; 0 where the gradient is lost in noise.
    """
    settings = settings or InkSettings()
    require(bool(np.isfinite(sigma_px)) and sigma_px > 0, "sigma_px", "be finite and positive [px]", sigma_px)
    require(black.shape == white.shape, "black", f"have white's shape {white.shape}", black.shape)
    light, dark = (grey_levels(image, name).astype(np.float64) for image, name in ((white, "white"), (black, "black")))
    lit = light - dark
    variance = noise_variance(lit, light + dark)
    level = np.maximum(lit, _DARKEST * np.sqrt(variance))
    # scipy's correlation runs along the axis given: 1 is x.
    gradient = np.stack([ndimage.correlate1d(lit, _DERIVATIVE, axis=axis, mode="nearest") for axis in (1, 0)], axis=-1)
    gradient /= level[..., None]
    power = ndimage.uniform_filter((gradient**2).sum(axis=-1), 3)
    noise_power = ndimage.uniform_filter(2 * _DERIVATIVE_GAIN * variance / level**2, 3)
    trusted = np.clip(1.0 - settings.noise_guard * noise_power / np.maximum(power, 1e-30), 0.0, 1.0)
    shift = sigma_px**2 * gradient * trusted[..., None]
    longest = settings.shift_max * sigma_px
    length = np.maximum(np.hypot(shift[..., 0], shift[..., 1]), longest)
    return np.asarray(shift * (longest / length)[..., None])


def noise_variance(lit: Floats, brightness: Floats) -> Floats:
    """Noise variance of each pixel of a blurred picture, as the picture itself shows it.

    Parameters
    ----------
    lit : (height, width) array
        White - black [grey levels].
    brightness : (height, width) array
        What the noise depends on: white + black [grey levels].

    Returns
    -------
    (height, width) array
        Robust variance of `lit` at the pixel's brightness [grey levels^2], never below rounding's.
    """
    residual = lit
    for axis in (0, 1):
        residual = ndimage.correlate1d(residual, _RESIDUAL, axis=axis, mode="nearest")
    edges = np.unique(np.quantile(brightness, np.linspace(0.0, 1.0, _LEVELS + 1)))
    members = np.clip(np.searchsorted(edges, brightness, side="right") - 1, 0, max(len(edges) - 2, 0))
    levels, variances = [], []
    for i in range(max(len(edges) - 1, 1)):
        chosen = members == i
        if chosen.any():
            levels.append(float(brightness[chosen].mean()))
            variances.append(float((_MAD * np.median(np.abs(residual[chosen]))) ** 2 / _RESIDUAL_GAIN))
    return np.asarray(np.maximum(np.interp(brightness, levels, variances), _ROUNDING))


@numba.njit(cache=True)
def _local_slopes(coordinate: Floats, wanted: npt.NDArray[np.bool_], radius: int, slope: Floats) -> None:
    """Median difference between neighbours along x and along y in a window of every other pixel, into (h, w, 2).

    A median, since ink bends coordinates on either side of its edge and a fold or a page's border cuts the window; 0
    where there are not enough differences.
    """
    height, width = coordinate.shape
    found = np.empty((2 * radius + 1) ** 2)
    for y in range(height):
        for x in range(width):
            if not wanted[y, x]:
                continue
            for axis in range(2):
                right, down = 1 - axis, axis
                n = 0
                for v in range(max(y - radius, 0), min(y + radius + 1, height - down), 2):
                    for u in range(max(x - radius, 0), min(x + radius + 1, width - right), 2):
                        difference = coordinate[v + down, u + right] - coordinate[v, u]
                        if not np.isnan(difference):
                            found[n] = difference
                            n += 1
                if n >= _FEWEST:
                    slope[y, x, axis] = np.median(found[:n])

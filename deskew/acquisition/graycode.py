"""Gray-code decoding with inverse patterns, to a fraction of a projector pixel (section 2.3's "active encoding").

Frame 2b of a sweep shows bit b of the Gray code of each projector column (or row), most significant first; frame
2b + 1 its inverse. Their difference cancels albedo and ambient light: its sign is the bit, and the place where it
crosses zero between two neighbouring camera pixels is the border between two projector pixels, to a sub-pixel.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy import ndimage

from deskew.acquisition.framenoise import noise_at, variance_by_level
from deskew.acquisition.frames import read_frames
from deskew.acquisition.grey import grey_levels
from deskew.acquisition.projectorcheck import (
    clipping_level,
    join_checks,
    light_to_judge,
    pair_stray,
    planes_check,
)
from deskew.errors import require, require_positive, require_whole
from deskew.types import Array, Capture, Correspondence, Floats, PatternKind, Reason

_SQUARED_MEDIAN = 1.4826**-2  # of a squared normal variable, over its mean


@dataclass(frozen=True, slots=True)
class GrayCodeSettings:
    """Thresholds of the decoder, in standard deviations of the noise that the frames themselves show.

    Attributes
    ----------
    shadow_snr : float
        Least white minus black of a lit pixel, over the noise of one frame.
    bit_snr : float
        Least contrast of a bit to its inverse, over the noise of the difference. One bit may be fainter: it is grey
        where the pixel lies on its border. Two make the pixel `WEAK`.
    gap_max_px : int
        Widest stretch of camera pixels between two borders that is interpolated.
    ink_slope_max : float or None
        Steepest relative change of white minus black [1/px]; where it is steeper, at the edge of ink, a lens of blur
        sigma bends borders by sigma^2 times it, and the pixel is `EDGE`. None keeps such pixels, for the correction of
        ink.
    n_dropped_max : int
        Finest bits that may be done without where a projector out of focus washes them out.
    subpixel : bool
        Interpolate between borders; otherwise the index of the projector pixel is the coordinate.
    """

    shadow_snr: float = 4.0
    bit_snr: float = 3.0
    gap_max_px: int = 16
    ink_slope_max: float | None = 0.15
    n_dropped_max: int = 2
    subpixel: bool = True

    def __post_init__(self) -> None:
        require_positive("shadow_snr", self.shadow_snr, 1e6)
        require_positive("bit_snr", self.bit_snr, 1e6)
        require_whole("gap_max_px", self.gap_max_px, 2, 100_000)
        if self.ink_slope_max is not None:
            require_positive("ink_slope_max", self.ink_slope_max, 1e6, "1/px")
        require_whole("n_dropped_max", self.n_dropped_max, 0, 16)
        require(isinstance(self.subpixel, bool), "subpixel", "be true or false", repr(self.subpixel))


def decode_gray(capture: Capture, settings: GrayCodeSettings | None = None) -> Correspondence:
    """Decode a Gray-code capture.

    Parameters
    ----------
    capture : Capture
        Of kind `GRAY_CODE`.
    settings : GrayCodeSettings, optional
        Thresholds.

    Returns
    -------
    Correspondence
        Projector coordinates [px] at raw camera pixels.

    Raises
    ------
    InputError
        The capture is no Gray code, a frame differs from `white` in shape or type, or too few or too many come.
    StepError
        Reading a frame failed.
    """
    require(capture.pattern is PatternKind.GRAY_CODE, "capture", "hold a Gray code", capture.pattern)
    settings = settings or GrayCodeSettings()
    still = grey_levels(capture.white, "white")
    white, black = (image.astype(np.float64) for image in (still, grey_levels(capture.black, "black")))
    judged = light_to_judge(white, black, clipping_level(still))
    columns = read_planes(read_frames(capture.columns, still, "columns"), white, black, judged)
    rows = read_planes(read_frames(capture.rows, still, "rows"), white, black, judged)
    noise = columns.noise
    shadow = white - black < settings.shadow_snr * noise
    # A border between rows runs along the image's x: transpose, so that both sweeps are read along the last axis.
    column = _decode_axis(columns.differences, shadow, noise, capture.projector_size[0], settings)
    turned = rows.differences.transpose(0, 2, 1)
    row = _decode_axis(turned, shadow.T, noise.T, capture.projector_size[1], settings).T
    reason = np.full(shadow.shape, Reason.OK, dtype=np.uint8)
    reason[~np.isfinite(column) | ~np.isfinite(row)] = Reason.WEAK
    if settings.ink_slope_max is not None:
        reason[(reason == Reason.OK) & (_ink_slope(white - black, noise) > settings.ink_slope_max)] = Reason.EDGE
    reason[shadow] = Reason.SHADOW
    missing = reason != Reason.OK
    check = join_checks(planes_check(columns.stray, "columns"), planes_check(rows.stray, "rows"))
    return Correspondence(np.where(missing, np.nan, column), np.where(missing, np.nan, row), reason, projector=check)


def _ink_slope(lit: Floats, noise: Floats) -> Floats:
    """Relative slope of white minus black, (height, width) [1/px], smoothed by about a lens's blur."""
    smooth = np.maximum(ndimage.gaussian_filter(lit, 1.0), noise)
    return np.asarray(ndimage.gaussian_gradient_magnitude(lit, 1.0) / smooth)


@dataclass(frozen=True, slots=True)
class Planes:
    """Bit planes of one axis, read.

    Attributes
    ----------
    differences : (bits, height, width) float32 array
        Pattern minus inverse, most significant first [grey levels].
    noise : (height, width) array
        Standard deviation of each pixel in one frame [grey levels].
    stray : (bits, 2) array
        :func:`pair_stray` of each.
    """

    differences: Floats
    noise: Floats
    stray: Floats


def read_planes(planes: Iterator[Array], white: Floats, black: Floats, judged: Floats) -> Planes:
    """Read bit planes, each followed by its inverse.

    Light adds up: pattern + inverse - (white + black) is noise alone, of four frames, where camera and projector are in
    step.

    Parameters
    ----------
    planes : iterator of (height, width) arrays
        Read to its end.
    white, black : (height, width) arrays
        Grey levels.
    judged : (height, width) array
        White - black where it is not clipped, else 0 [grey levels].
    """
    both = white + black
    differences, lines, stray = [], [], []
    for pattern, inverse in zip(planes, planes, strict=True):
        light, dark = pattern.astype(np.float32), inverse.astype(np.float32)
        differences.append(light - dark)
        residual = light + dark - both
        lines.append(variance_by_level(residual**2, both, 4.0 * _SQUARED_MEDIAN))
        stray.append(pair_stray(residual, judged))
    return Planes(np.stack(differences), noise_at(np.median(lines, axis=0), both), np.array(stray))


def _decode_axis(differences: Floats, shadow: Array, noise: Floats, extent: int, settings: GrayCodeSettings) -> Floats:
    """Decode one sweep along the images' last axis; coordinates (height, width), NaN where they cannot be trusted.

    A projector that is out of focus washes out its finest bits first: what they leave undecided is decoded without
    them, from the borders of the coarser bits alone.
    """
    differences = np.ascontiguousarray(differences)
    faint = np.abs(differences) < settings.bit_snr * np.sqrt(2) * noise
    coordinate = np.full(shadow.shape, np.nan)
    n_dropped_max = min(settings.n_dropped_max, len(differences) - 1) if settings.subpixel else 0
    for n_dropped in range(1 + n_dropped_max):
        n_bits = len(differences) - n_dropped
        index = gray_to_index(differences[:n_bits] > 0)
        beyond = (index << n_dropped) >= extent
        # At a border exactly one bit is grey by nature; two grey bits cannot be trusted.
        weak = (faint[:n_bits].sum(axis=0) > 1) | beyond | shadow
        if not settings.subpixel:
            return np.where(weak, np.nan, index.astype(np.float64))
        coarse = _between_borders(differences[:n_bits], index, weak, settings.gap_max_px)
        coordinate = np.where(np.isfinite(coordinate), coordinate, (coarse + 0.5) * 2**n_dropped - 0.5)
    return coordinate


def gray_to_index(bits: Array) -> Array:
    """Gray code (bits, height, width), most significant first, to integers."""
    binary = np.logical_xor.accumulate(bits, axis=0)
    weights = 1 << np.arange(len(bits) - 1, -1, -1)
    return np.tensordot(weights, binary, axes=1).astype(np.int32)


@njit(cache=True)
def _between_borders(differences: Floats, index: Array, weak: Array, gap_max: int) -> Floats:
    """Interpolate along each image row between the borders of projector pixels.

    Where neighbouring pixels see indices i and i +- 1, one bit flips; the zero crossing of its difference is the border
    at i +- 1/2. Between two borders that enclose the same projector pixel or adjoin, the coordinate is linear.
    """
    n_bits, height, width = differences.shape
    coordinate = np.full((height, width), np.nan)
    for y in range(height):
        last_x, last_border = -1.0, 0.0
        for x in range(width - 1):
            if weak[y, x] or weak[y, x + 1]:
                last_x = -1.0
                continue
            step = index[y, x + 1] - index[y, x]
            if step == 0:
                continue
            if abs(step) > 1:
                last_x = -1.0
                continue
            flipped = 0
            for b in range(n_bits):
                if (differences[b, y, x] > 0) != (differences[b, y, x + 1] > 0):
                    flipped = b
            left, right = differences[flipped, y, x], differences[flipped, y, x + 1]
            border_x = x + left / (left - right)
            border = index[y, x] + 0.5 * step
            if last_x >= 0 and 0 < border_x - last_x <= gap_max:
                slope = (border - last_border) / (border_x - last_x)
                for between in range(int(np.ceil(last_x)), int(np.floor(border_x)) + 1):
                    coordinate[y, between] = last_border + slope * (between - last_x)
            last_x, last_border = border_x, border
    return coordinate

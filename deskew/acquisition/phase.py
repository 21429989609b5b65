"""Phase-shift decoding: sinusoidal fringes, told apart by a Gray code or by fringes of longer periods.

The phase of a fringe says where in its period a pixel lies, to a hundredth of it; which period is read

- from a Gray code of HALF periods: a code that is wrong by one at its own border lies a quarter of a period from the
  place that the phase says, on either side, and names the same period;
- or from the next longer fringe, where noise cannot take it half a period of the shorter one astray.

What can be wrong by a period all the same is found out and left without a coordinate.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice, pairwise

import numpy as np
import numpy.typing as npt

from deskew.acquisition.frames import read_frames
from deskew.acquisition.fringes import FringeImage, read_fringe
from deskew.acquisition.graycode import gray_to_index, read_planes
from deskew.acquisition.grey import grey_levels
from deskew.acquisition.projectorcheck import (
    FEWEST_PIXELS,
    bright_pixels,
    clipping_level,
    fringes_check,
    gamma_of,
    join_checks,
    light_to_judge,
    planes_check,
)
from deskew.errors import require, require_positive, require_whole
from deskew.types import (
    Array,
    Capture,
    Correspondence,
    Floats,
    Frames,
    PatternKind,
    ProjectorCheck,
    Reason,
    half_periods,
    n_planes,
)

Bools = npt.NDArray[np.bool_]
_AGREE = 0.375  # of a period: two readings of a place that differ by more, of the half at most, contradict each other


@dataclass(frozen=True, slots=True)
class PhaseSettings:
    """What is believed of fringes, in standard deviations of the noise that the frames themselves show.

    Attributes
    ----------
    shadow_snr : float
        Least white minus black of a lit pixel, over the noise of one frame.
    min_snr : float
        Least modulation of a fringe, over its own standard deviation; the phase is then known to 1 / snr radians.
    bit_snr : float
        Least contrast of a bit of the Gray code to its inverse. One bit may be fainter, if the phase says that the
        pixel lies on its border.
    unwrap_snr : float
        Least distance to a wrong period, half of the shorter fringe's, over the longer one's noise.
    contrast_ratio : float
        A modulation below this share of what white minus black promises is of two places at once, in (0, 1).
    saturated_level : int or None
        Grey level at which the camera clips; None for the largest value of the images' type.
    """

    shadow_snr: float = 5.0
    min_snr: float = 5.0
    bit_snr: float = 3.0
    unwrap_snr: float = 5.0
    contrast_ratio: float = 0.5
    saturated_level: int | None = None

    def __post_init__(self) -> None:
        for name in ("shadow_snr", "min_snr", "bit_snr", "unwrap_snr"):
            require_positive(name, getattr(self, name), 1e6)
        require(0 < self.contrast_ratio < 1, "contrast_ratio", "be in (0, 1)", self.contrast_ratio)
        if self.saturated_level is not None:
            require_whole("saturated_level", self.saturated_level, 1, 65535)


@dataclass(frozen=True, slots=True)
class _Axis:
    """One axis, decoded: coordinate [px], `Reason` of each pixel, what the frames say of the projector."""

    coordinate: Floats
    reason: npt.NDArray[np.uint8]
    check: ProjectorCheck


def decode_phase(capture: Capture, settings: PhaseSettings | None = None) -> Correspondence:
    """Decode a capture of fringes.

    Parameters
    ----------
    capture : Capture
        Of kind `GRAY_PHASE` or `MULTI_PHASE`.
    settings : PhaseSettings, optional
        Thresholds.

    Returns
    -------
    Correspondence
        Projector coordinates [px] at raw camera pixels, and the reason where there is none: that of the columns if they
        failed, else that of the rows.

    Raises
    ------
    InputError
        The capture holds no fringes, a frame differs from `white` in shape or type, or too few or too many come.
    StepError
        Reading a frame failed.
    """
    kinds = (PatternKind.GRAY_PHASE, PatternKind.MULTI_PHASE)
    require(capture.pattern in kinds, "capture", "hold fringes", capture.pattern)
    settings = settings or PhaseSettings()
    axes = [
        _decode_axis(frames, name, extent, capture, settings)
        for frames, name, extent in (
            (capture.columns, "columns", capture.projector_size[0]),
            (capture.rows, "rows", capture.projector_size[1]),
        )
    ]
    reason = np.where(axes[0].reason != Reason.OK, axes[0].reason, axes[1].reason).astype(np.uint8)
    column, row = (np.where(reason == Reason.OK, axis.coordinate, np.nan) for axis in axes)
    return Correspondence(column, row, reason, projector=join_checks(*(axis.check for axis in axes)))


def _decode_axis(frames: Frames, name: str, extent: int, capture: Capture, settings: PhaseSettings) -> _Axis:
    still = grey_levels(capture.white, "white")
    white, black = (image.astype(np.float64) for image in (still, grey_levels(capture.black, "black")))
    top = settings.saturated_level or clipping_level(still)
    judged = light_to_judge(white, black, top)
    grey = read_frames(frames, still, name)
    check = ProjectorCheck()
    coded: tuple[Floats, Bools] | None = None
    if capture.pattern is PatternKind.GRAY_PHASE:
        fringe = capture.fringes[0]
        planes = read_planes(islice(grey, n_planes(half_periods(fringe, extent))), white, black, judged)
        check = planes_check(planes.stray, name)
        faint = np.abs(planes.differences) < settings.bit_snr * np.sqrt(2) * planes.noise
        coded = gray_to_index(planes.differences > 0), faint
    images = [read_fringe(grey, fringe, judged) for fringe in capture.fringes]
    for _ in grey:  # one frame too many is refused by the reader
        pass
    if coded is not None:
        coordinate, reason = unwrap_by_code(images[0], *coded)
    else:
        coordinate, reason = unwrap_by_periods(images, extent, settings.unwrap_snr)
    _judge(images, white - black, judged, top, settings, reason)
    outside = (coordinate < -0.5) | (coordinate > extent - 0.5)
    reason[outside & (reason == Reason.OK)] = Reason.WEAK
    return _Axis(coordinate, reason, join_checks(check, _check(images, judged, name)))


def _judge(
    images: list[FringeImage],
    lit: Floats,
    judged: Floats,
    top: float,
    settings: PhaseSettings,
    reason: npt.NDArray[np.uint8],
) -> None:
    """Say of each pixel, in place, why it has no coordinate: the later of these overrules the earlier."""
    promised, bright = np.maximum(lit, 1e-9) / 2, bright_pixels(judged)
    for image in images:
        typical = float(np.median((image.modulation / promised)[bright])) if bright.any() else 0.0
        two = image.modulation + 3 * image.modulation_sigma < settings.contrast_ratio * typical * promised
        reason[two & (reason == Reason.OK)] = Reason.TWO_PEAKS
    for image in images:
        reason[image.modulation < settings.min_snr * image.modulation_sigma] = Reason.WEAK
    for image in images:
        reason[image.highest >= top] = Reason.SATURATED
        reason[lit < settings.shadow_snr * image.noise] = Reason.SHADOW


def unwrap_by_code(image: FringeImage, index: Array, faint: Bools) -> tuple[Floats, npt.NDArray[np.uint8]]:
    """Tell the periods of a fringe apart by a Gray code of its half periods.

    Parameters
    ----------
    image : FringeImage
        The fringe.
    index : (height, width) int array
        Decoded number of the half period.
    faint : (bits, height, width) bool array
        Bits lost in noise, most significant first.

    Returns
    -------
    coordinate : (height, width) array
        Projector coordinate [px].
    reason : (height, width) uint8 array
        `TWO_PEAKS` where code and phase contradict each other, `WEAK` where a bit is faint that is not at its border.
    """
    half, period = image.fringe.period_px / 2, image.fringe.period_px
    middle = (index + 0.5) * half - 0.5
    coordinate = image.place + period * np.round((middle - image.place) / period)
    off = coordinate - middle
    reason = np.full(index.shape, Reason.OK, dtype=np.uint8)
    reason[np.abs(off) > _AGREE * period] = Reason.TWO_PEAKS
    # Between two half periods one bit flips: the one that the pixel lies next to is the only one that may be faint.
    beside = np.maximum(index + np.where(off >= 0, 1, -1), 0)
    flipping = (index ^ (index >> 1)) ^ (beside ^ (beside >> 1))
    n_bits = len(faint)
    allowed = (flipping >> np.arange(n_bits - 1, -1, -1)[:, None, None]) & 1
    reason[(faint & (allowed == 0)).any(axis=0)] = Reason.WEAK
    return coordinate, reason


def unwrap_by_periods(
    images: list[FringeImage], extent: int, unwrap_snr: float
) -> tuple[Floats, npt.NDArray[np.uint8]]:
    """Tell the periods of ever shorter fringes apart, each by the one before.

    Parameters
    ----------
    images : list of FringeImage
        Longest period first; it covers the projector.
    extent : int
        Projector columns or rows.
    unwrap_snr : float
        Least distance to a wrong period in standard deviations.

    Returns
    -------
    coordinate : (height, width) array
        Projector coordinate [px].
    reason : (height, width) uint8 array
        `WEAK` where noise could take the longer fringe to a wrong period, `TWO_PEAKS` where two fringes contradict.
    """
    longest = images[0].fringe.period_px
    room = (longest - extent) / 2
    coordinate = np.mod(images[0].place + 0.5 + room, longest) - 0.5 - room
    reason = np.full(coordinate.shape, Reason.OK, dtype=np.uint8)
    for longer, shorter in pairwise(images):
        period = shorter.fringe.period_px
        finer = shorter.place + period * np.round((coordinate - shorter.place) / period)
        astray = unwrap_snr * np.hypot(longer.place_sigma, shorter.place_sigma) > period / 2
        contrary = np.abs(finer - coordinate) > _AGREE * period
        reason[contrary & (reason == Reason.OK)] = Reason.TWO_PEAKS
        reason[astray] = Reason.WEAK
        coordinate = finer
    return coordinate, reason


def _check(images: list[FringeImage], judged: Floats, name: str) -> ProjectorCheck:
    """Judge the projector by the shortest fringe's harmonics and by every fringe's stray light."""
    bright = bright_pixels(judged)
    if bright.sum() < FEWEST_PIXELS:
        return ProjectorCheck()
    finest = images[-1]
    contrast = float(np.median(2 * finest.modulation[bright] / judged[bright]))
    gamma = gamma_of(finest.second, contrast)
    return fringes_check(gamma, [image.stray for image in images], [image.fringe for image in images], name)

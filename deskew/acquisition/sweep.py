"""What both readings of a line sweep share: settings, the still scene, its noise, and frames read one at a time."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deskew.acquisition.grey import grey_levels
from deskew.acquisition.peaks import fit_profiles
from deskew.errors import require, require_positive, require_whole
from deskew.types import Array, Capture, Floats, Reason

RIVAL_SNR = 5.5  # of the highest noise among a thousand samples with a margin: a second peak must stand above it
_MEASURES_WIDTH = 15.0  # signal-to-noise ratio from which a peak measures its own width to better than a tenth
_ROUNDING = 1.0 / math.sqrt(12.0)  # no camera is quieter than the rounding of its grey levels


@dataclass(frozen=True, slots=True)
class SweepSettings:
    """How a line sweep is read and what is believed of it.

    Attributes
    ----------
    mode : "temporal" or "spatial"
        Temporal: each camera pixel's brightness over the frames peaks at its projector coordinate. Spatial, the paper's
        reading: each frame holds one curve, whose peak is found along every image row (columns) or column (rows).
    peak : "gauss" or "integer"
        Least-squares Gaussian, or the brightest sample itself.
    half_width : int
        Samples on either side of the brightest one that the fit sees, in [2, 15]; 3 serves stripes of a standard
        deviation up to 1.6 samples.
    min_snr : float
        Smallest signal-to-noise ratio of a peak as a matched filter sees it, ``A sqrt(s sqrt(pi)) / noise``; the peak's
        position is then known to ``sqrt(2) s / snr``.
    guided_snr : float
        The same for a peak that stands where its neighbours' does, in (0, `min_snr`]: among so few samples noise hardly
        rises as high.
    shadow_snr : float
        Smallest white - black of a lit pixel, in standard deviations of the dark noise.
    second_peak_ratio : float
        Smallest second peak, relative to the best, that makes a pixel ambiguous, in (0, 1].
    width_ratio : float
        A peak this many times wider or narrower than the scene's median is no single stripe, > 1.
    saturated_level : int or None
        Grey level at which the camera clips; None for the largest value of the images' type.
    max_gap_px : float
        Spatial mode: the widest gap between two observations that is interpolated [camera px].
    """

    mode: str = "temporal"
    peak: str = "gauss"
    half_width: int = 3
    min_snr: float = 4.0
    guided_snr: float = 1.75
    shadow_snr: float = 5.0
    second_peak_ratio: float = 0.5
    width_ratio: float = 2.0
    saturated_level: int | None = None
    max_gap_px: float = 3.0

    def __post_init__(self) -> None:
        require(self.mode in ("temporal", "spatial"), "mode", "be 'temporal' or 'spatial'", repr(self.mode))
        require(self.peak in ("gauss", "integer"), "peak", "be 'gauss' or 'integer'", repr(self.peak))
        require_whole("half_width", self.half_width, 2, 15)
        require_positive("min_snr", self.min_snr, 1e6)
        require(0 < self.guided_snr <= self.min_snr, "guided_snr", f"be in (0, {self.min_snr}]", self.guided_snr)
        require_positive("shadow_snr", self.shadow_snr, 1e6)
        require(0 < self.second_peak_ratio <= 1, "second_peak_ratio", "be in (0, 1]", self.second_peak_ratio)
        require(self.width_ratio > 1, "width_ratio", "be above 1", self.width_ratio)
        if self.saturated_level is not None:
            require_whole("saturated_level", self.saturated_level, 1, 65535)
        require_positive("max_gap_px", self.max_gap_px, 1e5, "camera px")

    @property
    def window(self) -> int:
        """Samples of one profile."""
        return 2 * self.half_width + 1


@dataclass(frozen=True, slots=True)
class Scene:
    """The still scene in grey levels.

    Attributes
    ----------
    white, black : (height, width) arrays
        Under the lit and the dark projector, both of the frames' type.
    saturated_level : int
        Grey level at which the camera clips.
    """

    white: Array
    black: Array
    saturated_level: int

    @property
    def contrast(self) -> Floats:
        """White - black, (height, width) float32 [grey levels]."""
        return np.asarray(self.white.astype(np.float32) - self.black.astype(np.float32))


@dataclass(frozen=True, slots=True)
class Sweep:
    """One sweep, decoded.

    Attributes
    ----------
    position : (height, width) float32 array
        Projector coordinate [px]; meaningless where `reason` is not 0.
    reason : (height, width) uint8 array
        `Reason` of each pixel.
    width : float
        Typical standard deviation of a stripe [frames, or camera px read curve by curve]; 0 if there is none.
    """

    position: Floats
    reason: npt.NDArray[np.uint8]
    width: float


def still_scene(capture: Capture, settings: SweepSettings) -> Scene:
    """Return white and black as grey levels, with the level at which the camera clips."""
    white, black = grey_levels(capture.white, "white"), grey_levels(capture.black, "black")
    require(white.dtype.kind == "u", "white", "be of type uint8 or uint16", white.dtype)
    require(black.dtype == white.dtype, "black", f"have white's type {white.dtype}", black.dtype)
    return Scene(white, black, settings.saturated_level or int(np.iinfo(white.dtype).max))


def dark_noise(frames: Array, scene: Scene) -> float:
    """Estimate the standard deviation of a pixel that the stripe does not light [grey levels].

    Parameters
    ----------
    frames : (n, height, width) array
        The first few frames: a stripe lights only few of their pixels, and the median does not see those.
    scene : Scene
        Only its brighter half counts: a black level that clips at 0 would hide the noise.
    """
    n = len(frames)
    contrast = scene.contrast
    lit = contrast >= np.median(contrast)
    variance = float(np.median(frames[:, lit].astype(np.float32).var(axis=0, ddof=1)))
    # The median of chi-squared with n - 1 degrees of freedom, over its mean (Wilson and Hilferty).
    unbiased = variance / (1.0 - 2.0 / (9.0 * (n - 1))) ** 3
    return max(math.sqrt(unbiased), _ROUNDING)


def dark_level(frames: Array, scene: Scene, noise: float) -> Floats:
    """Level of each pixel without the stripe, (height, width) float32 [grey levels].

    The black frame averaged with the first few of the sweep, (n, height, width): alone, its noise would lift or sink a
    whole profile. Where a stripe passes in these frames, the black frame alone.
    """
    passed = frames.max(axis=0).astype(np.float32) - frames.min(axis=0) > 6.0 * noise
    mean = (frames.sum(axis=0, dtype=np.float32) + scene.black) / np.float32(len(frames) + 1)
    return np.where(passed, scene.black, mean).astype(np.float32)


def shadowed(scene: Scene, noise: float, settings: SweepSettings) -> npt.NDArray[np.bool_]:
    """Pixels that the projector does not reach, (height, width)."""
    return np.asarray(scene.contrast < settings.shadow_snr * noise)


@dataclass(frozen=True, slots=True)
class Peaks:
    """Fitted peaks, flat.

    Attributes
    ----------
    position, amplitude, width : (n,) float32 arrays
        [samples], [grey levels] and [samples].
    reason : (n,) uint8 array
        WEAK when lost in noise or narrower than a stripe, TWO_PEAKS when too wide for one; else OK.
    typical_width : float
        Median width of the higher peaks [samples]; 0 if there is none.
    """

    position: Floats
    amplitude: Floats
    width: Floats
    reason: npt.NDArray[np.uint8]
    typical_width: float


def measure(
    profiles: Array, level: Floats, index: Array, n_samples: int, noise: float, settings: SweepSettings,
    guided: npt.NDArray[np.bool_] | bool = False,
) -> Peaks:  # fmt: skip
    """Fit every profile, and judge it by its amplitude and width.

    A strong peak's width is fitted with it; a weak one cannot measure its own, and takes the scene's.

    Parameters
    ----------
    profiles, level, index, n_samples
        As in :func:`deskew.acquisition.peaks.fit_profiles`; peaks of negative index are WEAK.
    noise : float
        Standard deviation of a sample [grey levels].
    settings : SweepSettings
        The thresholds.
    guided : (n,) bool array
        Peaks that stand where their neighbours' do.
    """
    position, amplitude, width = (np.zeros(len(index), np.float32) for _ in range(3))
    alone = np.where(guided, -1, index)
    fit_profiles(profiles, level, alone, n_samples, 0.0, position, amplitude, width)
    reason = np.full(len(index), Reason.WEAK, np.uint8)
    # A high sample whose fit failed is no weak peak but no peak at all.
    high_sample = profiles[:, settings.half_width] - level >= _MEASURES_WIDTH * noise
    typical = 0.0
    strong = high_sample | (matched_snr(amplitude, width, noise) >= _MEASURES_WIDTH)
    if (strong & (amplitude > 0)).any():
        # Of the higher peaks only: the lower ones' widths are noise.
        high = strong & (amplitude > 0) & (amplitude >= 0.5 * np.percentile(amplitude[strong], 95))
        typical = float(np.median(width[high]))
        weak = np.where(strong, -1, index)
        fit_profiles(profiles, level, weak, n_samples, typical, position, amplitude, width)
        # A wrong level looks like a low and wide peak: width beyond a stripe's earns no credit.
        least = np.where(guided, settings.guided_snr, settings.min_snr)
        reason[matched_snr(amplitude, np.minimum(width, typical), noise) >= least] = Reason.OK
        reason[strong & (width > settings.width_ratio * typical)] = Reason.TWO_PEAKS
        reason[strong & (width < typical / settings.width_ratio)] = Reason.WEAK
    reason[index < 0] = Reason.WEAK
    if settings.peak == "integer":
        position = index.astype(np.float32)
    return Peaks(position, amplitude, width, reason, typical)


def matched_snr(amplitude: Floats, width: Floats, noise: float) -> Floats:
    """Signal-to-noise ratio of a Gaussian peak to a matched filter, ``A sqrt(s sqrt(pi)) / noise``."""
    return np.asarray(amplitude * np.sqrt(width * math.sqrt(math.pi)) / noise)

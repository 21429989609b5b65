"""Gray code and fringes, rendered frame by frame: every line of the projector has a light of its own."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numba import njit

from data_synth.exposure import exposed
from data_synth.optics import PROFILE_STEPS, blurred, line_profile, psf_taps
from data_synth.rig import RigConfig
from data_synth.synchrony import frames_in
from deskew.errors import require
from deskew.types import Floats

_STEPS = 64
"""Entries of a frame's profile a projector pixel; linear interpolation between them errs by less than 1e-4."""


@dataclass(frozen=True, slots=True)
class Coded:
    """Lazy frames along one axis of the projector. Nothing is rendered until it is asked for.

    Any frame can be rendered alone and comes out the same: its noise depends on seed, frame and pixel only.

    Attributes
    ----------
    coordinate : (rows, columns) float32 array
        Projector coordinate across the lines at each sub-sample [px].
    light : (rows, columns) float32 array
        Grey levels that each sub-sample adds when its line is fully lit.
    black : (height, width) float32 array
        Mean of the black frame [grey levels].
    lines : (frames, extent) array
        Light of each projector line in each frame, as a share of a lit one's.
    config : RigConfig
        Blur, noise and synchrony.
    key, first_frame : int
        Noise seed and the number of frame 0 in the noise's count.
    """

    coordinate: Floats
    light: Floats
    black: Floats
    lines: Floats
    config: RigConfig
    key: int
    first_frame: int

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.lines)

    def __iter__(self) -> Iterator[npt.NDArray[np.unsignedinteger]]:
        """Yield the frames (height, width) in projection order, from the first one each time."""
        return (self[i] for i in range(len(self)))

    def __getitem__(self, index: int) -> npt.NDArray[np.unsignedinteger]:
        """Render one frame."""
        require(0 <= index < len(self), "index", f"be in [0, {len(self) - 1}]", index)
        number = self.first_frame + index
        shown = np.zeros(self.lines.shape[1])
        for frame, share in frames_in(self.config, self.key, number, index):
            if frame >= 0:
                shown += share * self.lines[frame]
        profile, start = light_profile(shown, self.config.projector_blur_sigma_px)
        samples = _lit(self.coordinate, self.light, profile, np.float32(start))
        mean = self.black + blurred(samples, psf_taps(self.config.camera_psf_sigma_px))
        return exposed(mean, self.config, self.key, number)


def light_profile(lines: Floats, blur_sigma_px: float) -> tuple[Floats, float]:
    """Light of one frame along the projector's axis, every line blurred.

    Parameters
    ----------
    lines : (extent,) array
        Light of each line.
    blur_sigma_px : float
        Projector blur [projector px].

    Returns
    -------
    (n,) float32 array, float
        Light at start, start + 1 / 64, ... and that first place [projector px]; none beyond either end.
    """
    profile = line_profile(blur_sigma_px)
    radius = len(profile) // PROFILE_STEPS + 1
    offsets = np.abs(np.arange(-radius, radius + 1)[:, None] - np.arange(_STEPS)[None, :] / _STEPS)
    weights = np.interp(offsets * PROFILE_STEPS, np.arange(len(profile)), profile, right=0.0)
    around = np.lib.stride_tricks.sliding_window_view(np.pad(lines, 2 * radius), 2 * radius + 1)
    return (around @ weights).ravel().astype(np.float32), float(-radius)


@njit(cache=True)
def _lit(coordinate: Floats, light: Floats, profile: Floats, start: float) -> Floats:
    """Light of every sub-sample: its own times its line's."""
    lit = np.zeros_like(light)
    last = len(profile) - 1
    height, width = coordinate.shape
    for y in range(height):
        for x in range(width):
            place = (coordinate[y, x] - start) * np.float32(_STEPS)
            if light[y, x] > 0 and 0 <= place < last:
                i = int(place)
                between = profile[i] + (place - np.float32(i)) * (profile[i + 1] - profile[i])
                lit[y, x] = light[y, x] * between
    return lit

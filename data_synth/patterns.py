"""What the projector is asked to show: a share of full light for each of its lines, frame by frame."""

from __future__ import annotations

import numpy as np

from data_synth.geometry import Ints
from deskew.types import Floats, Fringe, Fringes, PatternKind, Size, half_periods, require_fringes

_FINEST_PX = 16.0
_STEPS_AFTER_GRAY = 6
_STEPS = (4, 4, 4, 8)
_COARSEST = 1.0625  # frames: some room on either side, so that noise cannot wrap the border lines around


def default_fringes(pattern: PatternKind, projector_size: Size) -> Fringes:
    """Fringes of a phase pattern that takes as many frames as a Gray code of 1024 x 768; none for other patterns.

    Parameters
    ----------
    pattern : PatternKind
        Kind.
    projector_size : (width, height)
        Pixels; the longest of several periods covers them.
    """
    if pattern is PatternKind.GRAY_PHASE:
        return (Fringe(_FINEST_PX, _STEPS_AFTER_GRAY),)
    if pattern is PatternKind.MULTI_PHASE:
        longest = max(_COARSEST * max(projector_size), 2 * _FINEST_PX)
        periods = np.geomspace(longest, _FINEST_PX, len(_STEPS))
        return tuple(Fringe(float(period), n) for period, n in zip(periods, _STEPS, strict=True))
    return ()


def projected_lines(pattern: PatternKind, extent: int, fringes: Fringes) -> Floats:
    """Light asked of each projector line in each frame, as :class:`deskew.types.Capture` orders them.

    Parameters
    ----------
    pattern : PatternKind
        Any but the line sweep.
    extent : int
        Projector columns or rows.
    fringes : tuple of Fringe
        Of a phase pattern.

    Returns
    -------
    (frames, extent) array
        In [0, 1].
    """
    require_fringes(pattern, fringes, (extent, 1))
    line = np.arange(extent)
    frames = []
    if pattern is PatternKind.GRAY_CODE:
        frames = _gray_planes(line, extent)
    if pattern is PatternKind.GRAY_PHASE:
        half = int(fringes[0].period_px) // 2
        frames = _gray_planes(line // half, half_periods(fringes[0], extent))
    for fringe in fringes:
        for n in range(fringe.n_steps):
            angle = 2 * np.pi * (line / fringe.period_px - n / fringe.n_steps)
            frames.append((1 + np.cos(angle)) / 2)
    return np.stack(frames)


def _gray_planes(number: Ints, count: int) -> list[Floats]:
    """Bit planes of the reflected code of `number` in [0, count), most significant first, each with its inverse."""
    code = number ^ (number >> 1)
    n_bits = max(1, (count - 1).bit_length())
    planes: list[Floats] = []
    for bit in reversed(range(n_bits)):
        plane = ((code >> bit) & 1).astype(np.float64)
        planes += [plane, 1.0 - plane]
    return planes

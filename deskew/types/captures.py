"""What the camera recorded, and how the projector coded its coordinates (sections 2.3 and 2.4)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from itertools import pairwise
from typing import Protocol

import numpy as np

from deskew.errors import require, require_positive, require_whole
from deskew.types.arrays import Array, Size, require_size

WHITE = "white"  # the light under which every capture is taken


class PatternKind(StrEnum):
    """How the projector codes its coordinates (section 2.3)."""

    LINE_SWEEP = "line_sweep"
    GRAY_CODE = "gray_code"
    GRAY_PHASE = "gray_phase"
    MULTI_PHASE = "multi_phase"


@dataclass(frozen=True, slots=True)
class Fringe:
    """Sinusoidal frames of one period, shifted step by step.

    Frame n of N lights projector line x by ``(1 + cos(2 pi x / period - 2 pi n / N)) / 2`` of full light.

    Attributes
    ----------
    period_px : float
        Projector pixels.
    n_steps : int
        Frames N, in [4, 256]: three would leave nothing to tell noise and harmonics by.
    """

    period_px: float
    n_steps: int

    def __post_init__(self) -> None:
        require_positive("period_px", self.period_px, 1e6, "px")
        require(self.period_px >= 4, "period_px", "be at least 4 px", self.period_px)
        require_whole("n_steps", self.n_steps, 4, 256)


Fringes = tuple[Fringe, ...]


def n_planes(extent: int) -> int:
    """Gray-code frames for `extent` projector columns or rows: one a bit, each followed by its inverse."""
    return 2 * max(1, (extent - 1).bit_length())


def half_periods(fringe: Fringe, extent: int) -> int:
    """Half periods of a fringe, in whole pixels, that cover `extent` projector columns or rows."""
    return -(-extent // (int(fringe.period_px) // 2))


def n_frames(pattern: PatternKind, extent: int, fringes: Fringes = ()) -> int:
    """Frames that code `extent` projector columns or rows, laid out as :class:`Capture` says."""
    if pattern is PatternKind.LINE_SWEEP:
        return extent
    if pattern is PatternKind.GRAY_CODE:
        return n_planes(extent)
    planes = n_planes(half_periods(fringes[0], extent)) if pattern is PatternKind.GRAY_PHASE else 0
    return planes + sum(fringe.n_steps for fringe in fringes)


def require_fringes(pattern: PatternKind, fringes: Fringes, projector_size: Size) -> None:
    """Raise an InputError unless `fringes` are what the pattern needs to tell every line of the projector."""
    periods = [fringe.period_px for fringe in fringes]
    if pattern is PatternKind.GRAY_PHASE:
        even = len(periods) == 1 and periods[0] % 2 == 0
        require(even, "fringes", f"be one of an even period for a {pattern}", periods)
    elif pattern is PatternKind.MULTI_PHASE:
        falling = len(periods) >= 2 and all(a > b for a, b in pairwise(periods))
        require(falling, "fringes", f"be two or more of falling periods for a {pattern}", periods)
        extent = max(projector_size)
        require(periods[0] >= extent, "fringes", f"begin with a period of at least the projector's {extent}", periods)
    else:
        require(not periods, "fringes", f"be none for a {pattern}", periods)


class Frames(Protocol):
    """A sequence of frames that is read or rendered one at a time and never held whole."""

    def __len__(self) -> int:
        """Return the number of frames."""
        ...

    def __iter__(self) -> Iterator[Array]:
        """Yield each frame, (height, width) or (height, width, 3), in projection order."""
        ...


@dataclass(frozen=True, slots=True)
class Capture:
    """What the camera recorded of one still page or board; a rig and a folder enter by this same door.

    Attributes
    ----------
    white, black : (height, width[, 3]) arrays
        The scene under the fully lit and the dark projector.
    projector_size : (width, height)
        Pixels of the projector.
    pattern : PatternKind
        `LINE_SWEEP`: frame i of `columns` lights projector column i, and likewise `rows`.
        `GRAY_CODE`: `columns` and `rows` hold the bit planes, most significant first, each followed by its inverse.
        `GRAY_PHASE`: the bit planes of the number of the half period ``floor(2 x / period)``, then the fringe's steps.
        `MULTI_PHASE`: the steps of each fringe, one after another.
    columns, rows : Frames
        The two sweeps; both are needed for epipolar culling.
    textures : mapping of light name to image
        Further images through the same optics, at any resolution (section 2.4).
    fringes : tuple of Fringe
        Of the phase patterns, the same for columns and rows: one of an even period for `GRAY_PHASE`; for `MULTI_PHASE`
        two or more, the longest period first and no shorter than the projector's larger side.
    profiles : mapping of light name to bytes
        ICC colour profiles of the white image and the textures that have one; carried along, never applied.
    """

    white: Array
    black: Array
    projector_size: Size
    pattern: PatternKind
    columns: Frames
    rows: Frames
    textures: Mapping[str, Array] = field(default_factory=dict)
    fringes: Fringes = ()
    profiles: Mapping[str, bytes] = field(default_factory=dict)

    def __post_init__(self) -> None:
        require_size("projector_size", self.projector_size)
        require_fringes(self.pattern, self.fringes, self.projector_size)
        require(WHITE not in self.textures, "textures", "have names of their own", f"one called {WHITE}")
        for name in ("white", "black"):
            image = getattr(self, name)
            require(isinstance(image, np.ndarray), name, "be an array of grey levels", type(image).__name__)
        picture = self.white.ndim in (2, 3) and self.white.size > 0
        require(picture, "white", "be (height, width[, 3]) of at least 1 pixel", self.white.shape)
        require(
            self.black.shape == self.white.shape, "black", f"have white's shape {self.white.shape}", self.black.shape
        )
        for name, frames, extent in (
            ("columns", self.columns, self.projector_size[0]),
            ("rows", self.rows, self.projector_size[1]),
        ):
            wanted = n_frames(self.pattern, extent, self.fringes)
            require(len(frames) == wanted, name, f"hold {wanted} frames for a {self.pattern} of {extent}", len(frames))

    @property
    def camera_size(self) -> Size:
        """Width and height of the camera's images [px]."""
        return self.white.shape[1], self.white.shape[0]

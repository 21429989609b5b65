"""Decoded projector coordinates and the depth that follows from them, with a reason for every gap (section 2.3)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import numpy.typing as npt

from deskew.errors import require
from deskew.types.arrays import Array, Floats
from deskew.types.devices import Pinhole


class Reason(IntEnum):
    """Why a pixel has no depth; `OK` has one."""

    OK = 0
    SHADOW = 1
    SATURATED = 2
    WEAK = 3
    TWO_PEAKS = 4
    EPIPOLAR = 5
    RANGE = 6
    EDGE = 7


def _require_reasons(reason: Array) -> None:
    known = reason.dtype.kind in "iu" and bool(((reason >= 0) & (reason <= max(Reason))).all())
    require(known, "reason", f"hold whole numbers in [0, {int(max(Reason))}]", f"others, of type {reason.dtype}")


@dataclass(frozen=True, slots=True)
class ProjectorCheck:
    """What the frames of a capture say about the projector, and the camera, that made them.

    Attributes
    ----------
    faults : tuple of str
        A plain sentence for each fault found; empty where the frames agree with one another.
    gamma : float or None
        Fringes only: brightness seen grows with the light asked for to this power, 1 for a linear projector and camera.
    stray : float or None
        Share of a frame's light, root mean square, that comes from a frame other than the one its place in the sequence
        says; 0 if camera and projector are in step. None if hardly any pixel was bright enough to tell.
    """

    faults: tuple[str, ...] = ()
    gamma: float | None = None
    stray: float | None = None


@dataclass(frozen=True, slots=True)
class Correspondence:
    """Projector coordinates seen by each raw camera pixel.

    Attributes
    ----------
    column, row : (height, width) arrays
        Projector coordinates [px], NaN where `reason` is not 0.
    reason : (height, width) uint8 array
        `Reason` of each pixel.
    stripe_px : (width, height) or None
        Of a sweep read curve by curve: typical standard deviation of a stripe of the columns across image rows and of
        one of the rows across image columns [camera px]. None if each pixel was read by itself.
    projector : ProjectorCheck
        What the frames say about the projector.
    """

    column: Floats
    row: Floats
    reason: npt.NDArray[np.uint8]
    stripe_px: tuple[float, float] | None = None
    projector: ProjectorCheck = ProjectorCheck()

    def __post_init__(self) -> None:
        shape = self.column.shape
        require(len(shape) == 2, "column", "be (height, width)", shape)
        require(self.row.shape == shape, "row", f"have column's shape {shape}", self.row.shape)
        require(self.reason.shape == shape, "reason", f"have column's shape {shape}", self.reason.shape)
        _require_reasons(self.reason)
        widths = self.stripe_px
        good = widths is None or (len(widths) == 2 and all(np.isfinite(w) and w >= 0 for w in widths))
        require(good, "stripe_px", "be two finite widths of at least 0 [camera px], or None", widths)


@dataclass(frozen=True, slots=True)
class DepthMap:
    """Depth in the camera's frame on the UNDISTORTED pixel grid (section 2.3).

    Attributes
    ----------
    z : (height, width) array
        Camera z [mm], NaN exactly where `reason` is not 0.
    reason : (height, width) uint8 array
        `Reason` of each pixel.
    camera : Pinhole
        The ideal camera (zero distortion) whose pixels these are.
    """

    z: Floats
    reason: npt.NDArray[np.uint8]
    camera: Pinhole

    def __post_init__(self) -> None:
        width, height = self.camera.size
        require(self.z.shape == (height, width), "z", f"have the camera's shape {(height, width)}", self.z.shape)
        require(self.reason.shape == self.z.shape, "reason", f"have z's shape {self.z.shape}", self.reason.shape)
        _require_reasons(self.reason)
        require(not self.camera.distortion.any(), "camera", "be free of distortion", self.camera.distortion.tolist())
        require(
            bool(np.array_equal(np.isfinite(self.z), self.reason == 0)),
            "z",
            "be finite exactly where reason is 0",
            "a mismatch",
        )

"""Matched directions of both devices, free of lens distortion: what epipolar culling and triangulation start from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deskew.errors import require
from deskew.projection import pixel_grid, undistort
from deskew.types import Calibration, Capture, Correspondence, Floats, Reason


@dataclass(frozen=True, slots=True)
class Matches:
    """The N decoded pixels of a correspondence.

    Attributes
    ----------
    mask : (height, width) bool array
        Which raw pixels they are; the other arrays follow its raster order.
    camera : (N, 2) array
        Normalised camera coordinates (x/z, y/z).
    projector : (N, 2) array
        Normalised projector coordinates of the decoded point.
    R, t : (3, 3) and (3,) arrays
        Camera to projector frame, ``x_p = R x_c + t`` [mm].
    focal_px : (2,) array
        The projector's focal lengths: normalised differences times these are projector pixels.
    """

    mask: npt.NDArray[np.bool_]
    camera: Floats
    projector: Floats
    R: Floats
    t: Floats
    focal_px: Floats


def require_same_devices(calibration: Calibration, capture: Capture) -> None:
    """Raise an InputError unless a capture is of the sizes of the calibrated devices."""
    for name, calibrated, got in (
        ("camera", calibration.camera, capture.camera_size),
        ("projector", calibration.projector, capture.projector_size),
    ):
        size = tuple(calibrated.size)
        require(tuple(got) == size, f"capture.{name}_size", f"equal calibration.{name}.size {size}", tuple(got))


def match(calibration: Calibration, correspondence: Correspondence) -> Matches:
    """Undistort both ends of every decoded pixel.

    Raises
    ------
    InputError
        The correspondence is not of the calibrated camera's size.
    """
    camera, projector = calibration.camera, calibration.projector
    width, height = camera.size
    got = correspondence.column.shape
    require(got == (height, width), "correspondence", f"have the calibrated camera's shape {(height, width)}", got)
    mask = correspondence.reason == Reason.OK
    decoded = np.stack([correspondence.column[mask], correspondence.row[mask]], axis=-1).astype(np.float64)
    R = projector.R @ camera.R.T
    return Matches(
        mask,
        undistort(camera, pixel_grid(camera.size)[mask]) if mask.any() else np.empty((0, 2)),
        undistort(projector, decoded) if mask.any() else decoded,
        R,
        projector.t - R @ camera.t,
        np.array([projector.K[0, 0], projector.K[1, 1]]),
    )

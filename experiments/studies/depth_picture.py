"""Signed depth error as a picture."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from deskew import projection
from deskew.types import DepthMap, Floats

FULL_COLOUR_MM = 0.1
_MISSING = 110
_ELSEWHERE = 30


def depth_error_picture(
    depth: DepthMap, true_points: Floats, full_colour_mm: float = FULL_COLOUR_MM
) -> npt.NDArray[np.uint8]:
    """Colour each pixel by how far its depth is off along the line of sight.

    Parameters
    ----------
    depth : DepthMap
        Measured.
    true_points : (H, W, 3) array
        True points at the same pixels [mm]; NaN beside the target.
    full_colour_mm : float
        Error that is drawn in full colour, as any larger one [mm].

    Returns
    -------
    (H, W, 3) array
        White: exact. Red: too far from the camera, blue: too near, in full colour from `full_colour_mm` on. Grey: not
        measured. Nearly black: beside the target.
    """
    rays = projection.rays(depth.camera, projection.pixel_grid(depth.camera.size))
    measured = projection.centre(depth.camera) + depth.z[..., None] * rays
    along = ((measured - true_points) * rays).sum(axis=-1) / np.linalg.norm(rays, axis=-1)
    level = np.clip(along / full_colour_mm, -1.0, 1.0)
    rgb = 255.0 * (1.0 - np.stack([np.maximum(-level, 0.0), np.abs(level), np.maximum(level, 0.0)], axis=-1))
    target = np.isfinite(true_points[..., 0])
    rgb[~np.isfinite(along)] = _MISSING
    rgb[~target] = _ELSEWHERE
    return np.asarray(np.rint(rgb), dtype=np.uint8)

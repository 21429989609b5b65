"""Where the surface breaks off: depth that no continuous page could climb between two pixels."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from deskew.types import Floats

STEEPEST_DEG = 75.0
"""Paper that rises more steeply than this along the line of sight is not told from a break in it."""
NOISE_MM = 1.0
"""Depth between two neighbouring pixels that noise alone may put there."""


def depth_jumps(z: Floats, page: npt.NDArray[np.bool_], focal_px: float) -> npt.NDArray[np.bool_]:
    """Find the pixels on either side of a jump, also of one that lies in a hole of the depth map.

    Every pixel without depth takes that of the nearest pixel that has one. Between two neighbouring pixels the depth
    may then change by what a surface of the steepest slope gains between the places that their depths come from.

    Parameters
    ----------
    z : (height, width) array
        Camera z [mm], NaN where it is not known.
    page : (height, width) bool array
        The page: the edge to what lies beside it is no jump.
    focal_px : float
        Of the camera [px].

    Returns
    -------
    (height, width) bool array
    """
    known = page & np.isfinite(z)
    jump = np.zeros(z.shape, dtype=bool)
    if not known.any():
        return jump
    source = ndimage.distance_transform_edt(~known, return_distances=False, return_indices=True)
    depth = z[tuple(source)]
    gain = np.tan(np.radians(STEEPEST_DEG)) / focal_px
    for axis in (0, 1):
        near = (slice(None, -1), slice(None)) if axis == 0 else (slice(None), slice(None, -1))
        far = (slice(1, None), slice(None)) if axis == 0 else (slice(None), slice(1, None))
        apart = np.hypot(*(source[(slice(None), *far)] - source[(slice(None), *near)]).astype(np.float64))
        allowed = NOISE_MM + gain * apart * np.minimum(depth[near], depth[far])
        broken = (np.abs(depth[far] - depth[near]) > allowed) & page[near] & page[far]
        jump[near] |= broken
        jump[far] |= broken
    return jump

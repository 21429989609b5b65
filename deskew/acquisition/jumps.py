"""Where the surface breaks off: depth that no continuous page could climb between two pixels."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from deskew.types import Floats

STEEPEST_DEG = 80.0
"""Paper that rises more steeply than this along the line of sight is not told from a break in it."""
SHORTEST_PX = 8
"""A break is longer than this; what is shorter is a wrong depth or two, which must not tear a page."""


def depth_jumps(z: Floats, page: npt.NDArray[np.bool_], focal_px: float) -> npt.NDArray[np.bool_]:
    """Find the pixels on either side of a jump, also of one that lies in a hole of the depth map.

    Every pixel without depth takes that of the nearest pixel that has one. Between two neighbouring pixels the depth
    may then change by what a surface of the steepest slope gains between the places that their depths come from, a
    pixel's own width included: in any unit of length, five millimetres where a pixel sees half a one.

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
        allowed = gain * (apart + 1.0) * np.minimum(depth[near], depth[far])
        broken = (np.abs(depth[far] - depth[near]) > allowed) & page[near] & page[far]
        jump[near] |= broken
        jump[far] |= broken
    return _long_ones(jump)


def _long_ones(jump: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Keep the connected breaks that reach far enough."""
    labels, _ = ndimage.label(jump, np.ones((3, 3)))
    reach = [max(side.stop - side.start for side in box) for box in ndimage.find_objects(labels)]
    return np.asarray(np.array([False, *(length > SHORTEST_PX for length in reach)])[labels])

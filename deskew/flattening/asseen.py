"""How a flat sheet lies on the plane: as the bent one is seen from above, neither moved, nor turned, nor mirrored."""

from __future__ import annotations

import numpy as np

from deskew.types import Floats

# Share of a sheet's area, as seen from above, that must show its back before it counts as upside down: a sheet rolled
# by more than half a turn shows up to 0.22, an overturned page nearly all.
_UPSIDE_DOWN = 0.25


def is_upside_down(normals: Floats) -> bool:
    """Whether a sheet mostly faces down, by its normals (..., 3), as long as their areas; a rolled one never does."""
    areas = np.sqrt(np.einsum("...k,...k->...", normals, normals))
    return float(normals[..., 2].sum()) < -_UPSIDE_DOWN * float(areas.sum())


def as_seen(places: Floats, vertices: Floats, mirror: float = 1.0) -> Floats:
    """Turn and move flat places to where the sheet is as seen from above.

    Parameters
    ----------
    places : (..., 2) array
        Flattened [mm].
    vertices : (..., 3) array
        The sheet [mm].
    mirror : float
        -1 to turn the flat sheet over first.

    Returns
    -------
    (..., 3) array
        With z = 0 [mm].
    """
    p = places - places.reshape(-1, 2).mean(axis=0)
    p[..., 1] *= mirror
    middle = vertices[..., :2].reshape(-1, 2).mean(axis=0)
    px, py, qx, qy = p[..., 0], p[..., 1], vertices[..., 0] - middle[0], vertices[..., 1] - middle[1]
    angle = np.arctan2(float((px * qy - py * qx).sum()), float((px * qx + py * qy).sum()))
    flat = np.zeros(vertices.shape)
    flat[..., 0] = np.cos(angle) * px - np.sin(angle) * py + middle[0]
    flat[..., 1] = np.sin(angle) * px + np.cos(angle) * py + middle[1]
    return flat

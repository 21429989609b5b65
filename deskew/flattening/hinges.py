"""The hinges of a triangle mesh: each inner edge with its two triangles, and how sharply the surface bends there.

Noise moves vertices along known directions (`directions.py`). In the plane across the direction a hinge is four fixed
points, whatever the noise, and the jump of the surface's slope across the edge is linear in the four heights: with c
and d the far corners, p and q the feet of their altitudes on the edge (i, j),

    jump = (z_c - z_p) / |c - p| + (z_d - z_q) / |d - q|,

positive where the surface bends upwards. This is the linear form of the hinge of discrete bending models.

References
----------
Bergou et al., A quadratic bending model for inextensible surfaces, SGP 2006.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from deskew.flattening.edges import Indices, edges_of
from deskew.types import Array, Floats

# Least altitude of a hinge's triangle over the mesh's mean edge: in a near-vertical wall it vanishes.
_LEAST_ALTITUDE = 0.05


class Hinges(NamedTuple):
    """Inner edges as stencils over offsets of the vertices along the directions of the noise.

    Attributes
    ----------
    vertices : (M, 4) int array
        The edge's ends and the two far corners.
    stencils : (M, 4) array
        Jump of slope for a unit offset of each [1/mm].
    jumps : (M,) array
        Jump of slope without any offset.
    lengths : (M,) array
        Length of the edge across the direction [mm].
    """

    vertices: Indices
    stencils: Floats
    jumps: Floats
    lengths: Floats


def hinges_of(vertices: Floats, faces: Array, directions: Floats) -> Hinges:
    """Find the hinges of a mesh.

    Parameters
    ----------
    vertices : (V, 3) array
        Positions [mm].
    faces : (F, 3) int array
        Triangles.
    directions : (V, 3) array
        Unit vectors along which the vertices may move.
    """
    corners = _four_corners(faces)
    # Relative to one corner: coordinates far from the origin would cancel badly.
    arms = vertices[corners[:, 1:]] - vertices[corners[:, :1]]
    mean_edge = float(np.linalg.norm(arms[:, 0], axis=1).mean()) if len(corners) else 0.0
    shortest = max(_LEAST_ALTITUDE * mean_edge, 1e-100)  # whose square is not yet 0
    ups = directions[corners]
    up = ups.sum(axis=1)
    up /= np.maximum(np.linalg.norm(up, axis=1, keepdims=True), 1e-300)
    rises = np.einsum("mkx,mx->mk", arms, up)
    flat = arms - rises[:, :, None] * up[:, None]
    edges, far = flat[:, 0], flat[:, 1:]
    lengths = np.maximum(np.linalg.norm(edges, axis=1), shortest)
    along = np.einsum("mkx,mx->mk", far, edges) / lengths[:, None] ** 2
    altitudes = np.linalg.norm(far - along[:, :, None] * edges[:, None], axis=2)
    slopes = 1.0 / np.maximum(altitudes, shortest)
    stencils = np.column_stack([((along - 1.0) * slopes).sum(axis=1), -(along * slopes).sum(axis=1), slopes])
    jumps = np.einsum("mk,mk->m", stencils[:, 1:], rises)
    stencils *= np.einsum("mkx,mx->mk", ups, up)
    return Hinges(corners, stencils, jumps, lengths)


def _four_corners(faces: Array) -> Indices:
    """Find the ends of every edge that has two faces, in their order, and the corners opposite to it."""
    edges, corners = edges_of(faces), np.asarray(faces, dtype=np.int64).ravel()
    of_half = edges.of_face.ravel()
    one = np.flatnonzero(edges.opposite > np.arange(len(of_half)))
    one = one[np.argsort(of_half[one])]
    far = [corners[half - half % 3 + (half + 2) % 3] for half in (one, edges.opposite[one])]
    return np.column_stack([edges.ends[of_half[one]], *far])

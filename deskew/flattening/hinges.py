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
import numpy.typing as npt
from numba import njit

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

    vertices: npt.NDArray[np.int64]
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
    corners = _four_corners(faces, len(vertices))
    edges = vertices[corners[:, 1]] - vertices[corners[:, 0]]
    shortest = _LEAST_ALTITUDE * float(np.linalg.norm(edges, axis=1).mean()) if len(corners) else 0.0
    n = len(corners)
    found = Hinges(corners, np.empty((n, 4)), np.empty(n), np.empty(n))
    _measure(vertices, np.ascontiguousarray(directions), shortest, *found)
    return found


def _four_corners(faces: Array, n_vertices: int) -> npt.NDArray[np.int64]:
    """Find the ends of every edge that has two faces, and the corners opposite to it."""
    far = np.ascontiguousarray(faces, dtype=np.int64).ravel()
    start, end = faces[:, [1, 2, 0]].ravel().astype(np.int64), faces[:, [2, 0, 1]].ravel().astype(np.int64)
    low, high = np.minimum(start, end), np.maximum(start, end)
    keys = low * n_vertices + high
    order = np.argsort(keys, kind="stable")
    first = np.flatnonzero(keys[order][1:] == keys[order][:-1])
    one, other = order[first], order[first + 1]
    return np.stack([low[one], high[one], far[one], far[other]], axis=1)


@njit(cache=True)
def _measure(
    vertices: Floats,
    directions: Floats,
    shortest: float,
    corners: Array,
    stencils: Floats,
    jumps: Floats,
    lengths: Floats,
) -> None:
    """Fill the stencils; every hinge is seen along the mean direction of its four corners."""
    up, edge, arm, coefficients = np.empty(3), np.empty(3), np.empty(3), np.empty(4)
    for m in range(len(corners)):
        i, j = corners[m, 0], corners[m, 1]
        size = 0.0
        for axis in range(3):
            up[axis] = 0.0
            for k in range(4):
                up[axis] += directions[corners[m, k], axis]
            size += up[axis] ** 2
        rise = 0.0
        for axis in range(3):
            up[axis] /= np.sqrt(size) if size > 0.0 else 1.0
            edge[axis] = vertices[j, axis] - vertices[i, axis]
            rise += edge[axis] * up[axis]
        square = 0.0
        for axis in range(3):
            edge[axis] -= rise * up[axis]
            square += edge[axis] ** 2
        square = max(square, shortest**2)
        coefficients[0] = coefficients[1] = 0.0
        for k in range(2, 4):
            rise, along = 0.0, 0.0
            for axis in range(3):
                arm[axis] = vertices[corners[m, k], axis] - vertices[i, axis]
                rise += arm[axis] * up[axis]
                along += arm[axis] * edge[axis]
            along /= square
            altitude = 0.0
            for axis in range(3):
                altitude += (arm[axis] - rise * up[axis] - along * edge[axis]) ** 2
            coefficients[k] = 1.0 / max(np.sqrt(altitude), shortest)
            coefficients[0] -= (1.0 - along) * coefficients[k]
            coefficients[1] -= along * coefficients[k]
        jumps[m], lengths[m] = 0.0, np.sqrt(square)
        for k in range(4):
            seen = 0.0
            for axis in range(3):
                # Relative to one corner: coordinates far from the origin would cancel badly.
                jumps[m] += coefficients[k] * (vertices[corners[m, k], axis] - vertices[i, axis]) * up[axis]
                seen += directions[corners[m, k], axis] * up[axis]
            stencils[m, k] = coefficients[k] * seen

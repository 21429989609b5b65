"""The edges of a triangle mesh, which faces share them, and the loops of its border."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from deskew.types import Array

Indices = npt.NDArray[np.int64]


class Edges(NamedTuple):
    """The edges of a triangle mesh.

    Attributes
    ----------
    ends : (E, 2) int array
        Vertices of each edge, the smaller index first, sorted by the first and then by the second.
    of_face : (F, 3) int array
        The k-th edge of a face joins its corners k and k + 1.
    opposite : (3 F,) int array
        The half-edge 3 f + k runs from corner k of face f to corner k + 1; this is the one on the same edge's other
        side, -1 at a border.
    """

    ends: Indices
    of_face: Indices
    opposite: Indices


def edges_of(faces: Array) -> Edges:
    """Find the edges of triangles (F, 3); of an edge with more than two faces, the last two are opposite.

    This order of edges is the one that per-edge arrays, such as rest lengths, are given in.
    """
    corners = np.ascontiguousarray(faces, dtype=np.int64)
    start, end = corners.ravel(), corners[:, (1, 2, 0)].ravel()
    n = int(corners.max()) + 1
    keys = np.minimum(start, end) * n + np.maximum(start, end)
    order = np.argsort(keys)
    of_half, n_edges, opposite = _pair(keys, order)
    ends = np.empty((n_edges, 2), dtype=np.int64)
    ends[of_half, 0], ends[of_half, 1] = np.minimum(start, end), np.maximum(start, end)
    return Edges(ends, of_half.reshape(-1, 3), opposite)


def border_loops(faces: Indices, edges: Edges) -> list[Indices]:
    """Half-edges along each loop of the border of a manifold mesh, in order; the loop of most edges first."""
    border = np.flatnonzero(edges.opposite < 0)
    leaving = np.full(int(faces.max()) + 1, -1, dtype=np.int64)
    leaving[faces.ravel()[border]] = border
    order, starts = _trace(border, leaving, faces)
    loops = np.split(order, starts[1:])
    return sorted(loops, key=len, reverse=True)


@njit(cache=True)
def _pair(keys: Indices, order: Indices) -> tuple[Indices, int, Indices]:
    """Give equal keys the same number, and join the half-edges that share one."""
    of_half = np.empty(len(keys), dtype=np.int64)
    opposite = np.full(len(keys), -1, dtype=np.int64)
    edge = -1
    for i in range(len(order)):
        half = order[i]
        if i == 0 or keys[half] != keys[order[i - 1]]:
            edge += 1
        else:
            opposite[half], opposite[order[i - 1]] = order[i - 1], half
        of_half[half] = edge
    return of_half, edge + 1, opposite


@njit(cache=True)
def _trace(border: Indices, leaving: Indices, faces: Indices) -> tuple[Indices, Indices]:
    """Border half-edges in the order in which they follow each other, and where each loop starts."""
    order = np.empty(len(border), dtype=np.int64)
    starts = np.empty(len(border), dtype=np.int64)
    n, loops = 0, 0
    for i in range(len(border)):
        half = leaving[faces[border[i] // 3, border[i] % 3]]
        if half < 0:
            continue
        starts[loops] = n
        loops += 1
        while half >= 0:
            order[n] = half
            n += 1
            leaving[faces[half // 3, half % 3]] = -1
            half = leaving[faces[half // 3, (half + 1) % 3]]
    return order[:n], starts[:loops]

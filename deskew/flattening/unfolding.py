"""A start for flattening: find first in which direction every edge points in the plane, then where the vertices lie.

Each vertex gets a frame, in which its edges have known bearings. Turning the frames by angles theta so that both ends
of every edge agree on its direction is a least-squares problem in the differences of theta, a Poisson equation; placing
the vertices so that every edge has its length in its direction is another, with the same matrix. On a surface that can
be developed both are solved exactly; on any other the misfit is spread evenly, without the shrinking of conformal maps.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from deskew.flattening.edges import Indices
from deskew.flattening.laplace import Laplacian
from deskew.types import Floats


def unfold(ends: Indices, weights: Floats, lengths: Floats, bearing: Floats, system: Laplacian) -> Floats:
    """Lay a mesh out in the plane from its lengths and angles, (V, 2) [mm].

    Parameters
    ----------
    ends : (E, 2) int array
        Vertices of each edge, sorted.
    weights : (E,) array
        Weights that `system` was made of.
    lengths : (E,) array
        [mm].
    bearing : (E, 2) array
        Directions in which each edge leaves its two ends, in their own frames [rad].
    system : Laplacian
        Of the edges and weights.
    """
    n_vertices = int(ends.max()) + 1
    wanted = bearing[:, 1] - bearing[:, 0] + np.pi  # theta_a - theta_b
    theta = _along_tree(ends, wanted, n_vertices)
    misfit = _wrapped(theta[ends[:, 0]] - theta[ends[:, 1]] - wanted)
    theta += system.solve(_scattered(ends, weights * misfit, n_vertices)[:, None])[:, 0]
    misfit = _wrapped(theta[ends[:, 0]] - theta[ends[:, 1]] - wanted)
    direction = theta[ends[:, 0]] + bearing[:, 0] - misfit / 2
    pull = weights * lengths
    return system.solve(
        np.stack(
            [
                _scattered(ends, pull * np.cos(direction), n_vertices),
                _scattered(ends, pull * np.sin(direction), n_vertices),
            ],
            axis=-1,
        )
    )


def _wrapped(angle: Floats) -> Floats:
    """Angles in [-pi, pi)."""
    return np.asarray((angle + np.pi) % (2 * np.pi) - np.pi)


def _scattered(ends: Indices, along: Floats, n_vertices: int) -> Floats:
    """Sum at each vertex of what flows in along edges, less what flows out."""
    return np.asarray(np.bincount(ends[:, 1], along, n_vertices) - np.bincount(ends[:, 0], along, n_vertices))


@njit(cache=True)
def _along_tree(ends: Indices, wanted: Floats, n_vertices: int) -> Floats:
    """Angles (V,) with theta_a - theta_b = wanted along the edges of a breadth-first tree."""
    start = np.zeros(n_vertices + 1, dtype=np.int64)
    for e in range(len(ends)):
        start[ends[e, 0] + 1] += 1
        start[ends[e, 1] + 1] += 1
    for v in range(n_vertices):
        start[v + 1] += start[v]
    at = start[:-1].copy()
    incident = np.empty(2 * len(ends), dtype=np.int64)
    for e in range(len(ends)):
        for k in range(2):
            v = ends[e, k]
            incident[at[v]] = e
            at[v] += 1
    theta = np.zeros(n_vertices)
    seen = np.zeros(n_vertices, dtype=np.bool_)
    queue = np.empty(n_vertices, dtype=np.int64)
    seen[0] = True
    queue[0] = 0
    head, tail = 0, 1
    while head < tail:
        a = queue[head]
        head += 1
        for i in range(start[a], start[a + 1]):
            e = incident[i]
            first = ends[e, 0] == a
            b = ends[e, 1] if first else ends[e, 0]
            if not seen[b]:
                seen[b] = True
                theta[b] = theta[a] - wanted[e] if first else theta[a] + wanted[e]
                queue[tail] = b
                tail += 1
    return theta

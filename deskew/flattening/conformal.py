"""Conformal and harmonic maps to the plane: starts that hold where a direct unfolding does not.

References
----------
Lévy et al., Least squares conformal maps for automatic texture atlas generation, ACM TOG 21(3), 2002.
Tutte, How to draw a graph, Proc. London Math. Soc. 13, 1963.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import block_array, csc_array

from deskew.flattening.edges import Edges, Indices, border_loops
from deskew.flattening.intrinsic import Triangles
from deskew.flattening.laplace import factor, laplacian
from deskew.types import Floats


def lscm(shapes: Triangles, faces: Indices, edges: Edges) -> Floats:
    """Least-squares conformal map, scaled to the surface's true area, (V, 2) [mm].

    The conformal energy is the harmonic one less the area that the map covers. The two border vertices that lie
    farthest apart along the border are held; faces wind counter-clockwise.
    """
    ends, n = edges.ends, len(np.unique(faces))
    cotangents = np.bincount(edges.of_face.ravel(), 0.5 * shapes.cotangents.ravel(), len(ends)).astype(np.float64)
    L = laplacian(ends, cotangents, n)
    border = np.flatnonzero(edges.opposite < 0)
    a, b = faces.ravel()[border], faces.ravel()[border - border % 3 + (border + 1) % 3]
    half = np.full(len(border), 0.5)
    # The area is half the sum of x_a y_b - x_b y_a along the border.
    A = csc_array((np.concatenate([half, -half]), (np.concatenate([a, b]), np.concatenate([b, a]))), shape=(n, n))
    system = csc_array(block_array([[L, -A], [A, L]]))
    loop = border_loops(faces, edges)[0]
    along = np.cumsum(shapes.lengths[edges.of_face.ravel()[loop]])
    ring = faces.ravel()[loop]
    held = np.array([ring[-1], ring[int(np.searchsorted(along, along[-1] / 2)) % len(ring)]])
    fixed = np.concatenate([held, held + n])
    free = np.setdiff1d(np.arange(2 * n), fixed)
    out = np.zeros(2 * n)
    out[held[1]] = 1.0
    rows = system[free]
    out[free] = factor(rows[:, free]).solve(-(rows[:, fixed] @ out[fixed]))
    x = np.ascontiguousarray(out.reshape(2, n).T)
    return np.asarray(x * np.sqrt(float(shapes.areas.sum()) / max(abs(covered_area(x, faces)), 1e-300)))


def tutte(shapes: Triangles, faces: Indices, edges: Edges) -> Floats:
    """Harmonic map onto the disc of the surface's area, which folds no face, (V, 2) [mm].

    All weights are 1. The longest border loop goes round the circle; every other loop is closed by a vertex in its
    middle, so that Tutte's theorem holds.
    """
    n = len(np.unique(faces))
    outer, *holes = border_loops(faces, edges)
    ends = [edges.ends]
    for k, hole in enumerate(holes):
        ring = faces.ravel()[hole]
        ends.append(np.stack([ring, np.full_like(ring, n + k)], axis=-1))
    spokes = np.concatenate(ends)
    L = laplacian(spokes, np.ones(len(spokes)), n + len(holes))
    ring = faces.ravel()[outer]
    steps = shapes.lengths[edges.of_face.ravel()[outer]]
    angle = 2 * np.pi * (np.cumsum(steps) - steps) / steps.sum()
    radius = np.sqrt(float(shapes.areas.sum()) / np.pi)
    x = np.zeros((n + len(holes), 2))
    x[ring] = radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    free = np.setdiff1d(np.arange(len(x)), ring)
    if free.size:
        rows = L[free]
        x[free] = factor(rows[:, free]).solve(-(rows[:, ring] @ x[ring]))
    return np.ascontiguousarray(x[:n])


def covered_area(x: Floats, faces: Indices) -> float:
    """Sum of the signed areas of faces (F, 3) in the plane [mm^2]."""
    return float(signed_areas(x, faces).sum())


def signed_areas(x: Floats, faces: Indices) -> Floats:
    """Area of each face (F,) in the plane [mm^2], negative where it is turned over."""
    a, b, c = x[faces[:, 0]], x[faces[:, 1]], x[faces[:, 2]]
    return np.asarray(0.5 * ((b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])))

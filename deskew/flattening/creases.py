"""Lengths on the surface between mesh vertices: an edge that crosses a crease is a chord, shorter than the paper.

Where a crease runs between two vertices the mesh cuts the corner. Seen in the plane of the edge and the surface's
normal, the paper goes straight on from either side until both lines meet: with a and b the angles between the chord c
and the two lines,

    length = c (sin a + sin b) / sin(a + b).

The lines are taken from the triangles behind the edge's ends, which lie on their own sides of the crease. A curved
sheet turns everywhere, and its chords are good already; so of the turning at an end, only what exceeds 1.5 times the
turning one step further back counts as a crease, in the spirit of essentially non-oscillatory schemes with subcell
resolution. Without a crease the angles vanish, and the length is the chord.

References
----------
Harten, ENO schemes with subcell resolution, J. Comput. Phys. 83, 1989.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from deskew.flattening.edges import Indices, edges_of
from deskew.types import Array, Floats

# The bearing behind an end may miss its fan of triangles by this share: a border is never quite straight.
_MISS = 0.2
# A crease counts as turning by no more [rad]: at pi the formula has no end, and what is sharper is a wall between two
# samples, of which nothing is known.
_SHARPEST = 2.0
# Turning that changes by no more than this factor from vertex to vertex is curvature.
_CURVATURE = 1.5


class Rays(NamedTuple):
    """What lies behind both ends of every edge, seen from the other end.

    Half-edge 2 e starts at the first vertex of edge e, half-edge 2 e + 1 at the second.

    Attributes
    ----------
    edges : (E, 2) int array
        Unique edges, the smaller vertex first, in order.
    behind : (2 E, 2) int array
        Ends of the edge that the line of the half-edge meets when followed backwards from its start; -1 where it
        leaves the mesh at once.
    shares : (2 E, 2) array
        The step backwards as a combination of the two edges from the start to `behind`; as long as the half-edge.
    before : (2 E, 2) int array
        Half-edges from `behind` to the start.
    directions : (V, 3) array
        Up, at each vertex.
    """

    edges: Indices
    behind: Indices
    shares: Floats
    before: Indices
    directions: Floats


def rays_of(vertices: Floats, faces: Array, directions: Floats) -> Rays:
    """Follow every edge backwards from both its ends.

    Parameters
    ----------
    vertices : (V, 3) array
        Positions [mm].
    faces : (F, 3) int array
        Triangles.
    directions : (V, 3) array
        Unit vectors, up at each vertex; only positions across them matter.
    """
    n = len(vertices)
    corners = np.ascontiguousarray(faces, dtype=np.int64)
    edges = edges_of(corners).ends
    keys = edges @ np.array([n, 1])
    order = np.argsort(corners.ravel(), kind="stable")
    starts = np.searchsorted(corners.ravel()[order], np.arange(n + 1))
    behind, shares = np.full((2 * len(edges), 2), -1), np.zeros((2 * len(edges), 2))
    up = np.ascontiguousarray(directions)
    _look_behind(vertices, corners, up, edges, order, starts, behind, shares)
    owners = edges.ravel()[:, None]
    at = np.searchsorted(keys, np.minimum(behind, owners) * n + np.maximum(behind, owners))
    before = 2 * np.minimum(at, len(keys) - 1) + (behind > owners)
    return Rays(edges, behind, shares, before, up)


def crease_lengths(vertices: Floats, rays: Rays) -> Floats:
    """Length of every edge on the surface, around the creases that it crosses.

    Parameters
    ----------
    vertices : (V, 3) array
        Positions [mm]; those that the rays were made for, or others that differ along the directions.
    rays : Rays
        Of the mesh.

    Returns
    -------
    (E,) array
        Lengths [mm], at least the chords.
    """
    turns = np.zeros(2 * len(rays.edges))
    _turns(vertices, *rays, turns)
    a, b = rays.edges.T
    lengths: Floats = np.linalg.norm(vertices[a] - vertices[b], axis=1)
    _unfold(turns, rays.behind, rays.shares, rays.before, lengths)
    return lengths


@njit(cache=True)
def _across(vertices: Floats, up: Floats, start: int, end: int, out: Floats) -> float:
    """Step from one vertex to another without its part along `up`, into `out`; return that part."""
    rise = 0.0
    for axis in range(3):
        out[axis] = vertices[end, axis] - vertices[start, axis]
        rise += out[axis] * up[axis]
    for axis in range(3):
        out[axis] -= rise * up[axis]
    return rise


@njit(cache=True)
def _look_behind(
    vertices: Floats,
    faces: Indices,
    directions: Floats,
    edges: Indices,
    order: Indices,
    starts: Indices,
    behind: Indices,
    shares: Floats,
) -> None:
    """Of the triangles at each half-edge's start, find the one that the backward step points into."""
    d, u, v = np.empty(3), np.empty(3), np.empty(3)
    for half in range(2 * len(edges)):
        start, end = edges[half // 2, half % 2], edges[half // 2, 1 - half % 2]
        up = directions[start]
        _across(vertices, up, start, end, d)
        best = -_MISS
        for place in range(starts[start], starts[start + 1]):
            face, corner = order[place] // 3, order[place] % 3
            p, q = faces[face, (corner + 1) % 3], faces[face, (corner + 2) % 3]
            _across(vertices, up, start, p, u)
            _across(vertices, up, start, q, v)
            uu = u[0] * u[0] + u[1] * u[1] + u[2] * u[2]
            uv = u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
            vv = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
            du = -(d[0] * u[0] + d[1] * u[1] + d[2] * u[2])
            dv = -(d[0] * v[0] + d[1] * v[1] + d[2] * v[2])
            area = uu * vv - uv * uv
            if area <= 1e-12 * uu * vv:
                continue
            a, b = (du * vv - dv * uv) / area, (dv * uu - du * uv) / area
            inside = min(a, b) / max(abs(a), abs(b), 1e-300)
            if inside > best:
                best = inside
                behind[half, 0], behind[half, 1] = p, q
                shares[half, 0], shares[half, 1] = max(a, 0.0), max(b, 0.0)


@njit(cache=True)
def _turns(
    vertices: Floats,
    edges: Indices,
    behind: Indices,
    shares: Floats,
    before: Indices,
    directions: Floats,
    turns: Floats,
) -> None:
    """Angle by which the surface turns upwards at the start of each half-edge [rad]; 0 where nothing lies behind."""
    d, back = np.empty(3), np.empty(3)
    for half in range(2 * len(edges)):
        if behind[half, 0] < 0:
            continue
        start, end = edges[half // 2, half % 2], edges[half // 2, 1 - half % 2]
        up = directions[start]
        ahead = _across(vertices, up, start, end, d)
        length = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
        rise = 0.0
        for k in range(2):
            rise += shares[half, k] * _across(vertices, up, start, behind[half, k], back)
        turns[half] = np.arctan2(ahead, length) + np.arctan2(rise, length)


@njit(cache=True)
def _unfold(turns: Floats, behind: Indices, shares: Floats, before: Indices, lengths: Floats) -> None:
    """Lengthen the chords of edges whose two ends turn the same way, in place."""
    excess = np.empty(2)
    for edge in range(len(lengths)):
        for side in range(2):
            half = 2 * edge + side
            turn, total = turns[half], shares[half, 0] + shares[half, 1]
            prior = 0.0
            if behind[half, 0] >= 0 and total > 0.0:
                prior = (shares[half, 0] * turns[before[half, 0]] + shares[half, 1] * turns[before[half, 1]]) / total
            if prior * turn > 0.0:
                turn -= np.sign(turn) * min(abs(turn), _CURVATURE * abs(prior))
            excess[side] = turn
        a, b = abs(excess[0]), abs(excess[1])
        if excess[0] * excess[1] > 0.0:
            blunted = min(1.0, _SHARPEST / (a + b))
            a, b = a * blunted, b * blunted
            lengths[edge] *= (np.sin(a) + np.sin(b)) / np.sin(a + b)

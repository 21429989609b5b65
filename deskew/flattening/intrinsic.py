"""Triangles from their three lengths alone: areas, angles, cotangents; and the bearings of the edges at a vertex.

All that flattening needs of a surface is the lengths on it, so these come from an array of edge lengths, which may
have been corrected, and not from positions.

References
----------
Liu et al., A local/global approach to mesh parameterization, SGP 2008 (triangles laid flat one by one).
Knöppel et al., Globally optimal direction fields, ACM TOG 32(4), 2013, section 6 (angles at a vertex made to sum to a
full turn).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from deskew.flattening.edges import Edges, Indices
from deskew.types import Floats

_SHORTEST = 1e-6  # of the mean edge: shorter ones count as this long
_FLATTEST = 1e-4  # least altitude of a triangle over its longest side


class Triangles(NamedTuple):
    """Every face laid flat by itself.

    Attributes
    ----------
    lengths : (E,) array
        Edge lengths [mm], none shorter than a millionth of their mean.
    laid : (F, 3) array
        With corner 0 at the origin and corner 1 at (laid[0], 0), corner 2 is at (laid[1], laid[2]) [mm]; laid[2] > 0.
    cotangents : (F, 3) array
        Of the angle that lies opposite the k-th edge.
    areas : (F,) array
        [mm^2], > 0.
    n_mended : int
        Faces that had no area to speak of, or broke the triangle inequality, and were given a small altitude.
    """

    lengths: Floats
    laid: Floats
    cotangents: Floats
    areas: Floats
    n_mended: int


def triangles(lengths: Floats, edges: Edges) -> Triangles:
    """Lay every face flat from the lengths of its edges.

    Parameters
    ----------
    lengths : (E,) array
        [mm], >= 0. Three that break the triangle inequality give a needle, not an error.
    edges : Edges
        Of the faces.
    """
    lengths = np.maximum(lengths, _SHORTEST * float(lengths.mean()))
    n_faces = len(edges.of_face)
    laid, cotangents, areas = np.empty((n_faces, 3)), np.empty((n_faces, 3)), np.empty(n_faces)
    n_mended = _lay(lengths, edges.of_face, laid, cotangents, areas)
    return Triangles(lengths, laid, cotangents, areas, n_mended)


@njit(cache=True)
def _lay(lengths: Floats, of_face: Indices, laid: Floats, cotangents: Floats, areas: Floats) -> int:
    n_mended = 0
    for f in range(len(of_face)):
        a, b, c = lengths[of_face[f, 0]], lengths[of_face[f, 1]], lengths[of_face[f, 2]]
        x = (a * a + c * c - b * b) / (2.0 * a)
        square = c * c - x * x
        least = _FLATTEST * max(a, b, c)
        if square < least * least:
            n_mended += 1
            square = least * least
            x = min(max(x, -c), a + b)
        y = np.sqrt(square)
        laid[f, 0], laid[f, 1], laid[f, 2] = a, x, y
        areas[f] = a * y / 2.0
        cotangents[f, 0] = (x * (x - a) + y * y) / (a * y)
        cotangents[f, 1] = x / y
        cotangents[f, 2] = (a - x) / y
    return n_mended


def bearings(shapes: Triangles, faces: Indices, edges: Edges, n_vertices: int) -> Floats:
    """Direction in which each edge leaves its two ends, in a frame of the vertex's own, (E, 2) [rad].

    Around an inner vertex the angles are scaled to sum to a full turn.
    """
    out = np.zeros((len(edges.ends), 2))
    _walk(shapes.laid, faces, edges.of_face, edges.opposite, edges.ends, n_vertices, out)
    return out


@njit(cache=True)
def _angle(laid: Floats, corner: int) -> float:
    """Angle of a face at a corner [rad]."""
    a, x, y = laid[corner // 3, 0], laid[corner // 3, 1], laid[corner // 3, 2]
    at_start, at_next = np.arctan2(y, x), np.arctan2(y, a - x)
    at_last = np.pi - at_start - at_next
    return float(at_start if corner % 3 == 0 else (at_next if corner % 3 == 1 else at_last))


@njit(cache=True)
def _walk(
    laid: Floats, faces: Indices, of_face: Indices, opposite: Indices, ends: Indices, n_vertices: int, out: Floats
) -> None:
    first = np.full(n_vertices, -1, dtype=np.int64)
    for half in range(3 * len(faces)):  # a fan starts at the border, if it has one
        vertex = faces[half // 3, half % 3]
        if first[vertex] < 0 or opposite[half] < 0:
            first[vertex] = half
    for vertex in range(n_vertices):
        total, half, closed = 0.0, first[vertex], True
        while True:
            total += _angle(laid, half)
            half = opposite[half - half % 3 + (half + 2) % 3]
            if half < 0:
                closed = False
                break
            if half == first[vertex]:
                break
        scale = 2.0 * np.pi / total if closed else 1.0
        bearing, half = 0.0, first[vertex]
        while True:
            edge = of_face[half // 3, half % 3]
            out[edge, 0 if ends[edge, 0] == vertex else 1] = bearing
            bearing += scale * _angle(laid, half)
            back = half - half % 3 + (half + 2) % 3
            half = opposite[back]
            if half < 0:
                edge = of_face[back // 3, back % 3]
                out[edge, 0 if ends[edge, 0] == vertex else 1] = bearing
                break
            if half == first[vertex]:
                break

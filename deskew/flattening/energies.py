"""Two energies of a sheet in the plane, as inputs of one solver: springs on the edges, and as-rigid-as-possible faces.

Both are a sum over edges (or sides of faces) of half a weight times |x_b - x_a - p|^2, where p is the vector that the
edge would like to be: of its rest length and any direction (springs), or turned with the whole face (as rigid as
possible). With the p fixed, the best x solves a Laplace system that never changes; with x fixed, the best p are found
one by one. Both Hessians are that Laplacian less one rank-one term an element, which is what Newton's method needs.

References
----------
Liu et al., A local/global approach to mesh parameterization, SGP 2008 (as rigid as possible, equation 9).
Liu et al., Fast simulation of mass-spring systems, ACM TOG 32(6), 2013 (springs by local and global steps).
Van Gelder, Approximate simulation of elastic membranes by triangulated spring meshes, J. Graphics Tools 3(2), 1998
(a spring's constant from area over squared length).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np
from numba import njit

from deskew.flattening.edges import Edges, Indices
from deskew.flattening.intrinsic import Triangles
from deskew.types import Floats


class Energy(Protocol):
    """What the solver asks of an energy; x is always (V, 2) [mm]."""

    @property
    def weights(self) -> Floats:
        """Weight of each edge in the Laplacian, (E,)."""

    def pull(self, x: Floats) -> Floats:
        """Right-hand side (V, 2) of the Laplace system for the best p at `x`."""

    def value(self, x: Floats) -> float:
        """Compute the energy at `x` [weight mm^2]."""

    def softening(self, x: Floats) -> tuple[Indices, Floats]:
        """Rank-one terms g g' that the Hessian at `x` lacks: the vertices (M, n) and g (M, n, 2) of each."""


class Springs(NamedTuple):
    """Springs on the edges: the sum of k / 2 (|x_b - x_a| - r)^2.

    Attributes
    ----------
    ends : (E, 2) int array
        Vertices that each spring joins.
    weights : (E,) array
        Constants k, > 0 [kg/s^2].
    rest : (E,) array
        Rest lengths r [mm].
    """

    ends: Indices
    weights: Floats
    rest: Floats

    def pull(self, x: Floats) -> Floats:
        """Sum at each vertex of k r times the direction that the spring has in `x`."""
        out = np.zeros_like(x)
        _pull_springs(x, self.ends, self.weights, self.rest, out)
        return out

    def value(self, x: Floats) -> float:
        """Sum of k / 2 (|x_b - x_a| - r)^2."""
        d = x[self.ends[:, 1]] - x[self.ends[:, 0]]
        return float(0.5 * (self.weights * (np.hypot(d[:, 0], d[:, 1]) - self.rest) ** 2).sum())

    def softening(self, x: Floats) -> tuple[Indices, Floats]:
        """Across a spring of length l the Hessian is k (1 - r / l), and 0 where that is negative."""
        d = x[self.ends[:, 1]] - x[self.ends[:, 0]]
        length = np.maximum(np.hypot(d[:, 0], d[:, 1]), 1e-300)
        size = np.sqrt(self.weights * np.minimum(self.rest / length, 1.0)) / length
        across = np.stack([-d[:, 1], d[:, 0]], axis=-1) * size[:, None]
        return self.ends, np.stack([-across, across], axis=1)


class RigidFaces(NamedTuple):
    """As rigid as possible: the sum over faces of w / 2 times the squared misfit of its sides to a turned copy.

    Attributes
    ----------
    faces : (F, 3) int array
        Corners.
    laid : (F, 3) array
        Each face laid flat by itself, as in `Triangles` [mm].
    sides : (F, 3) array
        Weight of each side of each face, half the cotangent of the angle opposite times the stiffness [kg/s^2].
    weights : (E,) array
        Sums of `sides` at each edge.
    """

    faces: Indices
    laid: Floats
    sides: Floats
    weights: Floats

    def pull(self, x: Floats) -> Floats:
        """Sum at each vertex of the sides of the best turned copies."""
        out = np.zeros_like(x)
        _pull_faces(x, self.faces, self.laid, self.sides, out)
        return out

    def value(self, x: Floats) -> float:
        """Sum over faces and their sides of w / 2 |x_b - x_a - R p|^2, R the best turn of the face."""
        return float(_value_faces(x, self.faces, self.laid, self.sides))

    def softening(self, x: Floats) -> tuple[Indices, Floats]:
        """Take away what a small turn of a face seems to cost; less than all where the face is compressed."""
        terms = np.empty((len(self.faces), 3, 2))
        _soften_faces(x, self.faces, self.laid, self.sides, terms)
        return self.faces, terms


def springs(shapes: Triangles, edges: Edges, stiffness: Floats) -> Springs:
    """Make an edge a spring with constant k = stiffness times area over squared length, summed over its faces.

    Such springs resist a uniform strain alike however the surface is cut into triangles, nearly (Van Gelder 1998).

    Parameters
    ----------
    shapes : Triangles
        The faces laid flat; the rest lengths are theirs.
    edges : Edges
        Of the faces.
    stiffness : (F,) array
        Of each face, > 0 [kg/s^2].
    """
    share = np.repeat(stiffness * shapes.areas, 3)
    k = np.bincount(edges.of_face.ravel(), share, len(edges.ends)) / shapes.lengths**2
    return Springs(edges.ends, k, shapes.lengths)


def rigid_faces(shapes: Triangles, faces: Indices, edges: Edges, stiffness: Floats) -> RigidFaces:
    """Make every face as rigid as possible, with its stiffness (F,) > 0 [kg/s^2]."""
    sides = 0.5 * stiffness[:, None] * shapes.cotangents
    weights = np.bincount(edges.of_face.ravel(), sides.ravel(), len(edges.ends)).astype(np.float64)
    return RigidFaces(faces, shapes.laid, sides, weights)


BuildEnergy = Callable[[Triangles, Indices, Edges, Floats], Energy]

ENERGIES: dict[str, BuildEnergy] = {
    "springs": lambda shapes, faces, edges, stiffness: springs(shapes, edges, stiffness),
    "arap": rigid_faces,
}


@njit(cache=True)
def _pull_springs(x: Floats, ends: Indices, k: Floats, rest: Floats, out: Floats) -> None:
    for e in range(len(ends)):
        a, b = ends[e, 0], ends[e, 1]
        dx, dy = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1]
        length = np.sqrt(dx * dx + dy * dy)
        if length > 0.0:
            force = k[e] * rest[e] / length
            out[a, 0] -= force * dx
            out[a, 1] -= force * dy
            out[b, 0] += force * dx
            out[b, 1] += force * dy


@njit(cache=True)
def _turn(x: Floats, face: Indices, laid: Floats, side: Floats) -> tuple[float, float]:
    """Sum of w p* dx over the sides, as complex numbers; its direction is the best turn of the face."""
    i, j, k = face[0], face[1], face[2]
    ax, ay = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1]
    cx, cy = x[i, 0] - x[k, 0], x[i, 1] - x[k, 1]
    bx, by = -ax - cx, -ay - cy
    a, px, py = laid[0], laid[1], laid[2]
    qx = px - a
    re = side[0] * a * ax + side[1] * (qx * bx + py * by) - side[2] * (px * cx + py * cy)
    im = side[0] * a * ay + side[1] * (qx * by - py * bx) - side[2] * (px * cy - py * cx)
    return re, im


@njit(cache=True)
def _pull_faces(x: Floats, faces: Indices, laid: Floats, sides: Floats, out: Floats) -> None:
    for f in range(len(faces)):
        re, im = _turn(x, faces[f], laid[f], sides[f])
        size = np.sqrt(re * re + im * im)
        if size == 0.0:
            continue
        c, s = re / size, im / size
        a, px, py = laid[f, 0], laid[f, 1], laid[f, 2]
        qx = px - a
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        w0, w1, w2 = sides[f, 0], sides[f, 1], sides[f, 2]
        ax, ay = w0 * c * a, w0 * s * a
        bx, by = w1 * (c * qx - s * py), w1 * (s * qx + c * py)
        cx, cy = -w2 * (c * px - s * py), -w2 * (s * px + c * py)
        out[i, 0] += cx - ax
        out[i, 1] += cy - ay
        out[j, 0] += ax - bx
        out[j, 1] += ay - by
        out[k, 0] += bx - cx
        out[k, 1] += by - cy


@njit(cache=True)
def _value_faces(x: Floats, faces: Indices, laid: Floats, sides: Floats) -> float:
    total = 0.0
    for f in range(len(faces)):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        re, im = _turn(x, faces[f], laid[f], sides[f])
        a, px, py = laid[f, 0], laid[f, 1], laid[f, 2]
        ab = (x[j, 0] - x[i, 0]) ** 2 + (x[j, 1] - x[i, 1]) ** 2 + a * a
        bc = (x[k, 0] - x[j, 0]) ** 2 + (x[k, 1] - x[j, 1]) ** 2 + (px - a) ** 2 + py * py
        ca = (x[i, 0] - x[k, 0]) ** 2 + (x[i, 1] - x[k, 1]) ** 2 + px * px + py * py
        squares = sides[f, 0] * ab + sides[f, 1] * bc + sides[f, 2] * ca
        total += 0.5 * squares - np.sqrt(re * re + im * im)
    return total


@njit(cache=True)
def _soften_faces(x: Floats, faces: Indices, laid: Floats, sides: Floats, terms: Floats) -> None:
    for f in range(len(faces)):
        re, im = _turn(x, faces[f], laid[f], sides[f])
        size = max(np.sqrt(re * re + im * im), 1e-300)
        c, s = re / size, im / size
        a, px, py = laid[f, 0], laid[f, 1], laid[f, 2]
        qx = px - a
        w0, w1, w2 = sides[f, 0], sides[f, 1], sides[f, 2]
        # With z(x) linear in x, the energy's last term is -|z|, whose Hessian is -t t' / |z|, t = grad(Im z) in the
        # turned frame. Bounded by the face at rest, where |z| is the sum of w p^2, the rest stays positive.
        at_rest = w0 * a * a + w1 * (qx * qx + py * py) + w2 * (px * px + py * py)
        scale = 1.0 / np.sqrt(max(size, at_rest))
        ax, ay = -s * w0 * a, c * w0 * a
        bx, by = -w1 * (s * qx + c * py), w1 * (c * qx - s * py)
        cx, cy = w2 * (s * px + c * py), -w2 * (c * px - s * py)
        terms[f, 0, 0], terms[f, 0, 1] = scale * (cx - ax), scale * (cy - ay)
        terms[f, 1, 0], terms[f, 1, 1] = scale * (ax - bx), scale * (ay - by)
        terms[f, 2, 0], terms[f, 2, 1] = scale * (bx - cx), scale * (by - cy)

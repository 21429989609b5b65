"""Geometric multigrid for the springs' Laplacian on a grid: the global step of the static solver.

Every spring of stiffness k between vertices a and b adds k (e_a - e_b)(e_a - e_b)^T to the matrix. With structural and
shear springs that is a nine-point stencil, which stays one on every coarser level (Galerkin, bilinear interpolation).
One V-cycle, a symmetric Gauss-Seidel sweep on the way down and one on the way up, stands for the matrix's inverse.

A level keeps its arrays in a frame of one empty vertex all around, so that no loop asks where the grid ends, and each
coordinate in an array of its own. Each vertex holds the weights of four of its springs: to the right, below, below
right and below left. A cycle only has to be about right, since the next one corrects it; so it is done in single
precision, which halves the memory that it has to move.

References
----------
Briggs, Henson, McCormick, A Multigrid Tutorial, 2nd ed., SIAM 2000, chapters 3 and 10 (Galerkin).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from deskew.flattening.relaxation import invert_diagonal, residual, sweep
from deskew.types import Array, Floats

# A level of at most this many vertices a side is solved by a dense inverse.
COARSEST = 5
RIGHT, DOWN, DOWN_RIGHT, DOWN_LEFT = range(4)


@dataclass(frozen=True, slots=True)
class Level:
    """One grid of the hierarchy, framed: (R + 2, C + 2) for R rows and C columns.

    Attributes
    ----------
    weights : (R + 2, C + 2, 4) array
        Stiffness of each vertex's springs to the right, below, below right and below left [kg/s^2].
    inverse : (R + 2, C + 2) array
        One over the diagonal; 0 in the frame and where no spring is.
    correction, force, left : (2, R + 2, C + 2) arrays
        Work: the correction x [mm], the right-hand side [mN] and its residual.
    """

    weights: Floats
    inverse: Floats
    correction: Floats
    force: Floats
    left: Floats

    @property
    def grid(self) -> tuple[int, int]:
        """Rows and columns without the frame."""
        return self.weights.shape[0] - 2, self.weights.shape[1] - 2


@dataclass(frozen=True, slots=True)
class Hierarchy:
    """Levels from fine to coarse, and the pseudo-inverse (n, n) of the coarsest one's matrix."""

    levels: tuple[Level, ...]
    coarsest_inverse: Floats


def coarse_size(n: int) -> int:
    """Vertices of the next coarser level along a side of `n`: every second one, and the last."""
    return n if n <= 3 else n // 2 + 1


def coarse_index(n: int) -> Array:
    """Which of `n` fine vertices the coarser level keeps."""
    return np.arange(n) if n <= 3 else np.append(np.arange(0, n - 1, 2), n - 1)


def hierarchy(k_s: Floats) -> Hierarchy:
    """Build all levels from the constants of the springs.

    Parameters
    ----------
    k_s : (4, R, C) array
        Spring constants by family, as in `Springs` [kg/s^2].
    """
    rows, columns = k_s.shape[1:]
    weights = np.zeros((rows + 2, columns + 2, 4))
    inside = weights[1:-1, 1:-1]
    inside[..., RIGHT], inside[..., DOWN], inside[..., DOWN_RIGHT] = k_s[0], k_s[1], k_s[2]
    inside[:, 1:, DOWN_LEFT] = k_s[3, :, :-1]
    levels = [_level(weights)]
    while (max(levels[-1].grid) > COARSEST and min(levels[-1].grid) > 3) or max(levels[-1].grid) > 16 * COARSEST:
        weights = _coarsened(weights)
        levels.append(_level(weights))
    return Hierarchy(tuple(levels), _dense_inverse(weights))


def _level(weights: Floats) -> Level:
    inverse = np.zeros(weights.shape[:2], np.float32)
    invert_diagonal(weights, inverse)
    correction, force, left = np.zeros((3, 2, *weights.shape[:2]), np.float32)
    return Level(weights.astype(np.float32), inverse, correction, force, left)


def _coarsened(weights: Floats) -> Floats:
    """Galerkin product P^T A P: columns are halved first, then rows."""
    rows, columns = weights.shape[0] - 2, weights.shape[1] - 2
    narrow = np.zeros((rows + 2, coarse_size(columns) + 2, 4))
    _halve_columns(weights, columns, narrow)
    # Turning rows into columns swaps right and down; below left becomes above right, the same spring seen from its
    # other end.
    turned = _transposed(narrow)
    low = np.zeros((turned.shape[0], coarse_size(rows) + 2, 4))
    _halve_columns(turned, rows, low)
    return _transposed(low)


def _transposed(weights: Floats) -> Floats:
    turned = np.zeros((weights.shape[1], weights.shape[0], 4))
    _transpose(weights, turned)
    return turned


def _dense_inverse(weights: Floats) -> Floats:
    rows, columns = weights.shape[0] - 2, weights.shape[1] - 2
    matrix = np.zeros((rows, columns, rows, columns))
    for family, (down, right) in enumerate(((0, 1), (1, 0), (1, 1), (1, -1))):
        for r in range(rows - down):
            for c in range(max(0, -right), columns - max(0, right)):
                k = weights[r + 1, c + 1, family]
                a, b = (r, c), (r + down, c + right)
                matrix[a + a] += k
                matrix[b + b] += k
                matrix[a + b] -= k
                matrix[b + a] -= k
    n = rows * columns
    return np.asarray(np.linalg.pinv(matrix.reshape(n, n), rcond=1e-10, hermitian=True))


@njit(cache=True)
def _transpose(weights, turned):  # type: ignore[no-untyped-def]
    for r in range(1, weights.shape[0] - 1):
        for c in range(1, weights.shape[1] - 1):
            turned[c, r, 0] = weights[r, c, 1]
            turned[c, r, 1] = weights[r, c, 0]
            turned[c, r, 2] = weights[r, c, 2]
            # Joins (r, c) and (r + 1, c - 1): turned, (c - 1, r + 1) and, below left of it, (c, r).
            if weights[r, c, 3] != 0.0:
                turned[c - 1, r + 1, 3] = weights[r, c, 3]


@njit(cache=True, inline="always")
def shares(c, columns):  # type: ignore[no-untyped-def]
    """Coarse columns that fine column c is interpolated from, and their shares."""
    if columns <= 3:
        return c, c, 1.0, 0.0
    if c == columns - 1:
        return columns // 2, columns // 2, 1.0, 0.0
    if c % 2 == 0:
        return c // 2, c // 2, 1.0, 0.0
    return c // 2, c // 2 + 1, 0.5, 0.5


@njit(cache=True)
def _halve_columns(weights, columns, coarse):  # type: ignore[no-untyped-def]
    """Galerkin product with linear interpolation along the rows.

    A spring k between a = sum p_i X_i and b = sum q_j X_j becomes k (p - q)(p - q)^T; as the shares of a and of b each
    sum to 1 this is again a set of springs, of stiffness -k (p - q)_i (p - q)_j.
    """
    first, second = np.empty(columns, np.int64), np.empty(columns, np.int64)
    share = np.empty(columns)
    for c in range(columns):
        first[c], second[c], _, share[c] = shares(c, columns)
    for r in range(1, weights.shape[0] - 1):
        for c in range(columns - 1):
            # One end is a coarse vertex, or both are: what is left is the spring between two neighbours.
            alone = share[c] == 0.0 and share[c + 1] == 0.0
            coarse[r, first[c] + 1, RIGHT] += weights[r, c + 1, RIGHT] * (1.0 if alone else 0.25)
        for c in range(columns):
            a, p = first[c] + 1, share[c]
            for family in range(1, 4):
                k = weights[r, c + 1, family]
                if k == 0.0:
                    continue
                other = c if family == DOWN else (c + 1 if family == DOWN_RIGHT else c - 1)
                b, q = first[other] + 1, share[other]
                _join_down(coarse, r, a, b, k * (1.0 - p) * (1.0 - q))
                if q != 0.0:
                    _join_down(coarse, r, a, b + 1, k * (1.0 - p) * q)
                    coarse[r + 1, b, RIGHT] -= k * q * (1.0 - q)
                if p != 0.0:
                    _join_down(coarse, r, a + 1, b, k * p * (1.0 - q))
                    coarse[r, a, RIGHT] -= k * p * (1.0 - p)
                    if q != 0.0:
                        _join_down(coarse, r, a + 1, b + 1, k * p * q)


@njit(cache=True, inline="always")
def _join_down(coarse, r, a, b, k):  # type: ignore[no-untyped-def]
    """Add a spring of stiffness k from column a of row r to column b, at most one away, of the row below."""
    coarse[r, a, DOWN if b == a else (DOWN_RIGHT if b > a else DOWN_LEFT)] += k


@njit(cache=True)
def _restrict(left, force):  # type: ignore[no-untyped-def]
    """Hand each fine residual to the coarse vertices that its vertex is interpolated from (P^T)."""
    rows, columns = left.shape[1] - 2, left.shape[2] - 2
    force[:] = 0.0
    for r in range(rows):
        y0, y1, p0, p1 = shares(r, rows)
        for c in range(columns):
            x0, x1, q0, q1 = shares(c, columns)
            for k in range(2):
                value = left[k, r + 1, c + 1]
                force[k, y0 + 1, x0 + 1] += p0 * q0 * value
                if q1 != 0.0:
                    force[k, y0 + 1, x1 + 1] += p0 * q1 * value
                if p1 != 0.0:
                    force[k, y1 + 1, x0 + 1] += p1 * q0 * value
                    if q1 != 0.0:
                        force[k, y1 + 1, x1 + 1] += p1 * q1 * value


@njit(cache=True)
def prolong(coarse, x):  # type: ignore[no-untyped-def]
    """Add a coarse correction, bilinear between coarse vertices (P); both framed."""
    rows, columns = x.shape[1] - 2, x.shape[2] - 2
    for r in range(rows):
        y0, y1, p0, p1 = shares(r, rows)
        for c in range(columns):
            x0, x1, q0, q1 = shares(c, columns)
            for k in range(2):
                x[k, r + 1, c + 1] += p0 * (q0 * coarse[k, y0 + 1, x0 + 1] + q1 * coarse[k, y0 + 1, x1 + 1]) + p1 * (
                    q0 * coarse[k, y1 + 1, x0 + 1] + q1 * coarse[k, y1 + 1, x1 + 1]
                )


@njit(cache=True)
def moved(places, correction, share):  # type: ignore[no-untyped-def]
    """Return places (2, R + 2, C + 2) moved by a share of a correction."""
    out = np.empty_like(places)
    for k in range(2):
        for r in range(places.shape[1]):
            for c in range(places.shape[2]):
                out[k, r, c] = places[k, r, c] + share * correction[k, r, c]
    return out


def framed(places: Floats) -> Floats:
    """Lay places (R, C, 2) out as the levels have them, (2, R + 2, C + 2)."""
    out = np.zeros((2, places.shape[0] + 2, places.shape[1] + 2))
    out[:, 1:-1, 1:-1] = np.moveaxis(places, -1, 0)
    return out


def unframed(places: Floats) -> Floats:
    """Return framed places as (R, C, 2)."""
    return np.ascontiguousarray(np.moveaxis(places[:, 1:-1, 1:-1], 0, -1))


def v_cycle(hierarchy: Hierarchy, at: int = 0) -> None:
    """Turn the `force` of level `at` into its `correction`, about A^-1 f, in place.

    Parameters
    ----------
    hierarchy : Hierarchy
        Its levels' work arrays are overwritten, from `at` downwards.
    at : int
        The level whose force is given.
    """
    level = hierarchy.levels[at]
    if at == len(hierarchy.levels) - 1:
        rows, columns = level.grid
        force = np.ascontiguousarray(level.force[:, 1:-1, 1:-1]).reshape(2, rows * columns)
        level.correction[:, 1:-1, 1:-1] = (force @ hierarchy.coarsest_inverse).reshape(2, rows, columns)
        return
    below = hierarchy.levels[at + 1]
    level.correction[:] = 0.0
    sweep(level.weights, level.inverse, level.correction, level.force, True)
    residual(level.weights, level.correction, level.force, level.left)
    _restrict(level.left, below.force)
    v_cycle(hierarchy, at + 1)
    prolong(below.correction, level.correction)
    sweep(level.weights, level.inverse, level.correction, level.force, False)

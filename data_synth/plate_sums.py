"""The sums over a grid behind :mod:`data_synth.plate`: energy, gradient, Hessian of membrane, plate and handles.

Unknown ``3 (p m + q) + component`` is that of vertex (p, q) of an (n, m) grid; the Hessian is kept as
``band[j, i - j]``, its entry of row i and column j <= i.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from deskew.types import Floats

POISSON = 0.3

# The four corners of a cell are its four triangles (each corner and its two neighbours), each with a quarter of the
# cell's area: both ways of cutting the cell at half weight, so that no diagonal is preferred.
_CORNERS = np.array([[0, 0], [0, 1], [1, 0], [1, 1]])


@njit(cache=True)
def _stress(e0: Floats, e1: Floats, a: float, b: float) -> tuple[float, float, float, float]:
    """Second Piola-Kirchhoff stress (S00, S11, S01) of edges e0, e1 of rest lengths a, b, and the energy density."""
    E00 = 0.5 * ((e0[0] ** 2 + e0[1] ** 2 + e0[2] ** 2) / (a * a) - 1.0)
    E11 = 0.5 * ((e1[0] ** 2 + e1[1] ** 2 + e1[2] ** 2) / (b * b) - 1.0)
    E01 = 0.5 * (e0[0] * e1[0] + e0[1] * e1[1] + e0[2] * e1[2]) / (a * b)
    S00 = E00 + POISSON * E11
    S11 = E11 + POISSON * E00
    S01 = (1.0 - POISSON) * E01
    return S00, S11, S01, 0.5 * (S00 * E00 + S11 * E11) + S01 * E01


@njit(cache=True)
def _clamped(S00: float, S11: float, S01: float) -> tuple[float, float, float]:
    """Nearest positive semidefinite stress."""
    mean, half = 0.5 * (S00 + S11), 0.5 * (S00 - S11)
    radius = np.sqrt(half * half + S01 * S01)
    if mean - radius >= 0.0:
        return S00, S11, S01
    top = mean + radius
    if top <= 0.0 or radius == 0.0:
        return 0.0, 0.0, 0.0
    # top times the projector on its eigenvector
    c, s = half / radius, S01 / radius
    return 0.5 * top * (1.0 + c), 0.5 * top * (1.0 - c), 0.5 * top * s


@njit(cache=True)
def total_energy(
    x: Floats,
    a: float,
    b: float,
    bending: float,
    along: Floats,
    across: Floats,
    twist: Floats,
    at_vertex: Floats,
    at_cell: Floats,
    pull: Floats,
    heights: Floats,
    growth: Floats,
) -> float:
    """Sum the energies of membrane, plate and handles [mm^2]; the arguments are those of `data_synth.plate.Plate`."""
    n, m = x.shape[:2]
    total = 0.0
    for p in range(n):
        for q in range(m):
            total += 0.5 * pull[p, q] * (x[p, q, 2] - heights[p, q]) ** 2
            area = a * b * (0.5 if p in (0, n - 1) else 1.0) * (0.5 if q in (0, m - 1) else 1.0)
            for c in range(3):
                if 0 < p < n - 1:
                    k = (x[p - 1, q, c] - 2 * x[p, q, c] + x[p + 1, q, c]) / (a * a) - along[p, q] * at_vertex[p, q, c]
                    total += 0.5 * bending * area * k * k
                if 0 < q < m - 1:
                    k = (x[p, q - 1, c] - 2 * x[p, q, c] + x[p, q + 1, c]) / (b * b) - across[p, q] * at_vertex[p, q, c]
                    total += 0.5 * bending * area * k * k
                if p < n - 1 and q < m - 1:
                    k = (x[p + 1, q + 1, c] - x[p + 1, q, c] - x[p, q + 1, c] + x[p, q, c]) / (a * b)
                    k -= twist[p, q] * at_cell[p, q, c]
                    total += bending * a * b * k * k
            if p < n - 1 and q < m - 1:
                long, wide = growth[p, q] * a, growth[p, q] * b
                for corner in range(4):
                    i, j = _CORNERS[corner, 0], _CORNERS[corner, 1]
                    e0 = x[p + 1, q + j] - x[p, q + j]
                    e1 = x[p + i, q + 1] - x[p + i, q]
                    total += 0.25 * long * wide * _stress(e0, e1, long, wide)[3]
    return total


@njit(cache=True)
def add_membrane(x: Floats, a: float, b: float, growth: Floats, gradient: Floats, band: Floats) -> None:
    """Add the membrane's gradient and Hessian; a cell's rest lengths are its growth times a and b."""
    n, m = x.shape[:2]
    e0, e1 = np.empty(3), np.empty(3)
    K = np.empty((6, 6))
    f = np.empty(6)
    at = np.empty(4, dtype=np.int64)
    for p in range(n - 1):
        for q in range(m - 1):
            long, wide = growth[p, q] * a, growth[p, q] * b
            for corner in range(4):
                i, j = _CORNERS[corner, 0], _CORNERS[corner, 1]
                # e0 = x[at[1]] - x[at[0]], e1 = x[at[3]] - x[at[2]]
                at[0], at[1] = p * m + q + j, (p + 1) * m + q + j
                at[2], at[3] = (p + i) * m + q, (p + i) * m + q + 1
                for c in range(3):
                    e0[c] = x[p + 1, q + j, c] - x[p, q + j, c]
                    e1[c] = x[p + i, q + 1, c] - x[p + i, q, c]
                _element(e0, e1, long, wide, 0.25 * long * wide, f, K)
                _scatter(f, K, at, gradient, band)


@njit(cache=True)
def _element(e0: Floats, e1: Floats, a: float, b: float, weight: float, f: Floats, K: Floats) -> None:
    """Gradient f (6,) and Hessian K (6, 6) of one triangle's energy by its edge vectors (e0, e1)."""
    S00, S11, S01, _ = _stress(e0, e1, a, b)
    P00, P11, P01 = _clamped(S00, S11, S01)
    for c in range(3):
        u, v = e0[c] / a, e1[c] / b
        f[c] = weight * (S00 * u + S01 * v) / a
        f[3 + c] = weight * (S11 * v + S01 * u) / b
    for c in range(3):
        for d in range(3):
            u, v, s, t = e0[c] / a, e1[c] / b, e0[d] / a, e1[d] / b
            same = 1.0 if c == d else 0.0
            shear = 0.5 * (1.0 - POISSON)
            K[c, d] = weight * (u * s + shear * v * t + same * P00) / (a * a)
            K[3 + c, 3 + d] = weight * (v * t + shear * u * s + same * P11) / (b * b)
            K[c, 3 + d] = weight * (POISSON * u * t + shear * v * s + same * P01) / (a * b)
            K[3 + d, c] = K[c, 3 + d]


@njit(cache=True)
def _scatter(f: Floats, K: Floats, at: Floats, gradient: Floats, band: Floats) -> None:
    """Add a triangle's gradient and Hessian by edges to those by vertices; edge k runs from at[2k] to at[2k + 1]."""
    for k in range(2):
        for end in range(2):
            sign = 1.0 if end == 1 else -1.0
            row = 3 * at[2 * k + end]
            for c in range(3):
                gradient[row + c] += sign * f[3 * k + c]
            for other in range(2):
                for far in range(2):
                    column = 3 * at[2 * other + far]
                    factor = sign * (1.0 if far == 1 else -1.0)
                    for c in range(3):
                        for d in range(3):
                            offset = row + c - column - d
                            if offset >= 0:
                                band[column + d, offset] += factor * K[3 * k + c, 3 * other + d]


@njit(cache=True)
def add_bending(
    x: Floats,
    a: float,
    b: float,
    bending: float,
    along: Floats,
    across: Floats,
    twist: Floats,
    at_vertex: Floats,
    at_cell: Floats,
    gradient: Floats,
    band: Floats,
) -> None:
    """Add the thin plate's gradient and Hessian."""
    n, m = x.shape[:2]
    at = np.empty(4, dtype=np.int64)
    three = np.array([1.0, -2.0, 1.0])
    four = np.array([1.0, -1.0, -1.0, 1.0]) / (a * b)
    for p in range(n):
        for q in range(m):
            v = p * m + q
            area = a * b * (0.5 if p in (0, n - 1) else 1.0) * (0.5 if q in (0, m - 1) else 1.0)
            if 0 < p < n - 1:
                at[0], at[1], at[2] = v - m, v, v + m
                _plate(x, at, three / (a * a), along[p, q], at_vertex[p, q], bending * area, gradient, band)
            if 0 < q < m - 1:
                at[0], at[1], at[2] = v - 1, v, v + 1
                _plate(x, at, three / (b * b), across[p, q], at_vertex[p, q], bending * area, gradient, band)
            if p < n - 1 and q < m - 1:
                at[0], at[1], at[2], at[3] = v, v + 1, v + m, v + m + 1
                _plate(x, at, four, twist[p, q], at_cell[p, q], 2 * bending * a * b, gradient, band)


@njit(cache=True)
def _plate(
    x: Floats, at: Floats, stencil: Floats, rest: float, normal: Floats, weight: float, gradient: Floats, band: Floats
) -> None:
    """Add ``weight / 2 |stencil . x - rest normal|^2``."""
    m = x.shape[1]
    for c in range(3):
        k = -rest * normal[c]
        for i in range(len(stencil)):
            k += stencil[i] * x[at[i] // m, at[i] % m, c]
        for i in range(len(stencil)):
            gradient[3 * at[i] + c] += weight * stencil[i] * k
            for j in range(len(stencil)):
                if at[i] >= at[j]:
                    band[3 * at[j] + c, 3 * (at[i] - at[j])] += weight * stencil[i] * stencil[j]


@njit(cache=True)
def add_pull(x: Floats, pull: Floats, heights: Floats, gradient: Floats, band: Floats) -> None:
    """Add the springs that hold vertices at heights."""
    n, m = x.shape[:2]
    for p in range(n):
        for q in range(m):
            height = 3 * (p * m + q) + 2
            gradient[height] += pull[p, q] * (x[p, q, 2] - heights[p, q])
            band[height, 0] += pull[p, q]

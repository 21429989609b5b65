"""Gauss-Seidel sweeps on a level of the multigrid hierarchy, and what they leave.

Arrays are framed and weights laid out as in `multigrid`: (R + 2, C + 2, 4) weights [kg/s^2], (R + 2, C + 2, 2)
corrections x [mm] and forces f [mN].
"""

from __future__ import annotations

from numba import njit


@njit(cache=True)
def invert_diagonal(weights, inverse):  # type: ignore[no-untyped-def]
    """Write one over the sum of the springs at each vertex into `inverse`, 0 where there is none."""
    for r in range(1, weights.shape[0] - 1):
        for c in range(1, weights.shape[1] - 1):
            total = (
                weights[r, c, 0] + weights[r, c, 1] + weights[r, c, 2] + weights[r, c, 3]
                + weights[r, c - 1, 0] + weights[r - 1, c, 1] + weights[r - 1, c - 1, 2] + weights[r - 1, c + 1, 3]
            )  # fmt: skip
            inverse[r, c] = 1.0 / total if total > 0.0 else 0.0


@njit(cache=True, inline="always")
def _relax(weights, inverse, x, f, r, c):  # type: ignore[no-untyped-def]
    """Give vertex (r, c) the place that its neighbours and its force ask for."""
    w0, w1, w2, w3 = weights[r, c, 0], weights[r, c, 1], weights[r, c, 2], weights[r, c, 3]
    w4, w5 = weights[r, c - 1, 0], weights[r - 1, c, 1]
    w6, w7 = weights[r - 1, c - 1, 2], weights[r - 1, c + 1, 3]
    d = inverse[r, c]
    for k in range(2):
        x[r, c, k] = d * (
            f[r, c, k]
            + w0 * x[r, c + 1, k] + w1 * x[r + 1, c, k] + w2 * x[r + 1, c + 1, k] + w3 * x[r + 1, c - 1, k]
            + w5 * x[r - 1, c, k] + w6 * x[r - 1, c - 1, k] + w7 * x[r - 1, c + 1, k]
            + w4 * x[r, c - 1, k]
        )  # fmt: skip


@njit(cache=True)
def sweep(weights, inverse, x, f, forward):  # type: ignore[no-untyped-def]
    """Relax all vertices of x in place, in their order or backwards."""
    rows, columns = x.shape[0] - 2, x.shape[1] - 2
    if forward:
        for r in range(1, rows + 1):
            for c in range(1, columns + 1):
                _relax(weights, inverse, x, f, r, c)
    else:
        for r in range(rows, 0, -1):
            for c in range(columns, 0, -1):
                _relax(weights, inverse, x, f, r, c)


@njit(cache=True)
def residual(weights, x, f, left):  # type: ignore[no-untyped-def]
    """Write what the correction x leaves of the force f, f - A x, into `left`."""
    for r in range(1, x.shape[0] - 1):
        for c in range(1, x.shape[1] - 1):
            w0, w1, w2, w3 = weights[r, c, 0], weights[r, c, 1], weights[r, c, 2], weights[r, c, 3]
            w4, w5 = weights[r, c - 1, 0], weights[r - 1, c, 1]
            w6, w7 = weights[r - 1, c - 1, 2], weights[r - 1, c + 1, 3]
            total = w0 + w1 + w2 + w3 + w4 + w5 + w6 + w7
            for k in range(2):
                left[r, c, k] = f[r, c, k] - total * x[r, c, k] + (
                    w0 * x[r, c + 1, k] + w1 * x[r + 1, c, k] + w2 * x[r + 1, c + 1, k] + w3 * x[r + 1, c - 1, k]
                    + w4 * x[r, c - 1, k] + w5 * x[r - 1, c, k] + w6 * x[r - 1, c - 1, k] + w7 * x[r - 1, c + 1, k]
                )  # fmt: skip

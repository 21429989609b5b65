"""Gauss-Seidel sweeps on a level of the multigrid hierarchy, and what they leave.

Arrays are framed and weights laid out as in `multigrid`: (R + 2, C + 2, 4) weights [kg/s^2], (2, R + 2, C + 2)
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


@njit(cache=True)
def sweep(weights, inverse, x, f, forward):  # type: ignore[no-untyped-def]
    """Give every vertex in turn the place that its neighbours and its force ask for."""
    rows, columns = x.shape[1] - 2, x.shape[2] - 2
    for row in range(rows):
        r = row + 1 if forward else rows - row
        for column in range(columns):
            c = column + 1 if forward else columns - column
            w0, w1, w2, w3 = weights[r, c, 0], weights[r, c, 1], weights[r, c, 2], weights[r, c, 3]
            w4, w5 = weights[r, c - 1, 0], weights[r - 1, c, 1]
            w6, w7 = weights[r - 1, c - 1, 2], weights[r - 1, c + 1, 3]
            # The neighbour that was just moved comes last: everything else can be summed while it is.
            last, next_, before = (w4, w0, c - 1) if forward else (w0, w4, c + 1)
            after = c + 1 if forward else c - 1
            d = inverse[r, c]
            for k in range(2):
                others = (
                    f[k, r, c] + next_ * x[k, r, after]
                    + w1 * x[k, r + 1, c] + w2 * x[k, r + 1, c + 1] + w3 * x[k, r + 1, c - 1]
                    + w5 * x[k, r - 1, c] + w6 * x[k, r - 1, c - 1] + w7 * x[k, r - 1, c + 1]
                )  # fmt: skip
                x[k, r, c] = d * others + (d * last) * x[k, r, before]


@njit(cache=True)
def residual(weights, x, f, left):  # type: ignore[no-untyped-def]
    """Write what the correction x leaves of the force f, f - A x, into `left`."""
    for r in range(1, x.shape[1] - 1):
        for c in range(1, x.shape[2] - 1):
            w0, w1, w2, w3 = weights[r, c, 0], weights[r, c, 1], weights[r, c, 2], weights[r, c, 3]
            w4, w5 = weights[r, c - 1, 0], weights[r - 1, c, 1]
            w6, w7 = weights[r - 1, c - 1, 2], weights[r - 1, c + 1, 3]
            total = w0 + w1 + w2 + w3 + w4 + w5 + w6 + w7
            for k in range(2):
                left[k, r, c] = f[k, r, c] - total * x[k, r, c] + (
                    w0 * x[k, r, c + 1] + w1 * x[k, r + 1, c] + w2 * x[k, r + 1, c + 1] + w3 * x[k, r + 1, c - 1]
                    + w4 * x[k, r, c - 1] + w5 * x[k, r - 1, c] + w6 * x[k, r - 1, c - 1] + w7 * x[k, r - 1, c + 1]
                )  # fmt: skip

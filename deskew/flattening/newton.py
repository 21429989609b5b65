"""Newton's method on the springs' energy in the plane: for stiffnesses that differ strongly, and for more springs.

A spring of length l at rest at r adds k [n n^T + max(0, 1 - r / l) (I - n n^T)] to the matrix, n its direction: the
energy's second derivative without what would make it indefinite. Steps are halved until the energy falls.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from deskew.flattening.anderson import Iterated
from deskew.types import Floats

# A sheet may be moved and turned freely, and so may each piece of a cut one: this share of the mean stiffness holds it.
_RIDGE = 1e-9
_HALVINGS = 30

Indices = npt.NDArray[np.intp]


class SpringList(NamedTuple):
    """Springs one by one: ends a and b, (S,) indices; rest lengths [mm] and constants [kg/s^2], (S,)."""

    a: Indices
    b: Indices
    rest: Floats
    k_s: Floats


def energy(x: Floats, springs: SpringList) -> float:
    """Energy of the springs, sum of k (l - r)^2 / 2 [uJ], at places x (V, 2) [mm]."""
    d = x[springs.b] - x[springs.a]
    return float((springs.k_s * (np.sqrt((d * d).sum(axis=1)) - springs.rest) ** 2).sum() / 2)


def minimise(x: Floats, springs: SpringList, tolerance: float, max_iterations: int) -> Iterated:
    """Bring the springs to rest.

    Parameters
    ----------
    x : (V, 2) array
        Start [mm].
    springs : SpringList
        All springs.
    tolerance : float
        Largest change of a coordinate in one step that counts as none [mm].
    max_iterations : int
        Steps after which to give up, each one factorisation.
    """
    least = energy(x, springs)
    largest = np.inf
    for n in range(1, max_iterations + 1):
        step = _step(x, springs)
        largest = float(np.abs(step).max())
        if not np.isfinite(largest):
            return Iterated(x, n, largest, False)
        share = 1.0
        for _ in range(_HALVINGS):
            trial = energy(x + share * step, springs)
            if trial <= least:
                break
            share /= 2
        else:
            # No shorter step lowers the energy: it is at its least to the last digit.
            return Iterated(x, n, largest, largest <= 1e3 * tolerance)
        x, least = x + share * step, trial
        if largest <= tolerance:
            return Iterated(x, n, largest, True)
    return Iterated(x, max_iterations, largest, False)


def _step(x: Floats, springs: SpringList) -> Floats:
    """Solve the Newton system, (V, 2) [mm]."""
    a, b, rest, k = springs
    d = x[b] - x[a]
    length = np.sqrt((d * d).sum(axis=1))
    n = d / length[:, None]
    force = (k * (length - rest))[:, None] * n
    gradient = np.stack(
        [np.bincount(b, force[:, axis], len(x)) - np.bincount(a, force[:, axis], len(x)) for axis in range(2)],
        axis=1,
    )
    across = np.maximum(0.0, 1.0 - rest / length)
    xx = k * (n[:, 0] ** 2 + across * n[:, 1] ** 2)
    yy = k * (n[:, 1] ** 2 + across * n[:, 0] ** 2)
    xy = k * (1.0 - across) * n[:, 0] * n[:, 1]
    matrix = _assembled(a, b, (xx, xy, yy), len(x))
    ridge = _RIDGE * float(k.mean())
    factor = splu(
        (matrix + ridge * sp.identity(2 * len(x), format="csc")).tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    return np.asarray(-factor.solve(gradient.ravel()).reshape(-1, 2))


def _assembled(a: Indices, b: Indices, blocks: tuple[Floats, Floats, Floats], n: int) -> sp.csc_matrix:
    """Sum the springs' 4 x 4 matrices; coordinates of a vertex follow each other."""
    xx, xy, yy = blocks
    rows, columns, values = [], [], []
    for i, j, sign in ((a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)):
        for p, q, value in ((0, 0, xx), (0, 1, xy), (1, 0, xy), (1, 1, yy)):
            rows.append(2 * i + p)
            columns.append(2 * j + q)
            values.append(sign * value)
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return sp.coo_matrix(entries, shape=(2 * n, 2 * n)).tocsc()

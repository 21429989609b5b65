"""Lengths of a grid's springs as straight chords: the paper's rest lengths (section 3.4)."""

from __future__ import annotations

import numpy as np
from numba import njit

from deskew.types import Floats


def chord_lengths(vertices: Floats) -> Floats:
    """Length of every spring of a grid as the straight chord between its ends.

    A chord is shorter than the paper it spans wherever the surface bends between two samples: this, not the
    integration, is the largest error of the paper's method.

    Parameters
    ----------
    vertices : (R, C, 3) array
        Positions [mm].

    Returns
    -------
    (4, R, C) array
        Lengths [mm], by family, 0 where there is no spring.
    """
    lengths = np.zeros((4, *vertices.shape[:2]))
    _measure_chords(np.ascontiguousarray(vertices, dtype=np.float64), lengths)
    return lengths


@njit(cache=True)
def _measure_chords(vertices, lengths):  # type: ignore[no-untyped-def]
    rows, columns = lengths.shape[1], lengths.shape[2]
    for family in range(4):
        # Tails and heads of the four families, spelled out for the compiler.
        i, p, q = (1 if family == 3 else 0), (1 if family == 1 or family == 2 else 0), (0 if family == 1 else 1)
        for r in range(rows - max(i, p)):
            for c in range(columns - q):
                dx = vertices[r + p, c + q, 0] - vertices[r + i, c, 0]
                dy = vertices[r + p, c + q, 1] - vertices[r + i, c, 1]
                dz = vertices[r + p, c + q, 2] - vertices[r + i, c, 2]
                # Written as the force pass writes it, so that an unmoved spring exerts exactly no force.
                lengths[family, r, c] = np.sqrt(dx * dx + dy * dy + dz * dz)

"""A grid on coarser and coarser levels, for a start of the static solver that is nearly right everywhere.

A coarse spring is as long as the two that it spans, so that even the coarsest level knows the arc lengths of the
finest; and a vertex between two coarse ones divides their distance as the springs to them do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from deskew.flattening.chords import chord_lengths
from deskew.flattening.multigrid import coarse_index, shares
from deskew.flattening.springs import spring_constants
from deskew.types import Floats

# Stiffness of a quad of half the width.
_SHORT = 0.5


@dataclass(frozen=True, slots=True)
class Grid:
    """One level.

    Attributes
    ----------
    rest : (4, R, C) array
        Rest lengths by family, as in `Springs` [mm].
    k_s : (4, R, C) array
        Spring constants by family: 1, and less at the end of a side whose last step is short, which the multigrid
        cycle's own matrices hold more softly too [kg/s^2].
    vertices : (R, C, 3) array
        Vertices [mm].
    short : (bool, bool)
        Whether the last step down and the last step across span less of the finest grid than the others.
    """

    rest: Floats
    k_s: Floats
    vertices: Floats
    short: tuple[bool, bool] = (False, False)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.rest.shape[1], self.rest.shape[2]


def pyramid(rest: Floats, vertices: Floats, n_levels: int) -> list[Grid]:
    """Build levels from fine to coarse out of lengths (4, R, C) and vertices (R, C, 3) [mm]."""
    grids = [Grid(rest, spring_constants((rest.shape[1], rest.shape[2]), 1.0), vertices)]
    while len(grids) < n_levels:
        grids.append(_coarser(grids[-1]))
    return grids


def _coarser(fine: Grid) -> Grid:
    rows, columns = (coarse_index(n) for n in fine.shape)
    vertices = np.ascontiguousarray(fine.vertices[np.ix_(rows, columns)])
    chords = chord_lengths(vertices)
    rest = np.zeros_like(chords)
    rest[0, :, :-1] = np.add.reduceat(fine.rest[0][rows, :-1], columns[:-1], axis=1)
    rest[1, :-1, :] = np.add.reduceat(fine.rest[1][:-1, columns], rows[:-1], axis=0)
    rest[2:, :-1, :-1] = _diagonals(chords, rest)
    # A side of an even number of vertices ends in a short step, here or on the next level: no two fine diagonals span
    # that quad, or two that do not follow each other straight. Nor do they where one side is too short to be halved.
    halved = len(rows) < fine.shape[0], len(columns) < fine.shape[1]
    short = (
        fine.short[0] or (halved[0] and rows[-1] - rows[-2] == 1),
        fine.short[1] or (halved[1] and columns[-1] - columns[-2] == 1),
    )
    r, c = len(rows) - 1 - short[0], len(columns) - 1 - short[1]
    if all(halved):
        falling, rising = fine.rest[2], fine.rest[3]
        rest[2, :r, :c] = falling[0 : 2 * r : 2, 0 : 2 * c : 2] + falling[1 : 2 * r : 2, 1 : 2 * c : 2]
        rest[3, :r, :c] = rising[1 : 2 * r : 2, 0 : 2 * c : 2] + rising[0 : 2 * r : 2, 1 : 2 * c : 2]
    quads = np.ones((len(rows) - 1, len(columns) - 1))
    quads[r:] *= _SHORT
    quads[:, c:] *= _SHORT
    return Grid(rest, spring_constants((len(rows), len(columns)), 1.0, quads), vertices, short)


def _diagonals(chords: Floats, rest: Floats) -> Floats:
    """Diagonals (2, R - 1, C - 1) of quads with sides as long as `rest` says, at the angles that their chords have."""

    def sides(lengths: Floats) -> tuple[Floats, Floats]:
        across, down = lengths[0, :, :-1], lengths[1, :-1, :]
        return (across[:-1] + across[1:]) / 2, (down[:, :-1] + down[:, 1:]) / 2

    (a, b), (p, q) = sides(chords), sides(rest)
    cosines = (chords[2:, :-1, :-1] ** 2 - a**2 - b**2) / np.maximum(a * b, 1e-300)
    return np.asarray(np.sqrt(np.maximum(p**2 + q**2 + cosines * p * q, 1e-300)))


def refined(coarse: Floats, fine: Grid) -> Floats:
    """Lay the vertices of a level down between those of the next coarser one.

    Parameters
    ----------
    coarse : (2, r + 2, c + 2) array
        Places of the coarse vertices, framed [mm].
    fine : Grid
        The finer level.

    Returns
    -------
    (2, R + 2, C + 2) array
        Framed places [mm].
    """
    rows, columns = fine.shape
    out = np.zeros((2, rows + 2, columns + 2))
    _refine(coarse, fine.rest, out)
    return out


@njit(cache=True)
def _refine(coarse, rest, out):  # type: ignore[no-untyped-def]
    rows, columns = rest.shape[1], rest.shape[2]
    # First along the rows that both levels have, then down the columns.
    for r in range(rows):
        y, _, _, split = shares(r, rows)
        if split != 0.0:
            continue
        for c in range(columns):
            x0, x1, _, between = shares(c, columns)
            share = rest[0, r, c - 1] / (rest[0, r, c - 1] + rest[0, r, c]) if between != 0.0 else 0.0
            for k in range(2):
                a, b = coarse[k, y + 1, x0 + 1], coarse[k, y + 1, x1 + 1]
                out[k, r + 1, c + 1] = a + share * (b - a)
    for r in range(rows):
        if shares(r, rows)[3] == 0.0:
            continue
        for c in range(columns):
            share = rest[1, r - 1, c] / (rest[1, r - 1, c] + rest[1, r, c])
            for k in range(2):
                a, b = out[k, r, c + 1], out[k, r + 2, c + 1]
                out[k, r + 1, c + 1] = a + share * (b - a)

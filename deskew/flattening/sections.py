"""Lengths of a grid's springs along the surface between their ends, with what samples cut off at creases given back.

A chord that crosses a crease cuts it off, wherever its samples happen to lie: on average by a length in proportion to
their step h, and a crease that the surface itself rounds over a width w by as much as a step longer by w would. So the
arc L(h), followed in steps of h, is extended to the step -w along the line through L(k h) and L(h).

Noise has the opposite law: it lengthens the arc the more, the shorter the steps. How much longer each refinement makes
the whole sheet, per step saved, tells the two apart: about the same each time with creases, less and less on smooth
bends, eight times as much at every halving with noise. The shortest steps are taken at which it is still so.
"""

from __future__ import annotations

import numpy as np

from deskew.flattening.chords import chord_lengths
from deskew.types import Floats

# A refinement may add this much more per step saved than the one before: creases add about the same, noise eight times,
# and the small steps that a real Gray code leaves twice as much.
_CREASED = 1.6


def section_lengths(surface: Floats, n: int) -> Floats:
    """Length of every spring of a grid as the arc that the surface takes between its ends.

    The arc is followed along the finer samples: along their rows, their columns and their diagonals.

    Parameters
    ----------
    surface : ((R - 1) n + 1, (C - 1) n + 1, 3) array
        The surface, n steps to one of the grid [mm].
    n : int
        Steps of the surface between two neighbours of the grid.

    Returns
    -------
    (4, R, C) array
        Lengths [mm], by family, 0 where there is no spring.
    """
    fine = chord_lengths(surface)
    rows, columns = (surface.shape[0] - 1) // n + 1, (surface.shape[1] - 1) // n + 1
    lengths = np.zeros((4, rows, columns))
    for step in range(n):
        lengths[0, :, :-1] += fine[0, ::n, step::n][:, : columns - 1]
        lengths[1, :-1, :] += fine[1, step::n, ::n][: rows - 1]
        lengths[2, :-1, :-1] += fine[2, step::n, step::n][: rows - 1, : columns - 1]
        lengths[3, :-1, :-1] += fine[3, n - 1 - step :: n, step::n][: rows - 1, : columns - 1]
    return lengths


def unfolded_lengths(surface: Floats, n: int, crease_width: float = 0.0) -> Floats:
    """Length of every spring of a grid along the surface, as if no sample cut a crease off.

    Parameters
    ----------
    surface : ((R - 1) n + 1, (C - 1) n + 1, 3) array
        The surface [mm].
    n : int
        Steps of the surface between two neighbours of the grid, at least 2.
    crease_width : float
        w / h, as in `Sheet`.

    Returns
    -------
    (4, R, C) array
        Lengths [mm], by family, 0 where there is no spring: plain chords where even the first refinement adds noise.
    """
    steps = _halved(n)
    arcs = [chord_lengths(surface[::n, ::n])]
    arcs += [section_lengths(np.ascontiguousarray(surface[::k, ::k]), n // k) for k in steps[1:]]
    slopes = [_slope_of_grid(surface[::n, ::n], n)]
    for i in range(1, len(steps)):
        slopes.append((_total(arcs[i]) - _total(arcs[i - 1])) / (steps[i - 1] - steps[i]))
    creased = [True] + [slopes[i] <= _CREASED * slopes[i - 1] for i in range(1, len(steps))]
    # Noise shows in the finest steps, folds closer than the coarse ones in those: two refinements in a row decide.
    best = next((i for i in range(len(steps) - 1, 0, -1) if creased[i] and creased[i - 1]), 0)
    if best == 0:
        return arcs[0]
    step, saved = steps[best], steps[best - 1] - steps[best]
    return np.asarray(arcs[best] + (step + crease_width) / saved * (arcs[best] - arcs[best - 1]))


def _halved(n: int) -> list[int]:
    """Return steps from n down to 1, each the one before by its smallest divisor."""
    steps = [n]
    while steps[-1] > 1:
        step = steps[-1]
        steps.append(step // next(k for k in range(2, step + 1) if step % k == 0))
    return steps


def _total(lengths: Floats) -> float:
    """Length of all structural springs [mm]."""
    return float(lengths[:2].sum())


def _slope_of_grid(vertices: Floats, n: int) -> float:
    """Return what the grid's own steps add to steps twice as long, per step of the surface saved [mm].

    Infinite, so that nothing is refused, if the grid is too small to tell.
    """
    rows, columns = (2 * ((size - 1) // 2) + 1 for size in vertices.shape[:2])
    if min(rows, columns) < 3:
        return np.inf
    even = vertices[:rows, :columns]
    once = np.linalg.norm(np.diff(even, axis=1), axis=-1).sum() + np.linalg.norm(np.diff(even, axis=0), axis=-1).sum()
    across, down = np.diff(even[:, ::2], axis=1), np.diff(even[::2], axis=0)
    twice = np.linalg.norm(across, axis=-1).sum() + np.linalg.norm(down, axis=-1).sum()
    return float(once - twice) / n

"""A sheet of two materials, one of which has changed its size: the soft one gets one free scale, and a soft seam.

Springs of a material that shrank or grew all want the wrong length, by about the same factor. However soft they are,
they pull at the one that kept its size; with the factor free they do not, and the factor says how much they changed.
Where the two meet the change begins gradually, so no spring there is trusted more than the soft material's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from deskew.errors import require
from deskew.flattening.anderson import Iterated
from deskew.flattening.chords import chord_lengths
from deskew.flattening.springs import HEADS, TAILS, Springs
from deskew.types import Floats, Sheet

SEAM_MM = 8.0
"""Springs nearer to the seam are as soft as the soft material, and do not say how much it changed [mm]."""

_MOST_SOLVES = 30
_SCALES = 0.5, 2.0  # beyond these no material has changed: the map is wrong, or the sheet

Settle = Callable[[Floats, Springs], Iterated]


@dataclass(frozen=True, slots=True)
class SoftPart:
    """The soft material of a grid's springs.

    Attributes
    ----------
    springs : Springs
        Of the whole grid at scale 1, the seam's made soft.
    soft : (4, R, C) bool array
        Springs whose rest lengths the scale multiplies.
    measured : (4, R, C) bool array
        Those of them that lie farther from the seam than `SEAM_MM`.
    """

    springs: Springs
    soft: npt.NDArray[np.bool_]
    measured: npt.NDArray[np.bool_]

    def scaled(self, scale: float) -> Springs:
        """Return the grid's springs with the soft ones' rest lengths times `scale`."""
        return replace(self.springs, rest=np.where(self.soft, scale, 1.0) * self.springs.rest)

    def fitted(self, xy: Floats) -> float:
        """Return the scale sum(L r) / sum(r^2) that fits rest lengths r best to the lengths L in (R, C, 2) places."""
        rest = self.springs.rest[self.measured]
        lengths = chord_lengths(np.concatenate([xy, np.zeros_like(xy[..., :1])], axis=-1))[self.measured]
        return float((lengths * rest).sum() / (rest**2).sum())


def soft_part(sheet: Sheet, springs: Springs) -> SoftPart:
    """Tell the soft springs of a grid from the stiff ones, and soften the seam.

    Parameters
    ----------
    sheet : Sheet
        A grid. Quads are soft whose stiffness lies below the geometric mean of the least and the greatest.
    springs : Springs
        Its four families.

    Raises
    ------
    InputError
        If the sheet has not two materials, or the soft one lies nowhere farther from the seam than `SEAM_MM`.
    """
    constants = sheet.stiffness
    two = constants is not None and float(constants.max()) > float(constants.min())
    got = "one material" if constants is not None else "no stiffness"
    require(two, "free_scale", "be used with a stiffness of two materials", got)
    assert constants is not None
    least, greatest = float(constants.min()), float(constants.max())
    border = np.sqrt(least) * np.sqrt(greatest)
    there = springs.k_s > 0
    away = np.zeros(springs.k_s.shape)
    away[there] = cKDTree(_seam(sheet.vertices, constants < border)).query(_middles(sheet.vertices)[there])[0]
    soft = there & (springs.k_s < border)
    measured = soft & (away > SEAM_MM)
    wanted = f"be used where the soft material reaches farther than {SEAM_MM:g} mm from the seam"
    require(bool(measured.any()), "free_scale", wanted, f"{away[soft].max(initial=0.0):.1f} mm")
    k_s = np.where(there & (away <= SEAM_MM), np.minimum(springs.k_s, least), springs.k_s)
    return SoftPart(replace(springs, k_s=k_s), soft, measured)


def settle_scale(part: SoftPart, found: Iterated, settle: Settle, tolerance: float) -> tuple[Iterated, float]:
    """Alternate solve and fit of the scale until it changes no more; secants of the fit spare most of the solves.

    Parameters
    ----------
    part : SoftPart
        The soft material.
    found : Iterated
        The sheet at rest with scale 1, x (R, C, 2) [mm].
    settle : callable
        Brings springs to rest from a start (R, C, 2).
    tolerance : float
        Change of the scale that counts as none.

    Returns
    -------
    Iterated
        At rest with the settled scale, its iterations counted from the start; not converged if the scale is not.
    float
        The scale s: the soft material is 1 / s of the size that it had, compared with the stiff one.
    """
    scale, fitted = 1.0, part.fitted(found.x)
    n_iterations, rate = found.n_iterations, 0.0
    for _ in range(_MOST_SOLVES):
        if abs(fitted - scale) <= tolerance or not found.converged:
            return found, scale
        # The fit follows the scale at some rate below 1: here is where the two meet.
        step = (fitted - scale) / (1.0 - rate)
        found = settle(found.x, part.scaled(scale + step))
        again = part.fitted(found.x)
        rate = min(max((again - fitted) / step, 0.0), 0.99)
        scale, fitted, n_iterations = scale + step, again, n_iterations + found.n_iterations
        found = found._replace(n_iterations=n_iterations)
        if not _SCALES[0] < scale < _SCALES[1]:
            break
    return found._replace(converged=False), scale


def shrink_percent(scale: float) -> float:
    """How much smaller the soft material is than it was, against the stiff one [%]; negative if it has grown."""
    return 100.0 * (1.0 - 1.0 / scale)


def _seam(vertices: Floats, soft: npt.NDArray[np.bool_]) -> Floats:
    """Middles (N, 3) of the grid's edges between a soft and a stiff quad [mm]."""
    upright = (vertices[:-1, 1:-1] + vertices[1:, 1:-1]) / 2
    level = (vertices[1:-1, :-1] + vertices[1:-1, 1:]) / 2
    return np.concatenate([upright[soft[:, 1:] != soft[:, :-1]], level[soft[1:] != soft[:-1]]])


def _middles(vertices: Floats) -> Floats:
    """Middle of each spring, (4, R, C, 3) [mm], 0 where the grid ends."""
    middles = np.zeros((4, *vertices.shape))
    rows, columns = vertices.shape[:2]
    for family in range(4):
        (i, j), (p, q) = TAILS[family], HEADS[family]
        r, c = rows - max(i, p), columns - max(j, q)
        middles[family, :r, :c] = (vertices[i : r + i, j : c + j] + vertices[p : r + p, q : c + q]) / 2
    return middles

"""The springs of a grid: structural along its edges, shear along each quad's diagonals (section 3.2.2, figure 2b).

Springs are stored by the grid, not as a list: family `f`, row `r` and column `c` name the spring that joins vertex
(r, c) + `TAILS[f]` to vertex (r, c) + `HEADS[f]`. The force pass then walks along rows without an index table, which
is what lets a compiler use vector instructions.

"More springs may be used to create additional rigidity": the same four families two steps long. Their rest length is
the sum of the two springs that they span, never a straight chord, which would fold the sheet at every crease. Those
that span structural springs resist bending (Provot's flexion springs).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deskew.errors import require
from deskew.flattening.chords import chord_lengths
from deskew.flattening.sections import unfolded_lengths
from deskew.flattening.settings import SpringSettings
from deskew.types import Array, Floats, Sheet
from deskew.types.arrays import SHORTEST_MM

# Provot's names: two families of structural springs and two of shear springs; then the same two steps long.
FAMILIES = ("structural_row", "structural_column", "shear_down", "shear_up")
TAILS = ((0, 0), (0, 0), (0, 0), (1, 0), (0, 0), (0, 0), (0, 0), (2, 0))
HEADS = ((0, 1), (1, 0), (1, 1), (0, 1), (0, 2), (2, 0), (2, 2), (0, 2))


@dataclass(frozen=True, slots=True)
class Springs:
    """Rest length and stiffness of every spring of an (R, C) grid.

    Attributes
    ----------
    rest : (F, R, C) array
        Rest length r of eq. 1 [mm], by family; 0 where the grid ends and there is no spring. F is 4, or 8 with springs
        two steps long.
    k_s : (F, R, C) array
        Spring constant [kg/s^2]; 0 where there is no spring.
    """

    rest: Floats
    k_s: Floats

    def __post_init__(self) -> None:
        sound = self.rest.ndim == 3 and len(self.rest) in (4, 8)
        require(sound, "rest", "have shape (4, R, C) or (8, R, C)", self.rest.shape)
        require(self.k_s.shape == self.rest.shape, "k_s", f"have rest's shape {self.rest.shape}", self.k_s.shape)

    @property
    def grid(self) -> tuple[int, int]:
        """Rows and columns of the vertices."""
        return self.rest.shape[1], self.rest.shape[2]

    @property
    def k_max(self) -> float:
        """Stiffness of the stiffest spring [kg/s^2]: it alone sets the stable step."""
        return float(self.k_s.max())

    @property
    def cut(self) -> npt.NDArray[np.bool_]:
        """Quads without shear springs, (R - 1, C - 1): the sheet is cut there."""
        return np.asarray(self.k_s[2, :-1, :-1] == 0)

    @property
    def rest_mean(self) -> float:
        """Mean rest length of the structural springs [mm]."""
        structural = self.rest[:2]
        return float(structural.sum() / np.count_nonzero(structural))

    def pairs(self) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.intp], Floats, Floats]:
        """List the springs for a program that knows no grid.

        Returns
        -------
        a, b : (S,) int arrays
            Vertices joined by each spring, as indices into the grid's ravelled vertices.
        rest, k_s : (S,) arrays
            Rest length [mm] and spring constant [kg/s^2] of each.
        """
        index = np.arange(self.rest[0].size).reshape(self.grid)
        tails, heads, rests, constants = [], [], [], []
        for family in range(len(self.rest)):
            a, b = _ends(index, family)
            tails.append(a.ravel())
            heads.append(b.ravel())
            rests.append(self.rest[family][: a.shape[0], : a.shape[1]].ravel())
            constants.append(self.k_s[family][: a.shape[0], : a.shape[1]].ravel())
        return np.concatenate(tails), np.concatenate(heads), np.concatenate(rests), np.concatenate(constants)


def _ends(values: Array, family: int) -> tuple[Array, Array]:
    """View a per-vertex array (R, C, ...) at the tails and at the heads of a family's springs."""
    (i, j), (p, q) = TAILS[family], HEADS[family]
    rows, columns = values.shape[0] - max(i, p), values.shape[1] - max(j, q)
    return values[i : rows + i, j : columns + j], values[p : rows + p, q : columns + q]


def spring_constants(
    grid: tuple[int, int], k_s: float, quads: Floats | None = None, cut: npt.NDArray[np.bool_] | None = None
) -> Floats:
    """Spread a spring constant, or one constant a quad, over the springs of a grid.

    Parameters
    ----------
    grid : (R, C)
        Rows and columns of the vertices.
    k_s : float
        Uniform constant [kg/s^2], used when `quads` is None.
    quads : (R - 1, C - 1) array or None
        Constant of each quad [kg/s^2]: its shear springs take it, a structural spring takes the mean of the quads
        that it borders.
    cut : (R - 1, C - 1) bool array or None
        Quads without shear springs; a structural spring between two of them, or between one and nothing, is none.

    Returns
    -------
    (4, R, C) array
        Constants by family [kg/s^2], 0 where there is no spring.
    """
    rows, columns = grid
    constants = np.zeros((4, rows, columns))
    if quads is None:
        constants[0, :, : columns - 1] = k_s
        constants[1, : rows - 1, :] = k_s
        constants[2:, : rows - 1, : columns - 1] = k_s
    else:
        padded = np.pad(quads, 1, mode="edge")
        constants[0, :, : columns - 1] = (padded[:-1, 1:-1] + padded[1:, 1:-1]) / 2
        constants[1, : rows - 1, :] = (padded[1:-1, :-1] + padded[1:-1, 1:]) / 2
        constants[2:, : rows - 1, : columns - 1] = quads
    if cut is not None:
        whole = np.pad(~cut, 1, constant_values=False)
        constants[0, :, : columns - 1] *= whole[:-1, 1:-1] | whole[1:, 1:-1]
        constants[1, : rows - 1, :] *= whole[1:-1, :-1] | whole[1:-1, 1:]
        constants[2:, : rows - 1, : columns - 1] *= ~cut
    return constants


def _two_steps(one: Floats, join: Callable[[Floats, Floats], Floats]) -> Floats:
    """Join each spring's value (4, R, C) with that of the next spring in its own direction; 0 where there is none."""
    two = np.zeros_like(one)
    two[0, :, :-2] = join(one[0, :, :-2], one[0, :, 1:-1])
    two[1, :-2, :] = join(one[1, :-2, :], one[1, 1:-1, :])
    two[2, :-2, :-2] = join(one[2, :-2, :-2], one[2, 1:-1, 1:-1])
    two[3, :-2, :-2] = join(one[3, 1:-1, :-2], one[3, :-2, 1:-1])
    return two


def _weaker(a: Floats, b: Floats) -> Floats:
    return np.asarray(np.minimum(a, b))


def grid_springs(sheet: Sheet, settings: SpringSettings) -> Springs:
    """Attach springs to a sheet that is at rest as it was scanned (section 3.4).

    Parameters
    ----------
    sheet : Sheet
        A grid; its `stiffness`, where given, replaces the uniform `k_s`.
    settings : SpringSettings
        Rest lengths and which springs there are.

    Returns
    -------
    Springs
        Of 4 families, or of 8 where `bending` or `more` is not 0.

    Raises
    ------
    InputError
        If the sheet is not a grid, two joined vertices coincide, or a length or a stiffness is beyond all measure.
    """
    require(sheet.faces is None, "sheet", "be an (R, C, 3) grid for a particle system", "a triangle mesh")
    rows, columns = sheet.vertices.shape[:2]
    if settings.rest == "section" and sheet.surface is not None:
        rest = unfolded_lengths(sheet.surface, sheet.refinement, sheet.crease_width)
    else:
        rest = chord_lengths(sheet.vertices)
    constants = spring_constants((rows, columns), settings.k_s, sheet.stiffness, sheet.cut)
    rest[constants == 0] = 0.0
    coincident = int(((rest < SHORTEST_MM) & (constants > 0)).sum())
    require(coincident == 0, "vertices", "be distinct along every edge and diagonal", f"{coincident} coincident pairs")
    if settings.bending or settings.more:
        longer = _two_steps(constants, _weaker)
        longer[:2] *= settings.bending
        longer[2:] *= settings.more
        rest = np.concatenate([rest, np.where(longer > 0, _two_steps(rest, np.add), 0.0)])
        constants = np.concatenate([constants, longer])
    return Springs(rest, constants)

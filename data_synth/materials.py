"""Sheets of two materials with the truth about their change of size: drawn, shipped, or from a file."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import numpy as np

from data_synth.buckling import Change, buckled, uneven_change
from data_synth.leaf import Leaf
from data_synth.physical import physical
from data_synth.sheets import TrueSheet
from deskew.errors import InputError, require, require_whole
from deskew.io import read_arrays, write_arrays
from deskew.io.arrays import require_arrays

SHAPE = (121, 156)
"""Grid (rows, columns) of the shipped sheets."""

N_SHIPPED = 5
"""Shipped sheets of each case; their seeds are 0 to 4."""

MEAN_CHANGE = 0.02
"""Mean over the page of the smooth field of relative changes of length."""

MAX_SEED = 2**63 - 1

_SHIPPED = Path(__file__).parent / "shipped"
_STEP_MM = 2.0**-13
_NULL_SLOPE_DEG = 14.0  # as much relief as the buckled sheets have


class Case(StrEnum):
    """What happened to a vellum leaf and the paper sleeve around it."""

    A = "A"  # the vellum shrank
    B = "B"  # the sleeve grew
    N = "N"  # nothing changed size; the page is crumpled


_SIGNS = {Case.A: -1, Case.B: 1, Case.N: 0}


@dataclass(frozen=True, slots=True)
class TwoMaterials:
    """A sheet whose materials no longer fit each other, and how much they changed.

    Attributes
    ----------
    sheet : TrueSheet
        Its page coordinates are those before anything changed size: what is printed was printed then. To be rendered
        it is refined first, ``refined(sheet, chords=True)``, or its facets show.
    leaf : Leaf
        Where the vellum is, in page coordinates.
    case : Case
        What happened.
    change_percent : float
        True mean linear change of the changed material, more than 8 mm from the seam: negative for A, positive for B, 0
        for N; in [-20, 20].
    """

    sheet: TrueSheet
    leaf: Leaf
    case: Case
    change_percent: float

    def __post_init__(self) -> None:
        change = self.change_percent
        require(-20 <= change <= 20, "change_percent", "be in [-20, 20]", change)
        require(np.sign(change) == _SIGNS[self.case], "change_percent", f"have the sign of case {self.case}", change)
        same = bool(np.allclose(self.leaf.page_size_mm, self.sheet.page_size_mm, atol=0.01))
        require(same, "leaf", f"be on a page of {self.sheet.page_size_mm} mm", self.leaf.page_size_mm)


def generator(case: Case, seed: int) -> np.random.Generator:
    """Random numbers that a seed of a case stands for; cases of one seed have nothing in common."""
    require_whole("seed", seed, 0, MAX_SEED)
    return np.random.default_rng([seed, *case.encode()])


def draw_change(rng: np.random.Generator, case: Case) -> Change | None:
    """Draw what changes size, by 0 to 4 %, 2 % in the mean of the whole page's field; None for case N."""
    if case is Case.N:
        return None
    return uneven_change(rng, Leaf(), _SIGNS[case] * MEAN_CHANGE, on_leaf=case is Case.A)


def draw_two_materials(rng: np.random.Generator, case: Case, shape: tuple[int, int] = SHAPE) -> TwoMaterials:
    """Draw a letter page, landscape, with a leaf on 60 % of it, and change the size of one of its materials.

    Parameters
    ----------
    rng : numpy Generator
        The only source of randomness.
    case : Case
        A or B, as :func:`draw_change` says; N: the page is crumpled to a similar relief.
    shape : (rows, columns)
        Grid, no fewer columns than rows. 121 x 156 take 15 to 30 s of one core.

    Raises
    ------
    StepError
        If the sheet has near-vertical walls.
    """
    require(shape[1] >= shape[0] >= 8, "shape", "be (rows, columns), at least 8, no fewer columns than rows", shape)
    change = draw_change(rng, case)
    if change is None:
        return TwoMaterials(physical(rng, shape, slope_p90_deg=_NULL_SLOPE_DEG), Leaf(), case, 0.0)
    return TwoMaterials(buckled(rng, change, shape), change.leaf, case, 100 * change.well_inside())


def write_two_materials(two: TwoMaterials, path: Path) -> None:
    """Write an NPZ file that :func:`read_two_materials` reads; positions to 1/8192 mm.

    Raises
    ------
    InputError
        If `path` does not end in ``.npz``.
    StepError
        If the file system refuses.
    """
    # Digits that mean nothing would take a fifth of the file; plane by plane, in Fortran's order, F takes next to none.
    vertices = np.round(two.sheet.vertices / _STEP_MM) * _STEP_MM
    V, F = (np.asfortranarray(grid, np.float32) for grid in (vertices, two.sheet.flat))
    leaf, change = np.array([two.leaf.share, two.leaf.corner_mm]), np.array(two.change_percent)
    write_arrays({"V": V, "F": F, "leaf": leaf, "change_percent": change}, path)


def read_two_materials(path: Path) -> TwoMaterials:
    """Read a sheet of two materials, which may be anyone's.

    Parameters
    ----------
    path : Path
        NPZ with V (h, w, 3), world positions [mm]; F (h, w, 2), page coordinates before the change [mm]; leaf (2,), the
        leaf's share of the page and its corners' radius [mm]; change_percent (), whose sign tells the case.

    Raises
    ------
    InputError
        If an array is not there or not of its shape, or its numbers are out of range.
    """
    path = Path(path)
    arrays = read_arrays(path)
    require_arrays(arrays, {"V": (None, None, 3), "F": (None, None, 2), "leaf": (2,), "change_percent": ()}, path)
    try:
        sheet = TrueSheet(arrays["V"], arrays["F"])
        corner = sheet.flat.min(axis=(0, 1))
        require(bool(np.abs(corner).max() < 0.5), "F", "begin at the page's corner (0, 0)", tuple(corner.tolist()))
        leaf = Leaf(sheet.page_size_mm, *map(float, arrays["leaf"]))
        change = float(arrays["change_percent"])
        case = next((case for case, sign in _SIGNS.items() if np.sign(change) == sign), Case.N)
        return TwoMaterials(sheet, leaf, case, change)
    except InputError as error:
        raise InputError(f"`{path}`: {error}") from error


def shipped_two_materials(case: Case, index: int) -> TwoMaterials:
    """Return a sheet that comes with the package: what :func:`draw_two_materials` draws from seed `index` of the case.

    Parameters
    ----------
    case : Case
        What happened to it.
    index : int
        In [0, `N_SHIPPED`).
    """
    require_whole("index", index, 0, N_SHIPPED - 1)
    return read_two_materials(_SHIPPED / f"two_materials_{case}_{index}.npz")

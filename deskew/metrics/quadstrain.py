"""Where flattening stretched a sheet and where it squeezed it: a strain for each quad of a grid."""

from __future__ import annotations

import numpy as np

from deskew.errors import require
from deskew.types import Flattened, Floats, Sheet


def quad_strain(sheet: Sheet, flattened: Flattened) -> Floats:
    """Relative change of the length of each quad's four sides together.

    Sides are measured along the surface where both know it: a chord across a fold is shorter than the page, and would
    show as stretched what kept its length.

    Parameters
    ----------
    sheet : Sheet
        Grid as scanned [mm].
    flattened : Flattened
        The same grid flattened.

    Returns
    -------
    (R - 1, C - 1) array
        ``L' / L - 1``, positive where the page was stretched; NaN where the sheet is cut.

    Raises
    ------
    InputError
        If the sheet is no grid, or the two disagree in shape.
    """
    require(sheet.faces is None, "sheet", "be a grid", "a triangle mesh")
    shape = sheet.vertices.shape
    require(flattened.vertices.shape == shape, "flattened", f"have the sheet's shape {shape}", flattened.vertices.shape)
    if sheet.surface is None or flattened.surface is None:
        before, after = _perimeters(sheet.vertices, 1), _perimeters(flattened.vertices, 1)
    else:
        before, after = (_perimeters(grid, sheet.refinement) for grid in (sheet.surface, flattened.surface))
    require(float(before.min()) > 0, "sheet", "have quads with sides", f"{int((before == 0).sum())} in one point")
    strain = np.asarray(after / before - 1.0)
    return strain if sheet.cut is None else np.where(sheet.cut, np.nan, strain)


def _perimeters(grid: Floats, n: int) -> Floats:
    """Sum of the four sides of each n x n block of a grid's quads, along its samples."""
    across = np.linalg.norm(np.diff(grid[::n], axis=1), axis=-1)
    down = np.linalg.norm(np.diff(grid[:, ::n], axis=0), axis=-1)
    across = across.reshape(len(across), -1, n).sum(axis=2)
    down = down.reshape(-1, n, down.shape[1]).sum(axis=1)
    return np.asarray(across[:-1] + across[1:] + down[:, :-1] + down[:, 1:])

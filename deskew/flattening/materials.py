"""Stiffness by region: one constant a quad or a face, given as an array or as a function of place (section 4.3)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from deskew.errors import InputError, in_one_line
from deskew.types import Floats, Sheet


def middles(sheet: Sheet) -> Floats:
    """Middles of a grid's quads, (R - 1, C - 1, 3), or of a mesh's faces, (F, 3) [mm]."""
    v = sheet.vertices
    if sheet.faces is not None:
        return np.asarray(v[sheet.faces].mean(axis=1))
    return np.asarray((v[:-1, :-1] + v[:-1, 1:] + v[1:, :-1] + v[1:, 1:]) / 4)


def with_stiffness(sheet: Sheet, stiffness: Floats | Callable[[Floats], Floats]) -> Sheet:
    """Give a sheet its stiffness.

    Parameters
    ----------
    sheet : Sheet
        Grid or triangle mesh [mm].
    stiffness : (R - 1, C - 1) or (F,) array or callable
        Spring constants [kg/s^2], or a function that takes the middles, (N, 3) [mm], and returns (N,) of them.

    Raises
    ------
    InputError
        If the function fails, or the constants are not one a quad or a face, positive and finite.
    """
    if not callable(stiffness):
        return replace(sheet, stiffness=stiffness)
    places = middles(sheet)
    try:
        constants = np.asarray(stiffness(places.reshape(-1, 3).copy()), dtype=np.float64)
        return replace(sheet, stiffness=constants.reshape(places.shape[:-1]))
    except InputError:
        raise
    except (Exception, SystemExit) as error:  # whatever a function from outside does
        raise InputError(f"`stiffness` must return one number a middle, got {in_one_line(error)}.") from error

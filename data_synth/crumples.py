"""Physical crumples to render: eight of graded severity that come with the package, or new ones.

The command :mod:`data_synth.crumpling` drew shipped sheet i by :func:`data_synth.physical.physical` from
``numpy.random.default_rng(i)``, for a slope of ``SLOPES_P90_DEG[i]``; seeds and slopes were fixed before any was seen.

A file holds the world positions of a grid that is regular on the letter page: as whole multiples of 2^-14 mm, of which
`steps` (h, w, 3) are the differences along v and then u, since these pack into a third of what positions take; and what
:func:`data_synth.surfaces.severity` says of the sheet.
"""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np

from data_synth.physical import physical
from data_synth.refinement import refined
from data_synth.sheets import PAGE_SIZE_MM, TrueSheet, page_grid_of
from data_synth.surfaces import severity
from deskew.errors import require_whole
from deskew.io import read_arrays, write_arrays
from deskew.io.arrays import require_arrays

SLOPES_P90_DEG = (8.0, 17.0, 26.0, 11.0, 20.0, 29.0, 14.0, 23.0)
"""90th percentiles of slope that the shipped sheets were drawn for; the first few span the range already.

Their own are 8.4, 18.4, 24.6, 12.8, 20.4, 27.1, 15.3 and 23.2 degrees.
"""

N_CRUMPLES = len(SLOPES_P90_DEG)
"""Shipped sheets."""

SHAPE = (217, 280)
"""Grid (rows, columns) that sheets are solved on: a vertex every millimetre of a letter page."""

SHIPPED = Path(__file__).parent / "shipped"
"""Folder of the shipped sheets."""

_STEP_MM = 2.0**-14  # rounds the edges' lengths by some 2e-5, a tenth of what the paper stretches


def shipped_crumple(index: int) -> TrueSheet:
    """Return a shipped sheet, refined for rendering.

    Parameters
    ----------
    index : int
        In [0, N_CRUMPLES).
    """
    require_whole("index", index, 0, N_CRUMPLES - 1)
    return refined(read_crumple(crumple_path(index, SHIPPED)), chords=True)


def drawn_crumple(rng: np.random.Generator, slope_p90_deg: float) -> TrueSheet:
    """Draw a new sheet as the shipped ones were, refined for rendering; some 90 s of one core.

    Parameters
    ----------
    rng : numpy Generator
        The only source of randomness.
    slope_p90_deg : float
        Wanted 90th percentile of slope, in [3, 30]; the sheet's own comes out within some 2 degrees.
    """
    return refined(physical(rng, SHAPE, slope_p90_deg=slope_p90_deg), chords=True)


def crumple_path(index: int, folder: Path) -> Path:
    """Return the file of a sheet in a folder."""
    return folder / f"crumple_{index}.npz"


def read_crumple(path: Path) -> TrueSheet:
    """Return a sheet as it was solved for, not refined.

    Raises
    ------
    InputError
        If there is no such file, or another one.
    """
    arrays = read_arrays(path)
    require_arrays(arrays, {"steps": (None, None, 3)}, path)
    V = arrays["steps"].cumsum(axis=1, dtype=np.int64).cumsum(axis=0) * _STEP_MM
    return TrueSheet(V, page_grid_of((V.shape[0], V.shape[1]), PAGE_SIZE_MM))


def write_crumple(sheet: TrueSheet, path: Path) -> None:
    """Write a sheet on a regular grid of the letter page, with its severity; the same sheet gives the same bytes."""
    whole = np.round(sheet.vertices / _STEP_MM).astype(np.int32)
    steps = np.diff(np.diff(whole, axis=0, prepend=0), axis=1, prepend=0)
    told = asdict(severity(TrueSheet(whole * _STEP_MM, sheet.flat)))
    # Coordinate by coordinate, which is Fortran's order, they compress better.
    arrays = {"steps": np.asfortranarray(steps), **{name: np.asarray(value) for name, value in told.items()}}
    write_arrays(arrays, path)

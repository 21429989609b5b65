"""Physical crumples to render: eight of graded severity that come with the package, or new ones.

The command :mod:`data_synth.crumpling` drew shipped sheet i by :func:`data_synth.physical.physical` from
``numpy.random.default_rng(i)``, for a slope of ``SLOPES_P90_DEG[i]``; seeds and slopes were fixed before any was seen.

A file holds the world positions V (h, w, 3) and the page coordinates F (h, w, 2) of a grid [mm], as every file of a
sheet does, and what :func:`data_synth.surfaces.severity` says of it. Positions are whole multiples of 2^-14 mm, which
pack well.
"""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np

from data_synth.physical import physical
from data_synth.refinement import refined
from data_synth.sheets import TrueSheet
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
    require_arrays(arrays, {"V": (None, None, 3), "F": (None, None, 2)}, path)
    return TrueSheet(arrays["V"], arrays["F"])


def write_crumple(sheet: TrueSheet, path: Path) -> None:
    """Write a sheet on a regular grid of the letter page, with its severity; the same sheet gives the same bytes."""
    V = np.round(sheet.vertices / _STEP_MM) * _STEP_MM
    told = asdict(severity(TrueSheet(V, sheet.flat)))
    # Coordinate by coordinate, which is Fortran's order, they compress better.
    places = {name: np.asfortranarray(grid, dtype=np.float32) for name, grid in (("V", V), ("F", sheet.flat))}
    write_arrays({**places, **{name: np.asarray(value) for name, value in told.items()}}, path)

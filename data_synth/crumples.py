"""Eight physical crumples of graded severity that come with the package, and the command that made them.

    python -m data_synth.crumples               # tells their severity and strain
    python -m data_synth.crumples FOLDER        # makes them anew: 2 to 3 minutes of one core

Sheet i is drawn by :func:`data_synth.physical.physical` from ``numpy.random.default_rng(i)``, for a 90th percentile of
slope of 8, 17, 26, 11, 20, 29, 14, 23 degrees, so that the first few span the range already. Seeds and slopes were
fixed before any sheet was seen. `crumple_I.npz` holds V (h, w, 3), positions in the world, and F (h, w, 2), page
coordinates [mm], as `sheet.paths` takes them, and what :func:`data_synth.surfaces.severity` says of them. The same
machine makes the same bytes again; another one may round otherwise.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np

from data_synth.physical import physical
from data_synth.refinement import refined
from data_synth.sheets import TrueSheet
from data_synth.surfaces import CommandParser, made_folder, severity
from deskew.errors import DeskewError, require_whole
from deskew.io import read_arrays, write_arrays

SLOPES_P90_DEG = (8.0, 17.0, 26.0, 11.0, 20.0, 29.0, 14.0, 23.0)
"""What the shipped sheets were drawn for; their own slopes come out within some 10 % of it."""

N_CRUMPLES = len(SLOPES_P90_DEG)
"""Shipped sheets."""

SHAPE = (145, 187)
"""Their grid: a vertex every 1.5 mm of a letter page."""

_SHIPPED = Path(__file__).parent / "shipped"


def shipped_crumple(index: int) -> TrueSheet:
    """Return a shipped sheet, refined for rendering.

    Parameters
    ----------
    index : int
        In [0, N_CRUMPLES).
    """
    return refined(_read(index, _SHIPPED))


def drawn_crumple(rng: np.random.Generator, slope_p90_deg: float) -> TrueSheet:
    """Draw a new sheet as the shipped ones were, refined for rendering; some 20 s of one core.

    Parameters
    ----------
    rng : numpy Generator
        The only source of randomness.
    slope_p90_deg : float
        Wanted 90th percentile of slope, in [3, 30].
    """
    return refined(physical(rng, SHAPE, slope_p90_deg=slope_p90_deg))


def _read(index: int, folder: Path) -> TrueSheet:
    require_whole("index", index, 0, N_CRUMPLES - 1)
    arrays = read_arrays(folder / f"crumple_{index}.npz")
    return TrueSheet(arrays["V"], arrays["F"])


def _write(index: int, folder: Path) -> None:
    sheet = physical(np.random.default_rng(index), SHAPE, slope_p90_deg=SLOPES_P90_DEG[index])
    # Plane by plane, which is Fortran's order, they compress better: F to next to nothing.
    V, F = (np.asfortranarray(grid, np.float32) for grid in (sheet.vertices, sheet.flat))
    told = {name: np.asarray(value) for name, value in asdict(severity(TrueSheet(V, F))).items()}
    write_arrays({"V": V, "F": F} | told, folder / f"crumple_{index}.npz")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    parser = CommandParser(prog="python -m data_synth.crumples", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("folder", type=Path, nargs="?", help="write the sheets there, made anew")
    try:
        folder = parser.parse_args(arguments).folder
        if folder is not None:
            made_folder(folder)
        for index in range(N_CRUMPLES):
            if folder is not None:
                _write(index, folder)
            print(f"crumple_{index}: {severity(_read(index, folder or _SHIPPED))}", flush=True)
    except DeskewError as error:
        print(f"error: {error}", file=sys.stderr)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())

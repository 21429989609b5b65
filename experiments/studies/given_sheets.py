"""Sheets that the user gives instead of random ones, refused unless they could be a crumpled page under the camera."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from data_synth import TrueSheet, refined
from data_synth.surfaces import edge_strain
from deskew.errors import require
from deskew.io import read_arrays
from deskew.types import Array, Floats

_REACH_MM = 1000.0
# Chords over sharp folds are shorter than the paper between their ends, so not every edge can keep its length.
_STRETCH = 0.2
_MOSTLY = 4.0  # times what other edges are too long; on mirror folds none is, on simulated sheets both are alike


def read_sheet(path: Path, page_size_mm: tuple[float, float]) -> TrueSheet:
    """Read a sheet from an NPZ file with V, world positions, and F, page coordinates of the same grid.

    Parameters
    ----------
    path : Path
        Holds V (h, w, 3) and F (h, w, 2) [mm].
    page_size_mm : (width, height)
        Of the page printed on it; F must span it from (0, 0).

    Raises
    ------
    InputError
        If the arrays are not there, not finite, no page of that size, far from the rig, or stretched.
    """
    arrays = read_arrays(path)
    require({"V", "F"} <= set(arrays), str(path), "hold V (h, w, 3) and F (h, w, 2) [mm]", ", ".join(sorted(arrays)))
    V, F = _grid(arrays["V"], 3, f"{path}: V"), _grid(arrays["F"], 2, f"{path}: F")
    require(V.shape[:2] == F.shape[:2], f"{path}: F", f"have shape {(*V.shape[:2], 2)}, as V has", F.shape)
    far = float(np.abs(V).max())
    require(far <= _REACH_MM, f"{path}: V", f"lie within {_REACH_MM:g} mm of the world's origin", f"{far:g} mm")
    span = F.reshape(-1, 2).min(axis=0), F.reshape(-1, 2).max(axis=0)
    fits = bool(np.allclose(span, ((0.0, 0.0), page_size_mm), atol=0.5))
    page, got = "{:g} x {:g}".format(*page_size_mm), "({:g}, {:g}) to ({:g}, {:g})".format(*span[0], *span[1])
    require(fits, f"{path}: F", f"span the page of {page} mm from (0, 0)", got)
    stretch = _median_stretch(V, F)
    allowed = f"keep the lengths of F's edges to {_STRETCH:.0%} in the median"
    require(stretch <= _STRETCH, f"{path}: V", allowed, f"{stretch:.0%}")
    return TrueSheet(V, F)


def refined_if_short(sheet: TrueSheet) -> TrueSheet:
    """Refine a sheet whose chords are mostly shorter than the page between their ends: its vertices lie on a surface.

    Where chords are as long as the page, as between creases that run along the grid's lines or after a simulation on
    this very grid, the facets are the sheet, and a curve through the vertices would be too long.
    """
    strain = edge_strain(sheet)
    short, long = float(np.maximum(-strain, 0.0).sum()), float(np.maximum(strain, 0.0).sum())
    return refined(sheet) if short > _MOSTLY * long else sheet


def _grid(values: Array, depth: int, name: str) -> Floats:
    shaped = values.ndim == 3 and values.shape[2] == depth and min(values.shape[:2]) >= 2
    require(shaped, name, f"have shape (h, w, {depth}) with h, w >= 2", values.shape)
    require(bool(np.isfinite(values).all()), name, "be finite", "NaN or infinity")
    return np.asarray(values, dtype=np.float64)


def _median_stretch(V: Floats, F: Floats) -> float:
    """Return the median of |length in space / length on the page - 1| over the grid's edges."""
    ratios = []
    for axis in (0, 1):
        in_space, on_page = (np.linalg.norm(np.diff(grid, axis=axis), axis=-1) for grid in (V, F))
        # An edge without a length on the page is stretched beyond measure, also where V has none either.
        with np.errstate(divide="ignore", invalid="ignore"):
            ratios.append(np.where(on_page > 0.0, in_space / on_page, np.inf).ravel())
    return float(np.median(np.abs(np.concatenate(ratios) - 1.0)))

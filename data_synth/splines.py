"""Grids of points or numbers sampled at another density, border to border."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import RectBivariateSpline

from data_synth.sheets import SPACING_MM, TrueSheet
from deskew.errors import require_positive
from deskew.types import Floats


def spline(field: Floats, shape: tuple[int, int], degree: int) -> Floats:
    """Sample a field (n, m) on a grid of another shape by splines of a degree."""
    if field.shape == shape:
        return field
    here = [np.linspace(0.0, 1.0, n) for n in field.shape]
    there = [np.linspace(0.0, 1.0, n) for n in shape]
    return np.asarray(RectBivariateSpline(*here, field, kx=degree, ky=degree, s=0)(*there))


def resampled(x: Floats, shape: tuple[int, int]) -> Floats:
    """Sample a grid of points (n, m, k) on a grid of another shape by bicubic splines."""
    return np.stack([spline(x[..., c], shape, 3) for c in range(x.shape[-1])], axis=-1)


def refined(sheet: TrueSheet, spacing_mm: float = SPACING_MM) -> TrueSheet:
    """Return a sheet with its vertices close enough to be photographed: bicubic between those that it has.

    Parameters
    ----------
    sheet : TrueSheet
        Grid of at least 4 x 4 vertices.
    spacing_mm : float
        Distance of neighbours on the page that is wanted, in (0, 10] [mm]; a sheet that is as fine stays as it is.
    """
    require_positive("spacing_mm", spacing_mm, 10.0, "mm")
    (rows, columns), (width, height) = sheet.vertices.shape[:2], sheet.page_size_mm
    shape = max(rows, round(height / spacing_mm) + 1), max(columns, round(width / spacing_mm) + 1)
    return TrueSheet(resampled(sheet.vertices, shape), resampled(sheet.flat, shape))

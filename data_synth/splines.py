"""Grids of points or numbers sampled at another density, border to border."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import RectBivariateSpline

from deskew.types import Floats


def spline(field: Floats, shape: tuple[int, int], degree: int) -> Floats:
    """Sample a field (n, m) on a grid of another shape by splines of a degree, of less on too few vertices."""
    if field.shape == shape:
        return field
    here = [np.linspace(0.0, 1.0, n) for n in field.shape]
    there = [np.linspace(0.0, 1.0, n) for n in shape]
    kx, ky = (min(degree, n - 1) for n in field.shape)
    return np.asarray(RectBivariateSpline(*here, field, kx=kx, ky=ky, s=0)(*there))


def resampled(x: Floats, shape: tuple[int, int]) -> Floats:
    """Sample a grid of points (n, m, k) on a grid of another shape by bicubic splines."""
    return np.stack([spline(x[..., c], shape, 3) for c in range(x.shape[-1])], axis=-1)

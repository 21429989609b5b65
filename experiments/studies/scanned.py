"""Points of a depth map at sub-pixel places: what a length is measured between."""

from __future__ import annotations

import numpy as np

from deskew import projection
from deskew.types import DepthMap, Floats


def scanned_points(depth: DepthMap, pixels: Floats, radius_px: int) -> Floats:
    """Return world points at sub-pixel places of a depth map.

    Depth beside an ink edge is biased one way on one side and the other way on the other. A plane through the
    neighbourhood cancels that; in inverse depth a plane is linear in the pixel.

    Parameters
    ----------
    depth : DepthMap
        On the undistorted grid.
    pixels : (N, 2) array
        Places (x, y) on the same grid [px]; NaN allowed.
    radius_px : int
        Half-width of the square neighbourhood; the surface must be flat in it.

    Returns
    -------
    (N, 3) array
        World points, in the calibration's unit; NaN where less than a quarter of the neighbourhood has a depth:
        around a corner of a checkerboard, ink may leave half of it dark.
    """
    height, width = depth.z.shape
    offsets = np.arange(-radius_px, radius_px + 1)
    inverse = np.full(len(pixels), np.nan)
    for i, (x, y) in enumerate(pixels):
        if not np.isfinite([x, y]).all():
            continue
        columns, rows = np.meshgrid(round(x) + offsets, round(y) + offsets)
        inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
        columns, rows = columns[inside], rows[inside]
        known = np.isfinite(depth.z[rows, columns])
        if 4 * known.sum() < len(offsets) ** 2:
            continue
        design = np.stack([np.ones(len(columns)), columns - x, rows - y], axis=-1)[known]
        inverse[i] = _plane_at_origin(design, 1.0 / depth.z[rows, columns][known])
    return np.asarray(projection.centre(depth.camera) + projection.rays(depth.camera, pixels) / inverse[:, None])


def _plane_at_origin(design: Floats, values: Floats, n_reweightings: int = 4) -> float:
    """Fit ``values = design @ (c, a, b)`` and return c; residuals beyond a few medians hardly count."""
    weight = np.ones(len(values))
    solution: Floats = np.zeros(3)
    for _ in range(n_reweightings + 1):
        solution = np.linalg.lstsq(design * weight[:, None], values * weight, rcond=None)[0]
        residual = np.abs(design @ solution - values)
        weight = 1.0 / (1.0 + residual / (2.0 * np.median(residual) + 1e-300))
    return float(solution[0])

"""Pages flattened in their picture alone, at any size: judged after a rotation, a translation and one scale.

The figures are called similar, never rigid: a scale that may be chosen freely flatters, and stands in no table under
the name of figures that have none.
"""

from __future__ import annotations

import numpy as np

from deskew import projection
from deskew.errors import StepError, require
from deskew.metrics.alignment import distances, fit_similar, require_not_mirrored
from deskew.metrics.corners import PAIRS_MIN
from deskew.metrics.coverage import page_coverage
from deskew.metrics.dense import PIXELS_MIN
from deskew.types import Dewarped, Floats, Pinhole

_DOWN = np.array([1.0, -1.0])  # a picture's y runs down, the world's Y up


def similar_corner_distance(corners: Floats, control: Floats, camera: Pinhole) -> dict[str, float]:
    """Distances between corresponding corners after the best rotation, translation and scale.

    Parameters
    ----------
    corners : (N, 2) array
        In the dewarped picture [its own px], NaN where one was not found.
    control : (N, 2) array
        In the control [px of `camera`], likewise.
    camera : Pinhole
        The ideal camera of the control.

    Returns
    -------
    dict
        `corner_similar_{mean,max}_mm`.

    Raises
    ------
    StepError
        If too few corners were found, or the page is mirrored.
    """
    require(corners.shape == control.shape, "corners", f"have the control's shape {control.shape}", corners.shape)
    found = np.isfinite(corners).all(axis=1) & np.isfinite(control).all(axis=1)
    if int(found.sum()) < PAIRS_MIN:
        raise StepError(f"Corner distance: {int(found.sum())} corners found in both images, {PAIRS_MIN} needed.")
    moved, bed = corners[found] * _DOWN, projection.onto_bed(camera, control[found])
    require_not_mirrored(moved, bed, "Corner distance")
    error = distances(fit_similar(moved, bed).apply(moved), bed)
    return {"corner_similar_mean_mm": float(error.mean()), "corner_similar_max_mm": float(error.max())}


def similar_dense_error(dewarped: Dewarped, true_uv: Floats, page_size_mm: tuple[float, float]) -> dict[str, float]:
    """Distance of each pixel from its true place after the best rotation, translation and scale.

    Parameters
    ----------
    dewarped : Dewarped
        With its backward map, (H, W, 2).
    true_uv : (H, W, 2) array
        True page coordinates (u, v) [mm] at each place of the map, NaN off the page.
    page_size_mm : (width, height)
        Of the flat page.

    Returns
    -------
    dict
        `dense_similar_{mean,p95,max}_mm` and `page_coverage`, as of :func:`deskew.metrics.dense_error`.

    Raises
    ------
    StepError
        If hardly any pixel shows the page, or it is mirrored.
    """
    places = dewarped.backward_map
    if places is None:
        raise StepError("Dense error: the picture has no backward map, so nobody knows what its pixels show.")
    require(true_uv.shape == places.shape, "true_uv", f"have the backward map's shape {places.shape}", true_uv.shape)
    shown = np.isfinite(true_uv).all(axis=-1) & np.isfinite(places).all(axis=-1)
    if int(shown.sum()) < PIXELS_MIN:
        raise StepError(f"Dense error: {int(shown.sum())} pixels show the page, at least {PIXELS_MIN} needed.")
    height, width = shown.shape
    pixels, truth = projection.pixel_grid((width, height))[shown] * _DOWN, true_uv[shown] * _DOWN
    require_not_mirrored(pixels, truth, "Dense error")
    error = distances(fit_similar(pixels, truth).apply(pixels), truth)
    return {
        "dense_similar_mean_mm": float(error.mean()),
        "dense_similar_p95_mm": float(np.percentile(error, 95)),
        "dense_similar_max_mm": float(error.max()),
        "page_coverage": page_coverage(places, true_uv, page_size_mm),
    }

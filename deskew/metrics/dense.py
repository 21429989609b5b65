"""Every restored pixel against the place where its bit of paper belongs on the flat page."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from deskew import projection
from deskew.errors import StepError, require
from deskew.metrics.alignment import distances, fit_rigid, require_not_mirrored
from deskew.metrics.coverage import page_coverage
from deskew.types import Floats, Restoration

PIXELS_MIN = 100


def pixel_places(restoration: Restoration, true_uv: Floats) -> tuple[npt.NDArray[np.bool_], Floats, Floats]:
    """Return where restored pixels lie, and where they belong up to a rigid motion.

    Parameters
    ----------
    restoration : Restoration
        With its backward map.
    true_uv : (H, W, 2) array
        As for :func:`dense_error`.

    Returns
    -------
    shown : (H, W) bool array
        Pixels that show the page.
    places, truth : (N, 2) arrays
        World X, Y of these pixels on the bed, and (u, -v) of what they show [mm].

    Raises
    ------
    StepError
        If hardly any pixel shows the page.
    """
    shape = restoration.backward_map.shape
    require(true_uv.shape == shape, "true_uv", f"have the backward map's shape {shape}", true_uv.shape)
    shown = np.isfinite(true_uv).all(axis=-1) & np.isfinite(restoration.backward_map).all(axis=-1)
    if int(shown.sum()) < PIXELS_MIN:
        raise StepError(
            f"Dense error: {int(shown.sum())} restored pixels show the page, at least {PIXELS_MIN} needed; "
            "look at the restored image."
        )
    places = projection.onto_bed(restoration.camera, projection.pixel_grid(restoration.camera.size)[shown])
    return np.asarray(shown), places, true_uv[shown] * np.array([1.0, -1.0])


def dense_error(restoration: Restoration, true_uv: Floats, page_size_mm: tuple[float, float]) -> dict[str, float]:
    """Distance of each restored pixel from its true place, after the best rotation and translation alone.

    Parameters
    ----------
    restoration : Restoration
        With its backward map.
    true_uv : (H, W, 2) array
        True page coordinates (u, v) [mm] of what the raw camera sees at each backward-mapped pixel, NaN off the page:
        evaluated at that very place, since values interpolated across the page's border would be wrong there.
    page_size_mm : (width, height)
        Of the flat page.

    Returns
    -------
    dict
        `dense_{mean,p95,max}_mm` and `page_coverage`, the share of the page's area that the restored image shows.

    Raises
    ------
    StepError
        If hardly any pixel shows the page, or the page is mirrored.

    Notes
    -----
    u grows with the world's +X, v with -Y, so the true place of (u, v) is (u, -v) up to a rigid motion.
    """
    _, places, truth = pixel_places(restoration, true_uv)
    require_not_mirrored(places, truth, "Dense error")
    error = distances(fit_rigid(places, truth).apply(places), truth)
    return {
        "dense_mean_mm": float(error.mean()),
        "dense_p95_mm": float(np.percentile(error, 95)),
        "dense_max_mm": float(error.max()),
        "page_coverage": page_coverage(restoration.backward_map, true_uv, page_size_mm),
    }

"""A page of two materials: how well each is restored, seen from the one that kept its size (section 4.3)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from deskew.errors import StepError, require
from deskew.metrics.alignment import distances, fit_affine, fit_rigid, require_not_mirrored
from deskew.metrics.dense import PIXELS_MIN, pixel_places
from deskew.types import Floats, Restoration


def region_error(restoration: Restoration, true_uv: Floats, kept: npt.NDArray[np.bool_]) -> dict[str, float]:
    """Distance of restored pixels from their true places, after the rigid motion that fits the kept region alone.

    What changed its size cannot be right as a whole, and must not pull the motion away from what can.

    Parameters
    ----------
    restoration : Restoration
        With its backward map.
    true_uv : (H, W, 2) array
        True page coordinates [mm], as for :func:`deskew.metrics.dense_error`, before anything changed its size.
    kept : (H, W) bool array
        Restored pixels that show what kept its size; from truth.

    Returns
    -------
    dict
        `kept_{mean,p95}_mm`, and `changed_{mean,p95}_mm` where anything changed; `dense_affine_mean_mm` over all, after
        an affine alignment, which hides most of a wrong size.

    Raises
    ------
    StepError
        If hardly any pixel shows the page or its kept region, or the page is mirrored.
    """
    shape = restoration.backward_map.shape[:2]
    require(kept.shape == shape and kept.dtype == np.bool_, "kept", f"be bool of shape {shape}", kept.shape)
    shown, places, truth = pixel_places(restoration, true_uv)
    inside = kept[shown]
    if int(inside.sum()) < PIXELS_MIN:
        raise StepError(
            f"Region error: {int(inside.sum())} restored pixels show what kept its size, at least {PIXELS_MIN} needed; "
            "look at the restored image."
        )
    require_not_mirrored(places, truth, "Region error")
    error = distances(fit_rigid(places[inside], truth[inside]).apply(places), truth)
    figures: dict[str, float] = {}
    for name, region in (("kept", inside), ("changed", ~inside)):
        if region.any():
            figures[f"{name}_mean_mm"] = float(error[region].mean())
            figures[f"{name}_p95_mm"] = float(np.percentile(error[region], 95))
    affine = distances(fit_affine(places, truth).apply(places), truth)
    return figures | {"dense_affine_mean_mm": float(affine.mean())}

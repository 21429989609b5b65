"""Corners of a checkered page in the pictures under test, looked for where the truth says they are."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from scipy.spatial import cKDTree

from data_synth import Truth
from deskew import acquisition, projection
from deskew.types import Array, Floats, Pinhole

Detector = Callable[[Array, Floats], Floats]

# The paper's detector and a better one; the second is a part of the condition's name.
DETECTORS: Mapping[str, Detector] = {
    "": acquisition.refine_kitchen_rosenfeld,
    "/saddle": acquisition.refine_saddle,
}


def seen_corners(truth: Truth, corners_mm: Floats, camera: Pinhole, view: Pinhole) -> Floats:
    """Return where the page's corners lie in an undistorted view of the page as it lay.

    Parameters
    ----------
    truth : Truth
        Of the capture.
    corners_mm : (N, 2) array
        True page coordinates (u, v) [mm].
    camera, view : Pinhole
        The calibrated camera and the ideal one of the view.

    Returns
    -------
    (N, 2) array
        Pixels of the view, NaN for a corner that the camera does not see.
    """
    normalised = projection.undistort(camera, truth.pixels_of(corners_mm))
    return np.asarray(normalised @ view.K[:2, :2].T + view.K[:2, 2])


def restored_corners(true_uv: Floats, corners_mm: Floats, reach_mm: float = 1.5) -> Floats:
    """Return which restored pixel shows each of the page's corners.

    Parameters
    ----------
    true_uv : (H, W, 2) array
        True page coordinates [mm] of each restored pixel, NaN off the page.
    corners_mm : (N, 2) array
        True page coordinates of the corners.
    reach_mm : float
        A corner that no pixel comes nearer to is not in the picture.

    Returns
    -------
    (N, 2) array
        Pixels (x, y), to a pixel; NaN for a corner that is not in the picture.
    """
    shown = np.isfinite(true_uv).all(axis=-1)
    y, x = np.nonzero(shown)
    pixels = np.stack([x, y], axis=-1).astype(np.float64)
    distance, nearest = cKDTree(true_uv[shown]).query(corners_mm)
    return np.where((distance <= reach_mm)[:, None], pixels[nearest], np.nan)

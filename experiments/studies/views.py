"""Corners of a checkered page in the pictures under test, looked for where the truth says they are."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from scipy.ndimage import map_coordinates
from scipy.spatial import cKDTree

from data_synth import Truth
from deskew import acquisition, projection
from deskew.types import Array, Floats, Pinhole

Detector = Callable[[Array, Floats], Floats]

# The paper's detector and a better one; the second is a part of the condition's name.
DETECTORS: Mapping[str, Detector] = {
    "": lambda image, seeds: acquisition.refine_kitchen_rosenfeld(reflectance(image), seeds),
    "/saddle": lambda image, seeds: acquisition.refine_saddle(reflectance(image), seeds),
}
# Grey level, as a share of white's, below which the logarithm flattens out: darker ink is noise.
_DARK = 0.1


def reflectance(image: Array) -> Floats:
    """Return the logarithm of the grey levels, in which light and shade are added to what is printed.

    The facets of a crumpled page are lit unevenly, and restored images keep their shading. The edge between two facets
    is a large step on white paper and a small one on ink, and so pulls at a corner that it passes; in logarithms it is
    the same step on both. Applied alike to the control, the unrestored and the restored image.

    Parameters
    ----------
    image : (height, width[, 3]) array
        Grey levels, 0 is black.
    """
    grey = acquisition.grey_levels(image).astype(np.float64)
    white = max(float(np.percentile(grey, 99.5)), 1e-9)
    return np.asarray(100.0 * np.log1p(np.maximum(grey, 0.0) / (_DARK * white)))


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


def map_error_mm(true_uv: Floats, found: Floats, corners_mm: Floats) -> float:
    """Return how far a restored picture and its backward map are apart, as root mean square over the corners [mm].

    Aligned figures cannot tell: a picture that is read beside its map shows every corner shifted alike.

    Parameters
    ----------
    true_uv : (H, W, 2) array
        True page coordinates [mm] of each restored pixel, by the backward map; NaN off the page.
    found : (N, 2) array
        Pixels (x, y) where the picture shows the page's corners, NaN where it does not.
    corners_mm : (N, 2) array
        True page coordinates of the corners.
    """
    known = np.isfinite(found).all(axis=1)
    places = found[known][:, ::-1].T
    mapped = np.stack([map_coordinates(true_uv[..., k], places, order=1, cval=np.nan) for k in range(2)], axis=-1)
    squared = ((mapped - corners_mm[known]) ** 2).sum(axis=1)
    return float(np.sqrt(np.nanmean(squared)))

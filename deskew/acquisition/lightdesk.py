"""Which camera pixels show the page when the desk is as light as the page: by height, and by a light unlike the desk's.

A light page on a light desk has hardly an edge of its own. But the desk is a plane, Z = 0, and an evenly shaded one:
what rises above it is page, and so is what is lighter or darker than the desk's own light there, unless it is a shadow
that the page casts on the desk. Where the page lies flat on a desk of its own shade neither cue is left.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from deskew import projection
from deskew.acquisition.grey import grey_levels
from deskew.acquisition.pagemask import Mask, largest_filled, one_page
from deskew.errors import StepError
from deskew.types import Array, DepthMap, Floats, Pinhole

# Above this height a measured point is no desk [mm]: several times the error of depth beside an edge.
RAISED_MM = 0.8
# Share of the desk's own light by which a pixel must differ, and standard deviations of the desk's scatter.
UNLIKE_SHARE, UNLIKE_SIGMA = 0.025, 5.0
# What has less than this share of the desk's light is in shadow.
SHADOW_SHARE = 0.35
# Width of a shadow's soft edge, both sides together [px].
PENUMBRA_PX = 7
# Notches narrower than this are pixels without depth, of the desk's own shade [px].
NOTCH_PX = 17
# A desk that gives back more than this share of the page's light is light: the page is no longer by far the brightest.
LIGHT_SHARE = 0.15
# Border over the border of the convex hull: sides of crumpled pages run in and out by less.
PERIMETER_MAX = 1.06


def light_desk_page(white: Array, black: Array, camera: Pinhole, depth: DepthMap) -> Mask:
    """Find the page as what is not desk, by height and by light.

    Parameters
    ----------
    white, black : (height, width[, 3]) arrays
        The scene under the fully lit and the dark projector.
    camera : Pinhole
        The raw camera.
    depth : DepthMap
        Of the same scene, in the world whose Z = 0 is the desk.

    Returns
    -------
    (height, width) bool array
        True on the page, raw pixels.

    Raises
    ------
    StepError
        If what is not desk cannot be one whole page.
    """
    lit = grey_levels(white).astype(np.float64) - grey_levels(black)
    height = _heights(camera, depth)
    raised = height > RAISED_MM
    # Single points stray: a raised pixel needs raised neighbours.
    raised = cv2.blur(raised.astype(np.float64), (3, 3)) > 0.5
    low = np.abs(height) < RAISED_MM / 2
    smooth = cv2.GaussianBlur(lit, (0, 0), 1.0)
    level, scatter = _desk_light(smooth, low & ~raised)
    margin = np.maximum(UNLIKE_SHARE * level, UNLIKE_SIGMA * scatter)
    # A shadow's soft edge is darker than the desk too, as is that of the projector's frame: both are narrow.
    shadow = cv2.dilate((smooth < SHADOW_SHARE * level).astype(np.uint8), _disc(PENUMBRA_PX))
    darker = _opened((level - smooth > margin) & (shadow == 0), PENUMBRA_PX + 2)
    found = largest_filled(_opened(raised | (smooth - level > margin) | darker, 5))
    # With desk all round: at a border of its own OpenCV would close the page to the picture's edge.
    framed = cv2.morphologyEx(np.pad(found, NOTCH_PX).astype(np.uint8), cv2.MORPH_CLOSE, _disc(NOTCH_PX))
    page = one_page(framed[NOTCH_PX:-NOTCH_PX, NOTCH_PX:-NOTCH_PX] > 0)
    _require_smooth(page)
    return page


def is_light(white: Array, black: Array) -> bool:
    """Tell whether the desk, which fills the picture's rim, is too light for a page to stand out by light alone."""
    lit = grey_levels(white).astype(np.float64) - grey_levels(black)
    margin = max(4, round(0.01 * lit.shape[1]))
    rim = np.concatenate(
        [lit[:margin].ravel(), lit[-margin:].ravel(), lit[:, :margin].ravel(), lit[:, -margin:].ravel()]
    )
    return bool(np.median(rim) > LIGHT_SHARE * np.percentile(lit, 99))


def _disc(width: int) -> npt.NDArray[np.uint8]:
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (width, width)), dtype=np.uint8)


def _opened(mask: Mask, width: int) -> Mask:
    """Drop what is narrower than a disc."""
    return np.asarray(cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, _disc(width)) > 0)


def _require_smooth(page: Mask) -> None:
    """Refuse a mask whose border runs in and out: that is print on a page whose own border does not show."""
    contours, _ = cv2.findContours(page.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    contour = cv2.approxPolyDP(max(contours, key=len), 1.5, True)
    ratio = cv2.arcLength(contour, True) / cv2.arcLength(cv2.convexHull(contour), True)
    if ratio > PERIMETER_MAX:
        raise StepError(
            f"Page outline: what stands out from the desk has a border {ratio:.2f} times as long as a page's "
            f"(at most {PERIMETER_MAX}); the desk is as light as the page: use a darker desk or give a mask."
        )


def _heights(camera: Pinhole, depth: DepthMap) -> Floats:
    """Z of every raw pixel [mm], NaN where there is no depth; nearest neighbours, since heights jump at the edge."""
    grid = projection.pixel_grid(depth.camera.size)
    z = (projection.centre(depth.camera) + depth.z[..., None] * projection.rays(depth.camera, grid))[..., 2]
    ideal = depth.camera.K
    places = projection.undistort(camera, projection.pixel_grid(camera.size)) @ ideal[:2, :2].T + ideal[:2, 2]
    x, y = (places[..., k].astype(np.float32) for k in range(2))
    raw = cv2.remap(z, x, y, cv2.INTER_NEAREST, borderMode=cv2.BORDER_CONSTANT, borderValue=np.nan)
    return np.asarray(raw)


def _desk_light(smooth: Floats, low: Mask) -> tuple[Floats, float]:
    """Light of the bare desk everywhere, and its scatter: a cubic surface through low pixels beside the frame.

    The page may lie low too, so the fit starts at the picture's rim and keeps to what is like it.
    """
    height, width = smooth.shape
    y, x = np.mgrid[-1 : 1 : height * 1j, -1 : 1 : width * 1j]
    terms = np.stack([x**i * y**j for i in range(4) for j in range(4 - i)], axis=-1)
    rim = np.zeros(smooth.shape, dtype=bool)
    margin = max(4, round(0.02 * width))
    rim[:margin], rim[-margin:], rim[:, :margin], rim[:, -margin:] = True, True, True, True
    chosen = rim & low
    if chosen.sum() < 64:
        return np.zeros(smooth.shape), np.inf
    level: Floats = np.full(smooth.shape, np.median(smooth[chosen]))
    scatter = np.inf
    kept = chosen
    for n_terms in (1, 3, 10, 10, 10, 10):
        order = terms if n_terms == 10 else terms[..., [0, 1, 4][:n_terms]]
        coefficients, *_ = np.linalg.lstsq(order[kept], smooth[kept], rcond=None)
        level = order @ coefficients
        residual = np.abs(smooth - level)
        scatter = 1.4826 * float(np.median(residual[kept]))
        kept = chosen & (residual < 3.0 * scatter + 0.5)
    return np.asarray(level), scatter

"""Which camera pixels show the page: a light page on a dark desk, with shaded facets and ink on it.

A global threshold such as Otsu's takes the dark facets of a steeply crumpled page for desk. What is known is the desk:
it fills the picture's frame. Everything that stands out from it by a margin is page, and ink inside is a hole to fill.
"""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
from scipy import ndimage

from deskew.acquisition.grey import grey_levels
from deskew.errors import StepError, require
from deskew.types import Array, Floats

Mask = npt.NDArray[np.bool_]

# Share of the page's contrast by which a pixel must outshine the desk: a facet 75 degrees off the light keeps .26.
MARGIN = 0.12
# ... and how many standard deviations of the desk's own scatter, whichever is more.
MARGIN_SIGMA = 6.0
# Smallest page: its share of the picture, and of its own convex hull. A crumpled page keeps more than .95 of its hull.
AREA_MIN = 0.02
SOLIDITY_MIN = 0.88
# Contrast below which there is no page but only the desk's grain, as a share of the white frame's brightest level.
CONTRAST_MIN = 0.08


def _quadratic_surface(values: Floats, chosen: Mask) -> Floats:
    """Fit a quadratic in x and y to the chosen pixels and evaluate it everywhere: a desk under a lamp falls off so."""
    height, width = values.shape
    y, x = np.mgrid[-1 : 1 : height * 1j, -1 : 1 : width * 1j]
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=-1)
    coefficients, *_ = np.linalg.lstsq(terms[chosen], values[chosen], rcond=None)
    return np.asarray(terms @ coefficients)


def _above_desk(frame: Floats) -> tuple[Mask, float, float]:
    """Return the pixels that outshine the desk, the page's contrast over it and the threshold used [grey levels]."""
    smooth = cv2.GaussianBlur(frame, (0, 0), 1.0)
    rim = np.ones(frame.shape, dtype=bool)
    rim[4:-4, 4:-4] = False
    level = np.full(frame.shape, np.median(smooth[rim]))
    for _ in range(4):
        excess = smooth - level
        contrast = float(np.percentile(excess, 99))
        scatter = 1.4826 * float(np.median(np.abs(excess[rim] - np.median(excess[rim]))))
        threshold = max(MARGIN * contrast, MARGIN_SIGMA * scatter)
        # The blur carries the page's light some pixels out: keep those out of the desk's fit.
        desk = ~cv2.dilate((excess > threshold).astype(np.uint8), np.ones((9, 9), np.uint8)).astype(bool)
        if desk.sum() < 64:
            break
        level = _quadratic_surface(smooth, desk)
    return smooth - level > threshold, contrast, threshold


def require_page_shape(mask: Mask) -> None:
    """Check that a mask can be one page: not empty, off the picture's border, large enough, nearly convex.

    Parameters
    ----------
    mask : (height, width) bool array
        True on the page; one connected component.

    Raises
    ------
    StepError
        Naming the finding and what to do about it.
    """
    edges = {"left": mask[:, 0], "right": mask[:, -1], "top": mask[0], "bottom": mask[-1]}
    touched = [name for name, pixels in edges.items() if pixels.any()]
    if touched:
        raise StepError(
            f"Page outline: the page touches the picture's {' and '.join(touched)} border; "
            "move it or the camera until desk shows all round, or give a mask."
        )
    share = float(mask.mean())
    if share < AREA_MIN:
        raise StepError(
            f"Page outline: the largest light region covers {share:.2%} of the picture, {AREA_MIN:.0%} needed; "
            "move the camera closer, use a darker desk, or give a mask."
        )
    contours, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    contour = max(contours, key=len).reshape(-1, 1, 2)
    solidity = cv2.contourArea(contour) / cv2.contourArea(cv2.convexHull(contour))
    if solidity < SOLIDITY_MIN:
        raise StepError(
            f"Page outline: the light region fills {solidity:.0%} of its convex hull, a page {SOLIDITY_MIN:.0%}; "
            "clear the desk, leave a light margin around the ink, or give a mask."
        )


def largest_filled(mask: npt.NDArray[Any]) -> Mask:
    """Return a mask's largest 4-connected component with its holes (ink, dark facets) filled."""
    labels, n = ndimage.label(mask)
    if n == 0:
        return np.zeros(mask.shape, dtype=bool)
    sizes = np.bincount(labels.ravel())
    sizes[0] = 0
    return np.asarray(ndimage.binary_fill_holes(labels == int(sizes.argmax())), dtype=bool)


def one_page(mask: Mask) -> Mask:
    """Return the one whole page that a mask of scattered finds shows: closed, filled, opened and checked.

    Raises
    ------
    StepError
        If it cannot be one whole page.
    """
    # A dark strip of margin beside ink may be broken by noise: close it, so that the ink becomes a hole and is filled.
    # Only then may an opening drop the specks that hang on the page by single pixels.
    whole = largest_filled(_morphology(mask, cv2.MORPH_CLOSE))
    page = largest_filled(_morphology(whole, cv2.MORPH_OPEN))
    require_page_shape(page)
    return page


def _morphology(mask: Mask, operation: int) -> npt.NDArray[np.uint8]:
    """Open or close by a disc of 2 pixels; OpenCV's border is neutral, so a page that touches it still does."""
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (5, 5))
    return np.asarray(cv2.morphologyEx(mask.astype(np.uint8), operation, disc), dtype=np.uint8)


def page_mask(white: Array, black: Array) -> Mask:
    """Find the page in the fully lit frame; what lies in shadow there may still show in ambient light in the dark one.

    Parameters
    ----------
    white, black : (height, width[, 3]) arrays
        The scene under the fully lit and the dark projector, any dtype.

    Returns
    -------
    (height, width) bool array
        True on the page, in raw pixels: the largest region above the desk's level plus a margin, holes filled.

    Raises
    ------
    InputError
        If the frames differ in shape or are smaller than 32 pixels.
    StepError
        If nothing stands out from the desk, or what does cannot be one whole page.
    """
    require(white.ndim in (2, 3) and min(white.shape[:2]) >= 32, "white", "be at least 32 x 32 pixels", white.shape)
    require(black.shape == white.shape, "black", f"have white's shape {white.shape}", black.shape)
    lit, dark = (grey_levels(image).astype(np.float64) for image in (white, black))
    mask, contrast, _ = _above_desk(lit)
    needed = CONTRAST_MIN * float(lit.max())
    if contrast < needed or not mask.any():
        raise StepError(
            f"Page outline: no page found, the picture outshines the desk by {contrast:.3g} grey levels and "
            f"{needed:.3g} are needed; light the page, use a darker desk, or give a mask."
        )
    ambient, ambient_contrast, threshold = _above_desk(dark)
    # Ambient light tells page from desk only if the page clears the threshold well, not when its own grain sets it.
    if ambient_contrast > 2 * threshold:
        mask |= ambient
    return one_page(mask)

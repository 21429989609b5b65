"""Which material lies where on a page: a darker leaf set in a lighter sleeve, told apart by how much light they return.

Light falls on a bent page unevenly, and dark facets of the sleeve may be darker than bright ones of the leaf: take the
shading out of the picture first, which the known shape allows. What is written is darker than either material.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from deskew.acquisition.grey import grey_levels
from deskew.acquisition.pagemask import Mask, largest_filled
from deskew.errors import StepError, require
from deskew.types import Array, Floats

# Shares of the page's width, the square root of its area: what is narrower than the first is ink, and a border turns no
# sharper than the second.
_INK, _BORDER = 0.02, 0.01
# Percentiles beyond which levels are large initials and glare, not a material.
_LEVELS = 10.0, 99.0
# Materials whose reflectances differ by less than this ratio, and leaves of less than this share of the page, are none.
_CONTRAST_MIN = 1.1
_SHARE_MIN = 0.02


def page_leaf(image: Array, page: Mask) -> Mask:
    """Find the darker of two materials, a leaf, on a page that otherwise is of the lighter one.

    Parameters
    ----------
    image : (height, width[, 3]) array
        The page under white light without its shading, any dtype.
    page : (height, width) bool array
        The page's pixels.

    Returns
    -------
    (height, width) bool array
        The leaf: one piece without holes, what is written on it included.

    Raises
    ------
    StepError
        If the page does not show two materials.
    """
    grey = grey_levels(image).astype(np.float32)
    require(page.shape == grey.shape and page.dtype == np.bool_, "page", f"be bool of shape {grey.shape}", page.shape)
    require(bool(page.any()), "page", "show a page", "no pixel")
    width = float(np.sqrt(page.sum()))
    # The desk is dark too, and must not eat into the page's border when what is dark and narrow is closed.
    bare = cv2.morphologyEx(np.where(page, grey, 0.0).astype(np.float32), cv2.MORPH_CLOSE, _disc(_INK * width))
    levels = np.clip(bare[page], *np.percentile(bare[page], _LEVELS))
    threshold = _otsu(levels)
    dark, light = levels[levels < threshold], levels[levels >= threshold]
    contrast = float(np.median(light) / max(np.median(dark), 1e-6)) if len(dark) and len(light) else 1.0
    leaf = largest_filled(_smoothed(page & (bare < threshold), _BORDER * width)) & page
    share = float(leaf.sum() / page.sum())
    if contrast < _CONTRAST_MIN or not _SHARE_MIN < share < 1.0 - _SHARE_MIN:
        raise StepError(
            f"Materials: the page does not show two of them; the darker part covers {share:.0%} of it, and the rest "
            f"returns {contrast:.2f} times its light. Give a map of the materials."
        )
    return leaf


def _disc(radius_px: float) -> npt.NDArray[np.uint8]:
    n = 2 * max(1, round(radius_px)) + 1
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (n, n)), dtype=np.uint8)


def _otsu(values: Floats) -> float:
    """Return the threshold that parts values into two groups of the least scatter (Otsu 1979)."""
    counts, edges = np.histogram(values, bins=256)
    below = np.cumsum(counts).astype(np.float64)
    above = below[-1] - below
    sums = np.cumsum(counts * (edges[1:] + edges[:-1]) / 2)
    gap = sums / np.maximum(below, 1.0) - (sums[-1] - sums) / np.maximum(above, 1.0)
    return float(edges[1:][np.argmax(below * above * gap**2)])


def _smoothed(mask: Mask, radius_px: float) -> npt.NDArray[np.uint8]:
    """Round a mask's border off, inwards and outwards alike."""
    disc = _disc(radius_px)
    closed = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_CLOSE, disc)
    return np.asarray(cv2.morphologyEx(closed, cv2.MORPH_OPEN, disc), dtype=np.uint8)

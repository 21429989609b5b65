"""The two pictures that the document-unwarping field compares: grey, of 8 bits, both of one size of 598,400 pixels.

The field's programs (DocUNet's `evalUnwarp`, PaperEdge, DocScanner) are Matlab's, and published figures differ between
its versions. What is taken from them here: `rgb2gray` (Rec. 601, rounded), `imresize` (cubic with a = -0.5, widened
where it makes smaller so that nothing is aliased, weights of sum 1, borders mirrored, rounded to 8 bits).

One thing is not. Matlab resizes the scan by a factor, rounding its size up, and the restored picture to the size that
comes out: two factors, up to a pixel apart at the far border, so that equal pictures differ after it. Here the size is
rounded to the nearest, and pictures of one size are resized by one factor: what is equal stays equal.

References
----------
K. Ma, Z. Shu, X. Bai, J. Wang, D. Samaras, DocUNet: Document Image Unwarping via a Stacked U-Net, CVPR 2018.

R. G. Keys, Cubic Convolution Interpolation for Digital Image Processing, IEEE Trans. ASSP 29 (1981), eq. 15.
"""

from __future__ import annotations

import math

import cv2
import numpy as np

from deskew.errors import require
from deskew.types import Array, Floats

AREA_PX = 598_400
"""Pixels of either picture when they are compared."""

# The coarsest of MS-SSIM's five levels is then as large as SSIM's window of 11 pixels.
_LONGEST_RATIO = 19.0


def grey(name: str, image: Array) -> Array:
    """Return a picture's grey levels.

    Parameters
    ----------
    name : str
        What it is called in errors.
    image : (height, width[, 3]) array
        Grey or RGB, uint8 or uint16.

    Returns
    -------
    (height, width) uint8 array
    """
    shaped = image.ndim == 2 or (image.ndim == 3 and image.shape[2] == 3)
    sound = shaped and image.dtype in (np.uint8, np.uint16) and image.size > 0
    require(sound, name, "be (height, width[, 3]) of 8 or 16 bits", f"{image.dtype} of shape {image.shape}")
    levels = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    return np.asarray(levels if levels.dtype == np.uint8 else np.rint(levels / 257.0).astype(np.uint8))


def compared(restored: Array, scan: Array) -> tuple[Array, Array]:
    """Make two pictures comparable: grey, and as large as the scan is when it has 598,400 pixels.

    Parameters
    ----------
    restored, scan : (height, width[, 3]) arrays
        Grey or RGB, uint8 or uint16; of whatever sizes.

    Returns
    -------
    two (H, W) uint8 arrays
        `restored`, `scan`; H W is 598,400 but for rounding, H : W the scan's.

    Raises
    ------
    InputError
        If either is no picture, or the scan's sides are in a ratio over 19.
    """
    pictures = grey("restored", restored), grey("scan", scan)
    height, width = pictures[1].shape
    ratio = max(height, width) / min(height, width)
    require(ratio <= _LONGEST_RATIO, "scan", f"have sides in a ratio up to {_LONGEST_RATIO:g}", f"{width}x{height} px")
    factor = math.sqrt(AREA_PX / (height * width))
    shape = round(height * factor), round(width * factor)
    first, second = (np.rint(resized(picture, shape)).clip(0, 255).astype(np.uint8) for picture in pictures)
    return first, second


def resized(image: Array, shape: tuple[int, int]) -> Floats:
    """Resample a picture as Matlab's `imresize` does with its defaults.

    Parameters
    ----------
    image : (height, width) array
        Grey.
    shape : (int, int)
        Rows and columns wanted.

    Returns
    -------
    array of that shape
        Not rounded; a cubic may overshoot the range of the levels.
    """
    return _along_rows(_along_rows(image.astype(np.float64), shape[0]).T, shape[1]).T


def _along_rows(image: Floats, n_wanted: int) -> Floats:
    """Resample the first axis."""
    n = len(image)
    if n == n_wanted:
        return image
    factor = n_wanted / n
    narrow = min(factor, 1.0)  # below 1 the kernel covers as many pixels more
    n_taps = math.ceil(4.0 / narrow) + 2
    centres = (np.arange(n_wanted) + 0.5) / factor - 0.5
    taps = np.floor(centres - 2.0 / narrow).astype(np.int64)[:, None] + np.arange(n_taps)
    weights = _cubic(narrow * (centres[:, None] - taps))
    weights /= weights.sum(axis=1, keepdims=True)
    rows = taps % (2 * n)
    rows = np.where(rows < n, rows, 2 * n - 1 - rows)  # the border's own row is mirrored too
    out = np.zeros((n_wanted, image.shape[1]))
    for k in range(n_taps):
        out += weights[:, k, None] * image[rows[:, k]]
    return out


def _cubic(x: Floats) -> Floats:
    """Keys' cubic convolution kernel, a = -1/2."""
    x = np.abs(x)
    inner, outer = (1.5 * x - 2.5) * x**2 + 1.0, ((-0.5 * x + 2.5) * x - 4.0) * x + 2.0
    return np.where(x <= 1.0, inner, np.where(x < 2.0, outer, 0.0))

"""Read an image between its pixels by Keys's cubic convolution.

OpenCV's remap rounds positions to 1/32 pixel, a third of what the best restoration is off; this kernel does not. Keys's
a = -1/2 is exact for quadratics and overshoots an edge by at most 7 %.

References
----------
Keys, Cubic convolution interpolation for digital image processing, IEEE Trans. ASSP 29 (1981), equation 15.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt
from numba import njit

from deskew.errors import require
from deskew.types import Array, Floats, Size


@njit(cache=True)
def _weights(f: float, w: Floats) -> None:
    w[0] = ((-0.5 * f + 1.0) * f - 0.5) * f
    w[1] = (1.5 * f - 2.5) * f * f + 1.0
    w[2] = ((-1.5 * f + 2.0) * f + 0.5) * f
    w[3] = (0.5 * f - 0.5) * f * f


@njit(cache=True)
def _sample(image: Floats, xs: Floats, ys: Floats, out: Floats) -> None:
    """Image (h, w, c) at n places into out (n, c); beyond the border its last pixel repeats; NaN gives 0."""
    h, w, channels = image.shape
    wx, wy = np.empty(4), np.empty(4)
    for n in range(xs.size):
        x, y = xs[n], ys[n]
        if not (np.isfinite(x) and np.isfinite(y)):
            for c in range(channels):
                out[n, c] = 0.0
            continue
        ix, iy = int(np.floor(x)), int(np.floor(y))
        _weights(x - ix, wx)
        _weights(y - iy, wy)
        for c in range(channels):
            total = 0.0
            for j in range(4):
                row = min(max(iy + j - 1, 0), h - 1)
                line = 0.0
                for i in range(4):
                    line += wx[i] * image[row, min(max(ix + i - 1, 0), w - 1), c]
                total += wy[j] * line
            out[n, c] = total


def sample_image(image: Array, pixels: npt.NDArray[np.float32], camera_size: Size, step_px: float) -> Array:
    """Read an image of any resolution at raw camera pixels.

    Parameters
    ----------
    image : (h, w[, channels]) array
        Any dtype and depth; the same view as the camera's, at `h / height` times its resolution.
    pixels : (H, W, 2) float32 array
        Raw camera pixels (x, y), NaN where there is nothing to read.
    camera_size : (width, height)
        Size of the camera that `pixels` refers to.
    step_px : float
        Distance of neighbouring places in camera pixels; finer image detail than that is smoothed away first.

    Returns
    -------
    (H, W[, channels]) array
        The image's dtype, rounded and clipped to its range if integer; 0 where `pixels` is NaN.
    """
    require(image.ndim in (2, 3), "image", "be (height, width[, channels])", image.shape)
    known = image.dtype.kind in "uif" and image.dtype.itemsize <= 8
    require(known, "image", "hold integers or floats", image.dtype)
    (width, height), (h, w) = camera_size, image.shape[:2]
    factor = w / width
    require(
        abs(h - factor * height) <= 1.0, "image", f"have the aspect of the camera's {width} x {height}", f"{w} x {h}"
    )
    # Pixel centres sit at integers, so a change of resolution is about the corner at (-1/2, -1/2).
    places = (pixels.astype(np.float64) + 0.5) * np.array([factor, h / height]) - 0.5
    return read_at(image, places, step_px * factor)


def read_at(image: Array, places: Floats, step_px: float) -> Array:
    """Read an image at its own pixels.

    Parameters
    ----------
    image : (h, w[, channels]) array
        Integers or floats.
    places : (..., 2) array
        Pixels (x, y) of the image, NaN where there is nothing to read.
    step_px : float
        Distance of neighbouring places in the image's pixels; finer detail than that is smoothed away first.

    Returns
    -------
    (...[, channels]) array
        The image's dtype, rounded and clipped to its range if integer; 0 where `places` is NaN.
    """
    source = np.atleast_3d(image).astype(np.float64)
    if step_px > 1.0:
        blurred = cv2.GaussianBlur(source, (0, 0), 0.5 * float(np.sqrt(step_px**2 - 1.0)))
        source = blurred.reshape(source.shape)
    xs, ys = (np.ascontiguousarray(places[..., k].ravel(), dtype=np.float64) for k in range(2))
    out = np.empty((len(xs), source.shape[2]))
    _sample(np.ascontiguousarray(source), xs, ys, out)
    if image.dtype.kind in "ui":
        limits = np.iinfo(image.dtype)
        out = np.clip(np.rint(out), limits.min, limits.max)
    return np.asarray(out.astype(image.dtype).reshape(places.shape[:-1] + image.shape[2:]))

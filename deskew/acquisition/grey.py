"""Grey levels of whatever the camera recorded: the one place where colour becomes grey."""

from __future__ import annotations

import numpy as np

from deskew.errors import require
from deskew.types import Array


def grey_levels(image: Array, name: str = "image") -> Array:
    """Return an image as one channel of its own type.

    Green counts twice, red and blue once: close to luminance, and the same for RGB and BGR files. A pixel of whole
    numbers that clips in any channel clips here, or an average would hide it.

    Parameters
    ----------
    image : (height, width[, 3]) array of uint8, uint16 or floats
        Grey or colour.
    name : str
        What an error calls it.

    Returns
    -------
    (height, width) array
        Of the image's type.
    """
    require(isinstance(image, np.ndarray), name, "be an array of grey levels", type(image).__name__)
    kind = image.dtype
    require(kind in (np.uint8, np.uint16) or kind.kind == "f", name, "be of type uint8, uint16 or float", kind)
    require(image.size > 0, name, "have at least 1 pixel", image.shape)
    require(kind.kind != "f" or bool(np.isfinite(image).all()), name, "be finite", "NaN or infinity")
    if image.ndim == 2:
        return np.ascontiguousarray(image)
    require(image.ndim == 3 and image.shape[2] == 3, name, "be (height, width[, 3])", image.shape)
    if kind.kind == "f":
        return np.asarray((image[..., 0] + 2 * image[..., 1] + image[..., 2]) / 4)
    first, green, last = (image[..., i].astype(np.uint32) for i in range(3))
    grey = ((first + 2 * green + last + 2) // 4).astype(kind)
    top = np.iinfo(kind).max
    grey[(image == top).any(axis=2)] = top
    return grey

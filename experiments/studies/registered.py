"""How far a registered image of another format is off."""

from __future__ import annotations

import numpy as np

from deskew.restoration import Registration
from deskew.types import Floats, Size


def map_error(found: Registration, true: Floats, size: Size) -> float:
    """Root mean square over the scan's picture of the distance between the found and the true place [texture px].

    Parameters
    ----------
    found : Registration
        Scan pixel to texture pixel, as found.
    true : (2, 3) array
        The same, as it is.
    size : (width, height)
        Of the scan [px].
    """
    pixels = np.stack(np.meshgrid(*(np.linspace(0, n - 1, 41) for n in size)), axis=-1)
    error = found.to_texture(pixels) - (pixels @ true[:, :2].T + true[:, 2])
    return float(np.sqrt((error**2).sum(axis=-1).mean()))

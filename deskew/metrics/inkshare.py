"""How dark each pixel is beside the paper round it: print without the light that falls on it."""

from __future__ import annotations

import cv2
import numpy as np

from deskew.types import Array, Floats


def ink_share(grey: Array, reach_px: int) -> Floats:
    """Return 1 - level / white, white being that of the brightest paper within reach.

    Lighting the page more or less, evenly or not, changes little of it: a shadow is as dark beside the paper in it as
    the paper itself.

    Parameters
    ----------
    grey : (height, width) uint8 array
        A page, dark on light.
    reach_px : int
        Half the side of the square in which the white is sought [px]; more than the breadth of a stroke.

    Returns
    -------
    (height, width) float32 array
        In [0, 1]; 0 on bare paper.
    """
    levels = np.asarray(grey, np.float32) + 1.0  # black has a share of less than 1, and no paper one of 0
    # Smoothed first: the brightest of many noisy pixels is brighter than paper is.
    smooth = cv2.GaussianBlur(levels, (0, 0), 1.0, borderType=cv2.BORDER_REPLICATE)
    white = cv2.dilate(smooth, np.ones((2 * reach_px + 1, 2 * reach_px + 1), np.uint8))
    white = cv2.GaussianBlur(white, (0, 0), 0.7 * reach_px, borderType=cv2.BORDER_REPLICATE)
    return np.asarray(np.clip(1.0 - levels / white, 0.0, 1.0))

"""A dewarper: a picture in, the flat page's picture out. It knows of no shape, as a network would not."""

import cv2
import numpy as np

from deskew import dewarper


@dewarper
def rectify(image: np.ndarray) -> np.ndarray:
    """Stretch what lies between the four corners of the bright page over a rectangle."""
    grey = cv2.normalize(image, None, 0, 255, cv2.NORM_MINMAX).astype(np.uint8)
    grey = grey if grey.ndim == 2 else cv2.cvtColor(grey, cv2.COLOR_RGB2GRAY)
    _, bright = cv2.threshold(grey, 0, 255, cv2.THRESH_OTSU)
    outlines, _ = cv2.findContours(bright, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    page = max(outlines, key=cv2.contourArea).reshape(-1, 2)

    # The corners lie farthest out along the diagonals: top left, top right, bottom right, bottom left.
    corners = np.float32([page[np.argmax(page @ out)] for out in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    top, right, bottom, left = np.linalg.norm(corners - np.roll(corners, -1, axis=0), axis=1)
    width, height = round(max(top, bottom)), round(max(left, right))
    flat = np.float32([(0, 0), (width - 1, 0), (width - 1, height - 1), (0, height - 1)])
    stretch = cv2.getPerspectiveTransform(corners, flat)
    return cv2.warpPerspective(image, stretch, (width, height), flags=cv2.INTER_CUBIC)

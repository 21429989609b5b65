"""A page of text drawn line by line, and smooth warps of it."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from deskew.types import Array, Floats

WIDTH, HEIGHT = 880, 680  # 598,400 pixels: nothing is resized
MARGIN = 40
Warp = Callable[[Floats, Floats], Floats]


def printed_page(seed: int = 0, line_px: int = 40) -> Array:
    """Draw lines of capitals from margin to margin, black on white, (HEIGHT, WIDTH) uint8."""
    rng = np.random.default_rng(seed)
    page = np.full((HEIGHT, WIDTH), 235, np.uint8)
    for y in range(60, HEIGHT - 30, line_px):
        x = MARGIN
        while x < WIDTH - MARGIN - 15:
            letter = str(rng.choice(list("ABDEFHKLMNPRTXZ")))
            cv2.putText(page, letter, (x, y), cv2.FONT_HERSHEY_SIMPLEX, 0.8, 30, 2, cv2.LINE_AA)
            x += int(rng.choice([20, 22, 36], p=[0.4, 0.45, 0.15]))
    return page


def warped(page: Array, along: Warp, down: Warp) -> Array:
    """Draw at each place (x, y) what the page shows at (x - along(x, y), y - down(x, y))."""
    x, y = np.meshgrid(np.arange(float(page.shape[1])), np.arange(float(page.shape[0])))
    where = (x - along(x, y)).astype(np.float32), (y - down(x, y)).astype(np.float32)
    return np.asarray(cv2.remap(page, *where, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE))


def still(x: Floats, y: Floats) -> Floats:
    """No displacement."""
    return 0.0 * x

"""Figures as pictures in the page: WebP, exact where that is small, and no larger than a page shows."""

from __future__ import annotations

from base64 import b64encode
from dataclasses import dataclass
from pathlib import Path

import cv2

from deskew.errors import require
from deskew.io import read_image
from deskew.types import Array

# A diagram is kept exact; a page of photographs, which would take more, is not, and one that large is not tried.
_EXACT_BYTES, _EXACT_PIXELS = 60_000, 1_000_000
_QUALITY, _WIDTH_MAX_PX = 50, 1300
_LOSSLESS = 101  # OpenCV's own number for it


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture that an `<img>` holds itself.

    Attributes
    ----------
    source : str
        A `data:` address.
    width, height : int
        Pixels.
    """

    source: str
    width: int
    height: int


def figure_picture(path: Path) -> Picture:
    """Return a figure of a report: exact if that takes little, else smaller and lossy.

    Raises
    ------
    InputError
        If the file is no picture.
    """
    image = read_image(path)
    if image.shape[0] * image.shape[1] <= _EXACT_PIXELS:
        exact = _webp(image, _LOSSLESS)
        if len(exact) <= _EXACT_BYTES:
            return _picture(image, exact)
    factor = min(1.0, _WIDTH_MAX_PX / image.shape[1])
    small = cv2.resize(image, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
    return _picture(small, _webp(small, _QUALITY))


def photograph(image: Array, quality: int = 75) -> Picture:
    """Return a photograph, (h, w) grey or (h, w, 3) RGB uint8, lossy at a quality of 1 to 100."""
    return _picture(image, _webp(image, quality))


def _webp(image: Array, quality: int) -> bytes:
    ok, data = cv2.imencode(
        ".webp", image[..., ::-1] if image.ndim == 3 else image, [cv2.IMWRITE_WEBP_QUALITY, quality]
    )
    require(bool(ok), "image", "be one that WebP can hold", image.shape)
    return data.tobytes()


def _picture(image: Array, data: bytes) -> Picture:
    return Picture(f"data:image/webp;base64,{b64encode(data).decode()}", image.shape[1], image.shape[0])

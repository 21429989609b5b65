"""Pictures for the page: the photograph, the materials over it, and quantities in colours between two limits."""

from __future__ import annotations

import math

import cv2
import numpy as np
import numpy.typing as npt

from deskew.types import Array, Floats

Rgba = npt.NDArray[np.uint8]

COLOURS = ((0, 0, 0), (230, 159, 0), (86, 180, 233), (0, 158, 115), (240, 228, 66), (0, 114, 178), (213, 94, 0),
           (204, 121, 167))  # fmt: skip
"""Of the materials, in their order, told apart by the colour-blind too (Okabe and Ito); the page's own is clear."""

BELOW, ZERO, ABOVE = (5, 78, 138), (247, 247, 247), (146, 61, 0)
"""Ends and middle of the scale of colours: blue below zero, brown above."""


_DESK_GREY = 128


def eight_bits(image: Array) -> npt.NDArray[np.uint8]:
    """Show a picture of 8 or 16 bits with 8."""
    return np.asarray(image if image.dtype == np.uint8 else image >> 8, np.uint8)


def grey(image: Array) -> Floats:
    """Grey levels of 255, (H, W), of a picture of 8 or 16 bits."""
    levels = image.astype(np.float64) / (1.0 if image.dtype == np.uint8 else 257.0)
    return np.asarray(levels if levels.ndim == 2 else levels.mean(axis=-1))


def shrunk(image: Array, longest: int) -> Array:
    """Make a picture smaller until its longer side has at most `longest` pixels."""
    share = min(1.0, longest / max(image.shape[:2]))
    if share == 1.0:
        return image
    size = (round(image.shape[1] * share), round(image.shape[0] * share))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA))


def on_a_desk(image: npt.NDArray[np.uint8], page: npt.NDArray[np.bool_]) -> npt.NDArray[np.uint8]:
    """Show a picture where there is page, and an even grey round it."""
    off = ~page if image.ndim == 2 else ~page[..., None]
    return np.where(off, np.uint8(_DESK_GREY), image)


def overlay(labels: Array, order: list[int], longest: int) -> Rgba:
    """Colour the materials, the page's own, the first of `order`, left clear."""
    share = min(1.0, longest / max(labels.shape))
    size = (round(labels.shape[1] * share), round(labels.shape[0] * share))
    small = labels if share == 1.0 else cv2.resize(labels, size, interpolation=cv2.INTER_NEAREST)
    picture = np.zeros((*small.shape, 4), np.uint8)
    for place, label in enumerate(order[1:], start=1):
        picture[small == label] = (*COLOURS[1 + (place - 1) % (len(COLOURS) - 1)], 255)
    return picture


def limit_of(values: Floats, least: float) -> float:
    """Return a round number that 98 of 100 absolute values do not exceed, `least` at least: the end of a colour bar."""
    finite = np.abs(values[np.isfinite(values)])
    most = max(least, float(np.percentile(finite, 98)) if finite.size else 0.0)
    step = 10.0 ** math.floor(math.log10(most))
    return float(next(n * step for n in (1, 1.5, 2, 3, 4, 5, 6, 8, 10) if n * step >= most * (1 - 1e-9)))


def diverging(values: Floats, limit: float) -> Rgba:
    """Colour values from -limit to limit, what is beyond as the ends; clear where they are not finite."""
    known = np.isfinite(values)
    share = np.clip(np.where(known, values, 0.0) * (_STEPS / limit), -_STEPS, _STEPS)
    return np.asarray(_SCALE[np.where(known, np.rint(share) + _STEPS, -1).astype(np.int16)])


def _scale() -> Rgba:
    """Return the colours of -_STEPS to _STEPS, and last a clear one."""
    share = np.abs(np.linspace(-1.0, 1.0, 2 * _STEPS + 1))[:, None]
    ends = np.where(np.arange(2 * _STEPS + 1)[:, None] < _STEPS, np.array(BELOW, float), np.array(ABOVE, float))
    colours = np.rint(np.array(ZERO, float) + share * (ends - np.array(ZERO, float)))
    opaque = np.column_stack([colours, np.full(len(colours), 255)])
    return np.vstack([opaque, [0, 0, 0, 0]]).astype(np.uint8)


_STEPS = 120
_SCALE = _scale()


def as_png(image: Array) -> bytes:
    """Encode a picture for the page, quickly rather than small; colour in RGB order."""
    swapped = image
    if image.ndim == 3:
        swapped = cv2.cvtColor(image, cv2.COLOR_RGBA2BGRA if image.shape[2] == 4 else cv2.COLOR_RGB2BGR)
    return bytes(cv2.imencode(".png", swapped, [cv2.IMWRITE_PNG_COMPRESSION, 1])[1])


def as_jpeg(image: Array) -> bytes:
    """Encode a photograph for the page, a tenth of a PNG's time and a third of its size; colour in RGB order."""
    swapped = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_RGB2BGR)
    return bytes(cv2.imencode(".jpg", swapped, [cv2.IMWRITE_JPEG_QUALITY, 92])[1])

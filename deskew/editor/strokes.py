"""What one movement of a tool over the photograph covers: brush, rectangle, polygon, or a region of similar colour."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import cv2
import numpy as np
import numpy.typing as npt

from deskew.editor.pictures import shrunk
from deskew.errors import require
from deskew.types import Array, Floats

Mask = npt.NDArray[np.bool_]

MAX_POINTS = 20_000
"""Most points of one movement: five minutes of a mouse that tells its place sixty times a second."""

_SHIFT = 4  # OpenCV draws at sixteenths of a pixel
# Share of the picture's diagonal: grain finer than the first is not colour, and gaps narrower than the second are ink.
_GRAIN, _INK = 0.002, 0.012
_FLOODED = 1800  # longer side of the picture that is flooded [px]; no colour needs more
_HOLE = 0.1  # share of a region's area below which what it surrounds belongs to it


class Tool(StrEnum):
    """What paints."""

    BRUSH = "brush"
    RECTANGLE = "rectangle"
    POLYGON = "polygon"
    SIMILAR = "similar"


_FEWEST = {Tool.BRUSH: 1, Tool.RECTANGLE: 2, Tool.POLYGON: 3, Tool.SIMILAR: 1}


@dataclass(frozen=True, slots=True)
class Stroke:
    """One movement of a tool.

    Attributes
    ----------
    tool : Tool
        What paints.
    points : (N, 2) array
        Places (x, y) in the raw white image [px]: a brush's path, a rectangle's two corners, a polygon's corners, or
        the one place whose like is sought. They may lie outside the picture.
    width : float
        The brush's diameter [px], in [1, 4096].
    tolerance : float
        How far a similar colour may be from the one picked, in each channel [grey levels of 255], in [0, 255].
    """

    tool: Tool
    points: Floats
    width: float = 1.0
    tolerance: float = 0.0

    def __post_init__(self) -> None:
        require(self.tool in list(Tool), "tool", f"be one of {', '.join(Tool)}", repr(self.tool)[:60])
        array = self.points.ndim == 2 and self.points.shape[1] == 2 and self.points.dtype.kind == "f"
        few = _FEWEST[self.tool]
        sound = array and few <= len(self.points) <= MAX_POINTS
        require(sound, "points", f"be {few} to {MAX_POINTS} places (x, y)", self.points.shape)
        near = bool((np.abs(self.points) <= 1e5).all())  # not NaN either
        require(near, "points", "lie within 100000 px", "NaN" if np.isnan(self.points).any() else "farther ones")
        require(1 <= self.width <= 4096, "width", "be in [1, 4096] [px]", self.width)
        require(0 <= self.tolerance <= 255, "tolerance", "be in [0, 255] [grey levels]", self.tolerance)

    def covered(self, picture: Array) -> Mask:
        """Tell which pixels the stroke covers.

        Parameters
        ----------
        picture : (height, width[, 3]) uint8 array
            The photograph; its size counts, and for a region of similar colour its content.

        Returns
        -------
        (height, width) bool array
        """
        mask = np.zeros(picture.shape[:2], np.uint8)
        fixed = np.round(self.points * (1 << _SHIFT)).astype(np.int32)
        if self.tool is Tool.BRUSH and len(fixed) == 1:
            cv2.circle(mask, fixed[0].tolist(), round(self.width / 2 * (1 << _SHIFT)), 1, cv2.FILLED, shift=_SHIFT)
        elif self.tool is Tool.BRUSH:
            cv2.polylines(mask, [fixed], False, 1, max(1, round(self.width)), shift=_SHIFT)
        elif self.tool is Tool.POLYGON:
            cv2.fillPoly(mask, [fixed], 1, shift=_SHIFT)
        elif self.tool is Tool.RECTANGLE:
            left, top = np.maximum(np.round(self.points[:2].min(axis=0)).astype(int), 0)
            right, bottom = np.round(self.points[:2].max(axis=0)).astype(int)
            mask[top : max(bottom, -1) + 1, left : max(right, -1) + 1] = 1
        else:
            mask = _alike(picture, self.points[0], self.tolerance)
        return mask.astype(bool)


def _alike(picture: Array, place: Floats, tolerance: float) -> npt.NDArray[np.uint8]:
    """Flood the region round a place whose colour stays within the tolerance of it, over what is written there."""
    height, width = picture.shape[:2]
    x, y = (round(float(value)) for value in place)
    require(0 <= x < width and 0 <= y < height, "points", f"lie on the photograph of {width}x{height} px", f"{x}, {y}")
    picture = shrunk(picture, _FLOODED)
    share = picture.shape[1] / width
    x, y = (min(int((n + 0.5) * share), most - 1) for n, most in zip((x, y), picture.shape[1::-1], strict=True))
    diagonal = float(np.hypot(*picture.shape[:2]))
    # Closing first: ink is dark and narrow, and must neither be the colour that is picked nor stop the flood.
    ink = _disc(_INK * diagonal)
    bare = cv2.morphologyEx(cv2.medianBlur(picture, 2 * round(_GRAIN * diagonal) + 1), cv2.MORPH_CLOSE, ink)
    flooded = np.zeros((picture.shape[0] + 2, picture.shape[1] + 2), np.uint8)
    channels = 1 if picture.ndim == 2 else picture.shape[2]
    slack = (tolerance,) * channels
    flags = 4 | cv2.FLOODFILL_MASK_ONLY | cv2.FLOODFILL_FIXED_RANGE | 1 << 8
    cv2.floodFill(bare, flooded, (x, y), (0,) * channels, slack, slack, flags)
    region = _without_holes(np.asarray(cv2.morphologyEx(flooded[1:-1, 1:-1], cv2.MORPH_CLOSE, ink), np.uint8))
    return np.asarray(cv2.resize(region, (width, height), interpolation=cv2.INTER_NEAREST), np.uint8)


def _without_holes(region: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """Fill the holes of a region that are small beside it, such as initials; a leaf within a sleeve is no hole."""
    n, pieces, stats, _ = cv2.connectedComponentsWithStats(1 - region, connectivity=4)
    limit = _HOLE * int(region.sum())
    height, width = region.shape
    for piece in range(1, n):
        left, top, across, down, area = stats[piece]
        inside = left > 0 and top > 0 and left + across < width and top + down < height
        if inside and area < limit:
            region[pieces == piece] = 1
    return region


def _disc(diameter: float) -> npt.NDArray[np.uint8]:
    n = 2 * round(diameter / 2) + 1
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (n, n)), np.uint8)

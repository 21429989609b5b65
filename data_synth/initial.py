"""A decorated initial: a letter in a framed panel with vines through it, and a tendril down the margin."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.artist import Artist
from matplotlib.font_manager import FontProperties
from matplotlib.patches import Ellipse, PathPatch, Rectangle
from matplotlib.path import Path
from matplotlib.textpath import TextPath
from matplotlib.transforms import Affine2D

from deskew.types import Floats

# Greys of gold leaf, of the blue or red ground, of ink and of white lead.
_GOLD, _GROUND, _INK, _WHITE = "0.78", "0.36", "0.08", "0.88"
_FONT = FontProperties(family="DejaVu Serif", weight="bold")


def initial(letter: str, left: float, top: float, side: float, rng: np.random.Generator) -> Iterator[Artist]:
    """Draw an initial, from the back to the front, in page coordinates with v turned over.

    Parameters
    ----------
    letter : str
        A capital.
    left, top : float
        Corner (u, v) of the panel [mm].
    side : float
        Of the square panel [mm].
    rng : numpy Generator
        Of how the vines turn.
    """
    bottom = -(top + side)
    yield from _panel(left, bottom, side)
    centre = np.array([left + side / 2, bottom + side / 2])
    for k, turn in enumerate(rng.uniform(0, 2 * np.pi, 4)):
        corner = centre + 0.2 * side * np.array([np.cos(np.pi * (k / 2 + 0.25)), np.sin(np.pi * (k / 2 + 0.25))])
        yield from _vine(corner, 0.17 * side, float(turn), (-1) ** k)
    yield from _letter(letter, centre, 0.68 * side)
    for k in range(4):
        at = centre + 0.48 * side * np.array([(-1) ** k, (-1) ** (k // 2)])
        yield from _boss(at, 0.06 * side)
    yield from _tendril(left - 0.08 * side, bottom - 0.03 * side, 1.6 * side, float(rng.uniform(0, 2 * np.pi)))


def _panel(left: float, bottom: float, side: float) -> Iterator[Artist]:
    """Draw a frame of gold between two lines of ink, and the coloured ground."""
    for inset, grey in ((0.0, _INK), (0.012, _GOLD), (0.07, _INK), (0.082, _GROUND)):
        room = side * (1 - 2 * inset)
        yield Rectangle((left + inset * side, bottom + inset * side), room, room, facecolor=grey, linewidth=0)


def _letter(letter: str, centre: Floats, height: float) -> Iterator[Artist]:
    """Draw it in gold, with an outline of ink and a seam of white lead."""
    path = TextPath((0, 0), letter, size=height, prop=_FONT)
    box = path.get_extents()
    middle, half = (box.p0 + box.p1) / 2, (box.p1 - box.p0) / 2
    scale = height / 2 / half
    fitted = Affine2D().translate(*-middle).scale(min(scale[0], 1.15 * scale[1]), scale[1]).translate(*centre)
    outline = fitted.transform_path(path)
    for width_mm, grey in ((1.4, _INK), (0.7, _WHITE)):
        yield PathPatch(outline, facecolor=grey, edgecolor=grey, linewidth=_points(width_mm), joinstyle="round")
    yield PathPatch(outline, facecolor=_GOLD, edgecolor=_INK, linewidth=_points(0.15))


def _vine(centre: Floats, radius: float, turn: float, hand: float) -> Iterator[Artist]:
    """Draw a spiral with leaves on its outside and a berry in its eye."""
    angle = np.linspace(0, 2.3 * 2 * np.pi, 90)
    reach = radius * (1 - angle / angle[-1]) ** 0.8 + 0.05 * radius
    heading = turn + hand * angle
    points = centre + reach[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    yield from _stem(points, 0.9)
    for i in range(4, 44, 8):
        out = float(np.degrees(heading[i]))
        at = points[i] + 0.2 * radius * np.array([np.cos(heading[i]), np.sin(heading[i])])
        yield _leaf(at, 0.42 * radius, out + 35 * hand)
    yield Ellipse((centre[0], centre[1]), 0.4 * radius, 0.4 * radius, facecolor=_GOLD, edgecolor=_INK, linewidth=0.4)


def _tendril(left: float, top: float, length: float, phase: float) -> Iterator[Artist]:
    """Draw a waving stem that hangs down the margin, with leaves to either side and a curl at its end."""
    s = np.linspace(0, 1, 120)
    sway = 0.03 * length * (1 - 0.4 * s) * (np.sin(4.4 * np.pi * s + phase) - np.sin(phase) * (1 - s))
    points = np.stack([left + sway, top - length * s], axis=-1)
    yield from _stem(points, 0.8)
    for k, i in enumerate(range(8, 116, 9)):
        side = (-1) ** k
        yield _leaf(points[i] + np.array([side * 0.022 * length, 0.008 * length]), 0.05 * length, 90 - 62 * side)
    yield from _vine(points[-1] - np.array([0.0, 0.03 * length]), 0.035 * length, np.pi / 2, 1.0)


def _stem(points: Floats, width_mm: float) -> Iterator[Artist]:
    """Draw a line of white lead between two of ink."""
    path = Path(points)
    for width, grey in ((width_mm + 0.5, _INK), (width_mm, _WHITE)):
        yield PathPatch(path, fill=False, edgecolor=grey, linewidth=_points(width), capstyle="round", joinstyle="round")


def _leaf(at: Floats, length: float, heading_deg: float) -> Artist:
    size = length, 0.42 * length
    return Ellipse((at[0], at[1]), *size, angle=heading_deg, facecolor=_WHITE, edgecolor=_INK, linewidth=_points(0.2))


def _boss(at: Floats, radius: float) -> Iterator[Artist]:
    """Draw a round stud of gold with a flower in it."""
    for share, grey in ((1.0, _INK), (0.84, _GOLD), (0.5, _INK), (0.36, _WHITE)):
        size = 2 * radius * share
        yield Ellipse((at[0], at[1]), size, size, facecolor=grey, linewidth=0)


def _points(millimetres: float) -> float:
    return millimetres * 72 / 25.4

"""How straight the lines of text are in a picture, without any scan to compare with.

A page whose text was set on straight, parallel lines shows by itself what is left of its warp. The feet of the letters
on a line are points (x_i, y_i); with the least-squares line through those of each line of text, at an angle a,

    line_straightness_px = sqrt( sum r_i^2 / (n - 2 m) ),    r_i = the distance of a point from its own line,

over all n points on m lines, and `line_spread_deg` is the standard deviation of the lines' angles. A page turned as a
whole is as straight as before. The definition is ours; the source below judges dewarped pages without a truth by the
same two things, lines that bend and lines that diverge.

A parabola of sagitta h bends by h sqrt(4 / 45) = .30 h. Round letters end a little below the line, and lines that are
straight have .1 to .2 px left. Where letters touch or stand far apart a line is found in pieces, and each piece is
straighter than the whole.

References
----------
T. Dasgupta, N. Das, M. Nasipuri, Multistage Curvilinear Coordinate Transform Based Document Image Dewarping Using a
Novel Quality Estimator, arXiv:2003.06872.
"""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from deskew.metrics.docunet import grey
from deskew.metrics.inkshare import ink_share
from deskew.types import Array, Floats

LETTERS_MIN = 8
"""Letters that make a line: fewer say little of how it bends."""

_PAPER = 20.0  # the white is sought within the shorter side over this
_INK = 0.1  # share below which nothing is ink, however little there is
_SMALLEST_PX = 5  # of a letter
# Of letters' heights beside the usual one; of the gap to the next letter, and of the step of its foot, in such heights.
_HEIGHTS = (0.6, 1.8)
_GAP, _STEP = 2.0, 0.6
_N_NEAR = 6
_AROUND, _HANGING = 4, 0.15


def line_straightness(image: Array) -> dict[str, float]:
    """Deviation of a picture's lines of text from straight ones.

    Parameters
    ----------
    image : (height, width[, 3]) array
        A page, dark on light and not far from upright; grey or RGB, uint8 or uint16. A letter has to be 5 px high.

    Returns
    -------
    dict
        `text_lines`, how many lines of at least 8 letters were found; if any, `line_straightness_px` [px of this
        picture] and `line_spread_deg`. Lines that are bent too much to be found flatter both: never print them without
        the number.
    """
    feet, height_px = _feet(grey("image", image))
    squares, n_free, angles = 0.0, 0, []
    for line in _lines(feet, height_px):
        points = feet[line]
        points = points[_standing(points[:, 1], height_px)]
        if len(points) < LETTERS_MIN:
            continue
        slope, level = np.polyfit(points[:, 0] - points[:, 0].mean(), points[:, 1], 1)
        off = (points[:, 1] - level - slope * (points[:, 0] - points[:, 0].mean())) / np.hypot(1.0, slope)
        squares, n_free = squares + float((off**2).sum()), n_free + len(points) - 2
        angles.append(np.degrees(np.arctan(slope)))
    if not angles:
        return {"text_lines": 0.0}
    return {
        "line_straightness_px": float(np.sqrt(squares / n_free)),
        "line_spread_deg": float(np.std(angles)),
        "text_lines": float(len(angles)),
    }


def _feet(levels: Array) -> tuple[Floats, float]:
    """Find the letters' feet (N, 2), from left to right, and their usual height [px]."""
    ink = ink_share(levels, max(_SMALLEST_PX, round(min(levels.shape) / _PAPER)))
    shares = np.asarray(np.rint(255.0 * ink), np.uint8)
    threshold = max(cv2.threshold(shares, 0, 255, cv2.THRESH_OTSU)[0], 255.0 * _INK)
    n, labels, boxes, _ = cv2.connectedComponentsWithStats((shares > threshold).astype(np.uint8), connectivity=8)
    heights = boxes[:, cv2.CC_STAT_HEIGHT]
    letters = np.arange(n) > 0
    letters &= heights >= _SMALLEST_PX
    if not letters.any():
        return np.zeros((0, 2)), 1.0
    usual = float(np.median(heights[letters]))
    letters &= (heights >= _HEIGHTS[0] * usual) & (heights <= _HEIGHTS[1] * usual)
    middles = boxes[:, cv2.CC_STAT_LEFT] + 0.5 * (boxes[:, cv2.CC_STAT_WIDTH] - 1)
    feet = np.column_stack([middles, _lower_edges(shares.astype(np.float64), labels, n, threshold)])[letters]
    return feet[np.argsort(feet[:, 0], kind="stable")], usual


def _lower_edges(shares: Floats, labels: Array, n: int, threshold: float) -> Floats:
    """Where each component ends below, to a fraction of a pixel: its lowest crossing of the threshold in any column."""
    inside, below = labels[:-1], shares[1:]
    ends = (inside > 0) & (below <= threshold)
    y, x = np.nonzero(ends)
    edge = y + (shares[y, x] - threshold) / (shares[y, x] - shares[y + 1, x])
    lowest = np.full(n, -1.0)
    np.maximum.at(lowest, inside[y, x], edge)
    return lowest


def _lines(feet: Floats, height_px: float) -> list[npt.NDArray[np.intp]]:
    """Chain letters, each to the nearest on its right that has it for its nearest on the left."""
    if len(feet) < LETTERS_MIN:
        return []
    # A step up or down counts for more than one along: the next letter is on the same line.
    places = feet * [1.0, _GAP / _STEP]
    reach = (1.0 + _GAP) * height_px
    distances, others = cKDTree(places).query(places, k=min(_N_NEAR, len(feet)), distance_upper_bound=reach)
    following, leading = np.full(len(feet), -1), np.full(len(feet), -1)
    for i, (row, near) in enumerate(zip(others, distances, strict=True)):
        near_by = [int(j) for j, d in zip(row, near, strict=True) if np.isfinite(d) and j != i]
        after = [j for j in near_by if feet[j, 0] > feet[i, 0]]
        before = [j for j in near_by if feet[j, 0] < feet[i, 0]]
        following[i], leading[i] = (after or [-1])[0], (before or [-1])[0]
    mutual = np.array([j >= 0 and leading[j] == i for i, j in enumerate(following)])
    following = np.where(mutual, following, -1)
    starts = np.setdiff1d(np.arange(len(feet)), following)
    return [line for line in (_chain(start, following) for start in starts) if len(line) >= LETTERS_MIN]


def _chain(start: int, following: Array) -> npt.NDArray[np.intp]:
    line = [int(start)]
    while following[line[-1]] >= 0:
        line.append(int(following[line[-1]]))
    return np.array(line)


def _standing(feet: Floats, height_px: float) -> npt.NDArray[np.bool_]:
    """Tell letters that stand on the line from those that hang below it or float above."""
    usual = [np.median(feet[max(i - _AROUND, 0) : i + _AROUND + 1]) for i in range(len(feet))]
    return np.abs(feet - usual) <= _HANGING * height_px

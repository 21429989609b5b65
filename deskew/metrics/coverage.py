"""How much of the page's area a restored image shows, counted on the page itself.

Counting restored pixels would let a page that shows one half twice pass for complete. Here the page is divided into
fine cells, and a cell counts once if some restored pixel shows it.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

from deskew.errors import require
from deskew.types import Array, Floats

# Cells are sampled at their centres: the figure is exact to half a cell along the border, .08 % of a letter page.
CELL_MM = 0.1
LONGEST_MM = 1e5
LARGEST_MM2 = 1e7  # ten sheets of A0: a thousand million cells
# Neighbouring pixels farther apart on the page than this many usual distances do not show what lies between them.
TEAR = 4.0


@njit(cache=True)
def _mark_triangle(
    cells: npt.NDArray[np.bool_], ax: float, ay: float, bx: float, by: float, cx: float, cy: float
) -> None:
    """Mark the cells whose centre lies in a triangle given in cell coordinates (centres at integers)."""
    rows, columns = cells.shape
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    if area == 0.0:
        return
    for y in range(max(0, int(np.ceil(min(ay, by, cy)))), min(rows - 1, int(np.floor(max(ay, by, cy)))) + 1):
        for x in range(max(0, int(np.ceil(min(ax, bx, cx)))), min(columns - 1, int(np.floor(max(ax, bx, cx)))) + 1):
            b = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / area
            c = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area
            if b >= -1e-9 and c >= -1e-9 and b + c <= 1.0 + 1e-9:
                cells[y, x] = True


@njit(cache=True)
def _mark_between(cells: npt.NDArray[np.bool_], uv: Floats, known: npt.NDArray[np.bool_], longest: float) -> None:
    """Mark what lies between the centres of four neighbouring pixels that all show the page."""
    height, width = known.shape
    for y in range(height - 1):
        for x in range(width - 1):
            if not (known[y, x] and known[y, x + 1] and known[y + 1, x] and known[y + 1, x + 1]):
                continue
            ax, ay, bx, by = uv[y, x, 0], uv[y, x, 1], uv[y, x + 1, 0], uv[y, x + 1, 1]
            cx, cy, dx, dy = uv[y + 1, x + 1, 0], uv[y + 1, x + 1, 1], uv[y + 1, x, 0], uv[y + 1, x, 1]
            if max(np.hypot(cx - ax, cy - ay), np.hypot(dx - bx, dy - by)) > 1.5 * longest:
                continue
            _mark_triangle(cells, ax, ay, bx, by, cx, cy)
            _mark_triangle(cells, ax, ay, cx, cy, dx, dy)


@njit(cache=True)
def _step(
    uv: Floats, known: npt.NDArray[np.bool_], y: int, x: int, dy: int, dx: int, longest: float, out: Floats
) -> bool:
    """Change of (u, v) for one pixel along (dy, dx), from whichever neighbours show the page; False if none does."""
    height, width = known.shape
    n, out[0], out[1] = 0, 0.0, 0.0
    for side in (-1, 1):
        j, i = y + side * dy, x + side * dx
        if 0 <= j < height and 0 <= i < width and known[j, i]:
            du, dv = side * (uv[j, i, 0] - uv[y, x, 0]), side * (uv[j, i, 1] - uv[y, x, 1])
            if np.hypot(du, dv) <= longest:
                out[0], out[1], n = out[0] + du, out[1] + dv, n + 1
    if n > 0:
        out[0], out[1] = out[0] / n, out[1] / n
    return n > 0


@njit(cache=True)
def _reach(known: npt.NDArray[np.bool_], drawn: npt.NDArray[np.bool_], y: int, x: int) -> float:
    """How far a pixel speaks towards a neighbour: to the page's edge if the neighbour shows the desk beyond it."""
    height, width = known.shape
    return 1.0 if 0 <= y < height and 0 <= x < width and drawn[y, x] and not known[y, x] else 0.5


@njit(cache=True)
def _surrounded(known: npt.NDArray[np.bool_], y: int, x: int) -> bool:
    height, width = known.shape
    if not (0 < y < height - 1 and 0 < x < width - 1):
        return False
    for j in range(y - 1, y + 2):
        for i in range(x - 1, x + 2):
            if not known[j, i]:
                return False
    return True


@njit(cache=True)
def _mark_border(
    cells: npt.NDArray[np.bool_], uv: Floats, known: npt.NDArray[np.bool_], drawn: npt.NDArray[np.bool_], longest: float
) -> None:
    """Mark the own areas of pixels that have not eight neighbours on the page."""
    height, width = known.shape
    p, q = np.empty(2), np.empty(2)
    for y in range(height):
        for x in range(width):
            if not known[y, x]:
                continue
            if _surrounded(known, y, x):
                continue
            if not (_step(uv, known, y, x, 0, 1, longest, p) and _step(uv, known, y, x, 1, 0, longest, q)):
                continue
            west, east = _reach(known, drawn, y, x - 1), _reach(known, drawn, y, x + 1)
            north, south = _reach(known, drawn, y - 1, x), _reach(known, drawn, y + 1, x)
            u, v = uv[y, x, 0], uv[y, x, 1]
            ax, ay = u - west * p[0] - north * q[0], v - west * p[1] - north * q[1]
            bx, by = u + east * p[0] - north * q[0], v + east * p[1] - north * q[1]
            cx, cy = u + east * p[0] + south * q[0], v + east * p[1] + south * q[1]
            dx, dy = u - west * p[0] + south * q[0], v - west * p[1] + south * q[1]
            _mark_triangle(cells, ax, ay, bx, by, cx, cy)
            _mark_triangle(cells, ax, ay, cx, cy, dx, dy)


def page_coverage(backward_map: Array, true_uv: Floats, page_size_mm: tuple[float, float]) -> float:
    """Share of the page's area that a restored image shows.

    The image shows what lies between the centres of neighbouring pixels on the page, and half a pixel around those at
    the rim; where the next pixel was drawn and shows the desk, it shows the page up to its edge.

    Parameters
    ----------
    backward_map : (H, W, 2) array
        NaN where the restored image was not drawn.
    true_uv : (H, W, 2) array
        True page coordinates [mm] of each restored pixel, NaN off the page.
    page_size_mm : (width, height)
        Of the flat page: the denominator comes from truth.

    Returns
    -------
    float
        In [0, 1].
    """
    size = np.asarray(page_size_mm, dtype=np.float64)
    sound = size.shape == (2,) and bool(((size > 0) & (size <= LONGEST_MM)).all())
    require(sound, "page_size_mm", f"be two positive lengths up to {LONGEST_MM:g} mm", page_size_mm)
    area = float(size.prod())
    require(area <= LARGEST_MM2, "page_size_mm", f"span at most {LARGEST_MM2:g} mm^2", f"{area:g} mm^2")
    drawn = np.asarray(np.isfinite(backward_map).all(axis=-1))
    known = drawn & np.asarray(np.isfinite(true_uv).all(axis=-1))
    counts = np.maximum(1, np.ceil(size / CELL_MM)).astype(int)
    # Cell coordinates: centre of the first cell at (0, 0).
    uv = np.where(known[..., None], true_uv, 0.0) / size * counts - 0.5
    pairs = known[:, 1:] & known[:, :-1]
    if not pairs.any():
        return 0.0
    longest = TEAR * float(np.median(np.linalg.norm(np.diff(uv, axis=1)[pairs], axis=-1)))
    cells = np.zeros((counts[1], counts[0]), dtype=bool)
    _mark_between(cells, uv, known, longest)
    _mark_border(cells, uv, known, drawn, longest)
    return float(cells.mean())

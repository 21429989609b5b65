"""Rasterise a grid of vertices into a visibility buffer, and read surfaces back from it.

Cell (r, c) of an (h, w) grid holds the triangles ``2 (r (w - 1) + c)``: (r, c), (r, c + 1), (r + 1, c), and the next
number: (r + 1, c + 1), (r + 1, c), (r, c + 1). Depths are kept as inverse depths, which are linear on the screen.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from numba import njit

from deskew.types import Floats

Ints = npt.NDArray[np.integer[Any]]


@njit(cache=True)
def corner(triangle: int, k: int, columns: int) -> tuple[int, int]:
    """Grid row and column of corner k (0, 1, 2) of a triangle, in a grid of `columns` vertices a row."""
    cell = triangle >> 1
    r, c = cell // (columns - 1), cell % (columns - 1)
    if triangle & 1 == 0:
        return r + (1 if k == 2 else 0), c + (1 if k == 1 else 0)
    return r + (0 if k == 2 else 1), c + (0 if k == 1 else 1)


@njit(cache=True)
def rasterise(screen: Floats, height: int, width: int) -> tuple[Floats, Ints]:
    """Nearest triangle at every sample of a raster.

    Parameters
    ----------
    screen : (h, w, 3) array
        Screen x, y of each vertex in sample units (sample (0, 0) is the centre of the first one), and depth [mm].
    height, width : int
        Raster.

    Returns
    -------
    inverse : (height, width) float32 array
        1 / depth [1/mm]; 0 where nothing is seen.
    ids : (height, width) int32 array
        Triangle; -1 where nothing is seen.
    """
    inverse = np.zeros((height, width), dtype=np.float32)
    ids = np.full((height, width), -1, dtype=np.int32)
    rows, columns = screen.shape[:2]
    for triangle in range(2 * (rows - 1) * (columns - 1)):
        r0, c0 = corner(triangle, 0, columns)
        r1, c1 = corner(triangle, 1, columns)
        r2, c2 = corner(triangle, 2, columns)
        x0, y0 = screen[r0, c0, 0], screen[r0, c0, 1]
        x1, y1 = screen[r1, c1, 0], screen[r1, c1, 1]
        x2, y2 = screen[r2, c2, 0], screen[r2, c2, 1]
        left, right = max(int(np.ceil(min(x0, x1, x2))), 0), min(int(np.floor(max(x0, x1, x2))), width - 1)
        top, bottom = max(int(np.ceil(min(y0, y1, y2))), 0), min(int(np.floor(max(y0, y1, y2))), height - 1)
        if left > right or top > bottom:
            continue
        area = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
        if area == 0.0:
            continue
        q0, q1, q2 = 1.0 / screen[r0, c0, 2], 1.0 / screen[r1, c1, 2], 1.0 / screen[r2, c2, 2]
        for y in range(top, bottom + 1):
            for x in range(left, right + 1):
                b1 = ((x - x0) * (y2 - y0) - (x2 - x0) * (y - y0)) / area
                b2 = ((x1 - x0) * (y - y0) - (x - x0) * (y1 - y0)) / area
                # Both edges of a shared side count as inside: an overlap is harmless, a gap is not.
                if b1 >= -1e-12 and b2 >= -1e-12 and b1 + b2 <= 1.0 + 1e-12:
                    q = q0 + b1 * (q1 - q0) + b2 * (q2 - q0)
                    if q > inverse[y, x]:
                        inverse[y, x] = q
                        ids[y, x] = triangle
    return inverse, ids


@njit(cache=True)
def weights(screen: Floats, triangle: int, x: float, y: float) -> tuple[float, float, float, float]:
    """Perspective-correct weights of a triangle's corners at screen point (x, y), and the depth there [mm]."""
    columns = screen.shape[1]
    r0, c0 = corner(triangle, 0, columns)
    r1, c1 = corner(triangle, 1, columns)
    r2, c2 = corner(triangle, 2, columns)
    x0, y0 = screen[r0, c0, 0], screen[r0, c0, 1]
    x1, y1 = screen[r1, c1, 0] - x0, screen[r1, c1, 1] - y0
    x2, y2 = screen[r2, c2, 0] - x0, screen[r2, c2, 1] - y0
    area = x1 * y2 - x2 * y1
    b1 = ((x - x0) * y2 - x2 * (y - y0)) / area
    b2 = (x1 * (y - y0) - (x - x0) * y1) / area
    g0, g1, g2 = (1.0 - b1 - b2) / screen[r0, c0, 2], b1 / screen[r1, c1, 2], b2 / screen[r2, c2, 2]
    total = g0 + g1 + g2
    return g0 / total, g1 / total, g2 / total, 1.0 / total


@njit(cache=True)
def buckets(x: Floats, y: Floats, height: int, width: int) -> tuple[Ints, Ints]:
    """Sort points by the pixel that they lie in: `order` of the points and where each pixel's run `starts` in it."""
    counts = np.zeros(height * width + 1, dtype=np.int64)
    cells = np.full(len(x), -1, dtype=np.int64)
    for i in range(len(x)):
        if x[i] >= -0.5 and y[i] >= -0.5 and x[i] < width - 0.5 and y[i] < height - 0.5:
            cells[i] = int(y[i] + 0.5) * width + int(x[i] + 0.5)
            counts[cells[i] + 1] += 1
    starts = np.cumsum(counts)
    fill = starts.copy()
    order = np.empty(starts[-1], dtype=np.int64)
    for i in range(len(x)):
        if cells[i] >= 0:
            order[fill[cells[i]]] = i
            fill[cells[i]] += 1
    return order, starts


@njit(cache=True)
def locate(screen: Floats, x: Floats, y: Floats, order: Ints, starts: Ints, width: int) -> tuple[Floats, Ints]:
    """Nearest triangle at arbitrary screen points: every triangle meets the points in its box, so it is exact.

    Parameters
    ----------
    screen : (h, w, 3) array
        Vertices: screen x, y [px] and depth [mm].
    x, y : (N,) arrays
        Points [px].
    order, starts : arrays
        From :func:`buckets`.
    width : int
        Pixels a row of the buckets.

    Returns
    -------
    depth : (N,) array
        [mm], NaN where nothing is seen.
    ids : (N,) int64 array
        Triangle, -1 where nothing is seen.
    """
    depth = np.full(len(x), np.nan)
    ids = np.full(len(x), -1, dtype=np.int64)
    height = (len(starts) - 1) // width
    rows, columns = screen.shape[:2]
    for triangle in range(2 * (rows - 1) * (columns - 1)):
        r0, c0 = corner(triangle, 0, columns)
        r1, c1 = corner(triangle, 1, columns)
        r2, c2 = corner(triangle, 2, columns)
        xs = (screen[r0, c0, 0], screen[r1, c1, 0], screen[r2, c2, 0])
        ys = (screen[r0, c0, 1], screen[r1, c1, 1], screen[r2, c2, 1])
        left, right = max(int(np.floor(min(xs) + 0.5)), 0), min(int(np.floor(max(xs) + 0.5)), width - 1)
        top, bottom = max(int(np.floor(min(ys) + 0.5)), 0), min(int(np.floor(max(ys) + 0.5)), height - 1)
        for row in range(top, bottom + 1):
            for column in range(left, right + 1):
                for k in range(starts[row * width + column], starts[row * width + column + 1]):
                    i = order[k]
                    w0, w1, w2, z = weights(screen, triangle, x[i], y[i])
                    if min(w0, w1, w2) >= -1e-12 and not z >= depth[i]:
                        depth[i] = z
                        ids[i] = triangle
    return depth, ids


@njit(cache=True)
def gather(values: Floats, screen: Floats, ids: Ints, x: Floats, y: Floats) -> Floats:
    """Interpolate vertex values (h, w, n) at screen points on known triangles: (N, n), NaN where the id is -1."""
    columns, n = screen.shape[1], values.shape[2]
    result = np.full((len(x), n), np.nan)
    for i in range(len(x)):
        if ids[i] < 0:
            continue
        w0, w1, w2, _ = weights(screen, ids[i], x[i], y[i])
        r0, c0 = corner(ids[i], 0, columns)
        r1, c1 = corner(ids[i], 1, columns)
        r2, c2 = corner(ids[i], 2, columns)
        for k in range(n):
            result[i, k] = w0 * values[r0, c0, k] + w1 * values[r1, c1, k] + w2 * values[r2, c2, k]
    return result

"""Where every restored pixel comes from: quads of the mesh from their new to their old places (section 3.5).

Inside a convex quad the map is bilinear, found from the new place by the inverse of the bilinear form, so it is smooth
across the quad and agrees with its neighbours along every edge. A concave or crossed quad, which only a folded sheet
has, is drawn as two triangles.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

from deskew.types import Floats, Size

# Rounding must not open gaps between neighbours: a pixel on an edge belongs to both.
EDGE_TOLERANCE_PX = 1e-9
# A pixel whose centre lies just off the page still shows a part of it; its source continues the border quad's map.
RING_PX = 0.5


@njit(cache=True)
def _cross(ax: float, ay: float, bx: float, by: float) -> float:
    return ax * by - ay * bx


@njit(cache=True)
def _inverse_bilinear(q: Floats, x: float, y: float) -> tuple[float, float]:
    """Parameters (a, b) of a point in a convex quad q (4, 2), corners in order (0,0), (1,0), (1,1), (0,1)."""
    ex, ey = q[1, 0] - q[0, 0], q[1, 1] - q[0, 1]
    fx, fy = q[3, 0] - q[0, 0], q[3, 1] - q[0, 1]
    gx, gy = q[0, 0] - q[1, 0] + q[2, 0] - q[3, 0], q[0, 1] - q[1, 1] + q[2, 1] - q[3, 1]
    hx, hy = x - q[0, 0], y - q[0, 1]
    k2 = _cross(gx, gy, fx, fy)
    k1 = _cross(ex, ey, fx, fy) + _cross(hx, hy, gx, gy)
    k0 = _cross(hx, hy, ex, ey)
    root = np.sqrt(max(k1 * k1 - 4.0 * k2 * k0, 0.0))
    # Of the two roots the one that stays finite as the quad becomes a parallelogram is the point's own; this form of it
    # loses no digits.
    b = -2.0 * k0 / (k1 + (root if k1 >= 0.0 else -root)) if k1 != 0.0 or root != 0.0 else 0.5
    dx, dy = ex + gx * b, ey + gy * b
    if abs(dx) > abs(dy):
        return (hx - fx * b) / dx, b
    if dy != 0.0:
        return (hy - fy * b) / dy, b
    return 0.5, b


@njit(cache=True)
def _signed_distances(q: Floats, x: float, y: float, sign: float, out: Floats) -> None:
    """Distance [px] of a point inwards from each of the quad's four edges; edge k runs from corner k to k + 1."""
    for k in range(4):
        m = (k + 1) % 4
        dx, dy = q[m, 0] - q[k, 0], q[m, 1] - q[k, 1]
        length = np.sqrt(dx * dx + dy * dy)
        out[k] = sign * _cross(dx, dy, x - q[k, 0], y - q[k, 1]) / length if length > 0.0 else 0.0


@njit(cache=True)
def _orientation(q: Floats) -> float:
    """+1 or -1 for a convex quad as its corners turn, 0 for a concave, crossed or vanishing one."""
    positive, negative = 0, 0
    for k in range(4):
        m, n = (k + 1) % 4, (k + 2) % 4
        turn = _cross(q[m, 0] - q[k, 0], q[m, 1] - q[k, 1], q[n, 0] - q[m, 0], q[n, 1] - q[m, 1])
        positive += turn > 0.0
        negative += turn < 0.0
    if positive > 0 and negative == 0:
        return 1.0
    if negative > 0 and positive == 0:
        return -1.0
    return 0.0


@njit(cache=True)
def _draw_convex(q: Floats, s: Floats, sign: float, slack: Floats, only_empty: bool, out: Floats) -> None:
    """Write the sources of all pixels within `slack` [px] of the quad, edge by edge."""
    height, width = out.shape[:2]
    reach = slack.max()
    x0, x1 = max(0, int(np.ceil(q[:, 0].min() - reach))), min(width - 1, int(np.floor(q[:, 0].max() + reach)))
    y0, y1 = max(0, int(np.ceil(q[:, 1].min() - reach))), min(height - 1, int(np.floor(q[:, 1].max() + reach)))
    d = np.empty(4)
    for y in range(y0, y1 + 1):
        for x in range(x0, x1 + 1):
            if only_empty and not np.isnan(out[y, x, 0]):
                continue
            _signed_distances(q, x, y, sign, d)
            if d[0] < -slack[0] or d[1] < -slack[1] or d[2] < -slack[2] or d[3] < -slack[3]:
                continue
            a, b = _inverse_bilinear(q, x, y)
            if not only_empty:
                a, b = min(max(a, 0.0), 1.0), min(max(b, 0.0), 1.0)
            for k in range(2):
                first = s[0, k] + a * (s[1, k] - s[0, k])
                second = s[3, k] + a * (s[2, k] - s[3, k])
                out[y, x, k] = first + b * (second - first)


@njit(cache=True)
def _draw_triangle(q: Floats, s: Floats, i: int, j: int, k: int, out: Floats) -> None:
    height, width = out.shape[:2]
    ax, ay, bx, by = q[j, 0] - q[i, 0], q[j, 1] - q[i, 1], q[k, 0] - q[i, 0], q[k, 1] - q[i, 1]
    area = _cross(ax, ay, bx, by)
    if area == 0.0:
        return
    x0 = max(0, int(np.ceil(min(q[i, 0], q[j, 0], q[k, 0]))))
    x1 = min(width - 1, int(np.floor(max(q[i, 0], q[j, 0], q[k, 0]))))
    y0 = max(0, int(np.ceil(min(q[i, 1], q[j, 1], q[k, 1]))))
    y1 = min(height - 1, int(np.floor(max(q[i, 1], q[j, 1], q[k, 1]))))
    for y in range(y0, y1 + 1):
        for x in range(x0, x1 + 1):
            hx, hy = x - q[i, 0], y - q[i, 1]
            b = _cross(hx, hy, bx, by) / area
            c = _cross(ax, ay, hx, hy) / area
            if min(b, c, 1.0 - b - c) < -EDGE_TOLERANCE_PX:
                continue
            for m in range(2):
                out[y, x, m] = (1.0 - b - c) * s[i, m] + b * s[j, m] + c * s[k, m]


@njit(cache=True)
def _triangle_area(q: Floats, i: int, j: int, k: int) -> float:
    return float(_cross(q[j, 0] - q[i, 0], q[j, 1] - q[i, 1], q[k, 0] - q[i, 0], q[k, 1] - q[i, 1]))


@njit(cache=True)
def _draw_split(q: Floats, s: Floats, out: Floats) -> None:
    """Cut a concave quad along the diagonal that leaves both halves turning alike; a crossed one has none."""
    if _triangle_area(q, 0, 1, 3) * _triangle_area(q, 1, 2, 3) > 0.0:
        _draw_triangle(q, s, 0, 1, 3, out)
        _draw_triangle(q, s, 1, 2, 3, out)
    else:
        _draw_triangle(q, s, 0, 1, 2, out)
        _draw_triangle(q, s, 0, 2, 3, out)


@njit(cache=True)
def _load(grid: Floats, i: int, j: int, q: Floats) -> None:
    for k in range(2):
        q[0, k], q[1, k] = grid[i, j, k], grid[i, j + 1, k]
        q[2, k], q[3, k] = grid[i + 1, j + 1, k], grid[i + 1, j, k]


@njit(cache=True)
def _draw_all(new: Floats, old: Floats, cut: npt.NDArray[np.bool_], main_sign: float, out: Floats) -> None:
    """Folded quads first, so that the sound ones around them lie on top; then the ring around the page."""
    rows, columns = new.shape[0] - 1, new.shape[1] - 1
    q, s, slack = np.empty((4, 2)), np.empty((4, 2)), np.empty(4)
    for stage in range(3):
        slack[:] = EDGE_TOLERANCE_PX if stage < 2 else RING_PX
        for i in range(rows):
            for j in range(columns):
                if cut[i, j] or (stage == 2 and 0 < i < rows - 1 and 0 < j < columns - 1):
                    continue
                _load(new, i, j, q)
                sign = _orientation(q)
                if (sign == main_sign) == (stage == 0):
                    continue
                _load(old, i, j, s)
                if sign == 0.0:
                    _draw_split(q, s, out)
                else:
                    _draw_convex(q, s, sign, slack, stage == 2, out)


def backward_quads(new: Floats, old: Floats, size: Size, cut: npt.NDArray[np.bool_] | None = None) -> Floats:
    """Return for each pixel of the restored view the old place of what is there now.

    Parameters
    ----------
    new, old : (R, C, 2) arrays
        The mesh's vertices in the restored view (u', v') and in the undistorted image (u, v) [px].
    size : (width, height)
        Of the restored view.
    cut : (R - 1, C - 1) bool array or None
        Quads that are not drawn: there is no surface between their corners.

    Returns
    -------
    (height, width, 2) array
        Pixels (u, v), NaN farther than half a pixel outside the mesh.
    """
    out = np.full((size[1], size[0], 2), np.nan)
    across, along = new[1:, 1:] - new[:-1, :-1], new[1:, :-1] - new[:-1, 1:]
    total = float((across[..., 0] * along[..., 1] - across[..., 1] * along[..., 0]).sum())
    _draw_all(
        np.ascontiguousarray(new, dtype=np.float64),
        np.ascontiguousarray(old, dtype=np.float64),
        np.zeros((new.shape[0] - 1, new.shape[1] - 1), dtype=np.bool_) if cut is None else cut,
        1.0 if total >= 0 else -1.0,
        out,
    )
    return out

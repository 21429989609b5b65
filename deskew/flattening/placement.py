"""How a flat sheet lies on the plane: as the bent one is seen from above, neither moved, nor turned, nor mirrored."""

from __future__ import annotations

import numpy as np
from numba import njit

from deskew.types import Floats

# Share of a sheet's area, as seen from above, that must show its back before it counts as upside down: a sheet rolled
# by more than half a turn shows up to 0.22, an overturned page nearly all.
_UPSIDE_DOWN = 0.25
# Area of a quad over its longer diagonal's square below which it has none to speak of.
_NO_AREA = 1e-4


def is_upside_down(normals: Floats) -> bool:
    """Whether a sheet mostly faces down, by its normals (..., 3), as long as their areas; a rolled one never does."""
    areas = np.sqrt(np.einsum("...k,...k->...", normals, normals))
    return float(normals[..., 2].sum()) < -_UPSIDE_DOWN * float(areas.sum())


def handedness(vertices: Floats) -> float:
    """Return -1 if columns and rows are as a page's, +X and -Y as seen from above; 1 if they are clearly mirrored.

    Parameters
    ----------
    vertices : (R, C, 3) array
        The sheet [mm].
    """
    seen, whole = _areas(np.ascontiguousarray(vertices, dtype=np.float64))
    return 1.0 if seen > _UPSIDE_DOWN * whole else -1.0


def has_area(vertices: Floats) -> bool:
    """Whether any quad of a grid, (R, C, 3) [mm], is more than a line."""
    return bool(_broadest(np.ascontiguousarray(vertices, dtype=np.float64)) > _NO_AREA)


def as_seen(places: Floats, vertices: Floats, mirror: float = 1.0) -> Floats:
    """Turn and move flat places to where the sheet is as seen from above.

    Parameters
    ----------
    places : (..., 2) array
        Flattened [mm].
    vertices : (..., 3) array
        The sheet [mm].
    mirror : float
        -1 to turn the flat sheet over first.

    Returns
    -------
    (..., 3) array
        With z = 0 [mm].
    """
    p, q = places.reshape(-1, 2), vertices.reshape(-1, 3)
    centre, middle = p.mean(axis=0), q[:, :2].mean(axis=0)
    dot, cross = _products(p, q, centre, middle, mirror)
    angle = np.arctan2(cross, dot)
    flat = np.zeros(q.shape)
    _turn(p, centre, mirror, np.cos(angle), np.sin(angle), middle, flat)
    return flat.reshape(vertices.shape)


@njit(cache=True)
def _areas(v):  # type: ignore[no-untyped-def]
    """Sum twice the areas of a grid's quads, as seen from above and whole: the cross products of their diagonals."""
    seen, whole = 0.0, 0.0
    for r in range(v.shape[0] - 1):
        for c in range(v.shape[1] - 1):
            ax, ay = v[r + 1, c + 1, 0] - v[r, c, 0], v[r + 1, c + 1, 1] - v[r, c, 1]
            bx, by = v[r + 1, c, 0] - v[r, c + 1, 0], v[r + 1, c, 1] - v[r, c + 1, 1]
            az, bz = v[r + 1, c + 1, 2] - v[r, c, 2], v[r + 1, c, 2] - v[r, c + 1, 2]
            x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
            seen += z
            whole += np.sqrt(x * x + y * y + z * z)
    return seen, whole


@njit(cache=True)
def _broadest(v):  # type: ignore[no-untyped-def]
    """Return twice the area over the longer diagonal's square of a grid's first quad that has area, or of its best."""
    best = 0.0
    for r in range(v.shape[0] - 1):
        for c in range(v.shape[1] - 1):
            aa, bb, ab = 0.0, 0.0, 0.0
            for k in range(3):
                a, b = v[r + 1, c + 1, k] - v[r, c, k], v[r + 1, c, k] - v[r, c + 1, k]
                aa, bb, ab = aa + a * a, bb + b * b, ab + a * b
            if max(aa, bb) > 0.0:
                best = max(best, np.sqrt(max(aa * bb - ab * ab, 0.0)) / max(aa, bb))
        if best > _NO_AREA:
            break
    return best


@njit(cache=True)
def _products(p, q, centre, middle, mirror):  # type: ignore[no-untyped-def]
    """Sum the scalar and the cross products of centred pairs: Kabsch's rotation in the plane is their angle."""
    dot, cross = 0.0, 0.0
    for i in range(len(p)):
        px, py = p[i, 0] - centre[0], mirror * (p[i, 1] - centre[1])
        qx, qy = q[i, 0] - middle[0], q[i, 1] - middle[1]
        dot += px * qx + py * qy
        cross += px * qy - py * qx
    return dot, cross


@njit(cache=True)
def _turn(p, centre, mirror, cosine, sine, middle, out):  # type: ignore[no-untyped-def]
    for i in range(len(p)):
        px, py = p[i, 0] - centre[0], mirror * (p[i, 1] - centre[1])
        out[i, 0] = cosine * px - sine * py + middle[0]
        out[i, 1] = sine * px + cosine * py + middle[1]

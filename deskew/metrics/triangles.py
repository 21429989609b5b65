"""A sheet as triangles: which there are, which edges they have, and which way they turn."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from deskew.types import Floats, Sheet

Triangles = npt.NDArray[np.integer[Any]]

_FACING_DOWN = 0.25  # share of its area; a rolled sheet that is seen by more than its border stays well within


def _corner_triangles(rows: int, columns: int) -> Triangles:
    """Return each quad's four corner triangles, (Q, 4, 3): every corner with its two neighbours."""
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b = index[:-1, :-1].ravel(), index[:-1, 1:].ravel()
    c, d = index[1:, 1:].ravel(), index[1:, :-1].ravel()
    return np.stack([np.stack(t, axis=-1) for t in ((d, a, b), (a, b, c), (b, c, d), (c, d, a))], axis=1)


def quad_triangles(sheet: Sheet) -> Triangles:
    """Corner triangles of a grid's quads that are not cut, (Q, 4, 3)."""
    corners = _corner_triangles(*sheet.vertices.shape[:2])
    return corners if sheet.cut is None else corners[~sheet.cut.ravel()]


def sheet_triangles(sheet: Sheet) -> Triangles:
    """Triangles that cover a sheet once, (F, 3); two a quad of a grid."""
    if sheet.faces is not None:
        return sheet.faces
    # Corner triangles 1 (a, b, c) and 3 (c, d, a) are the two halves of the quad.
    return quad_triangles(sheet)[:, [1, 3]].reshape(-1, 3)


def sheet_edges(sheet: Sheet) -> Triangles:
    """All edges once, (E, 2); of a grid its structural edges and both diagonals of each quad (section 3.2.2)."""
    triangles = quad_triangles(sheet).reshape(-1, 3) if sheet.faces is None else sheet.faces
    pairs = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    return np.unique(np.sort(pairs, axis=1), axis=0)


def signed_areas(points: Floats, triangles: Triangles) -> Floats:
    """Area of each triangle in the plane of the first two coordinates, positive if it turns counterclockwise."""
    a, b, c = (points[triangles[..., k], :2] for k in range(3))
    p, q = b - a, c - a
    return np.asarray(0.5 * (p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0]))


def upward(sheet: Sheet) -> float:
    """Which way a sheet's triangles turn when it is looked at as it should be: 1.0 counterclockwise, -1.0 clockwise.

    A sheet is looked at from above. A mesh that faces neither up nor down on the whole, a scroll or a page on edge, has
    no upper side: it is looked at from its front, where its faces turn counterclockwise.
    """
    points, triangles = sheet.vertices.reshape(-1, 3), sheet_triangles(sheet)
    seen = float(signed_areas(points, triangles).sum())
    if sheet.faces is None:
        return 1.0 if seen >= 0 else -1.0
    a, b, c = (points[triangles[:, k]] for k in range(3))
    whole = 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
    return -1.0 if seen < -_FACING_DOWN * whole else 1.0

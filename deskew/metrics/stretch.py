"""How a flattening distorts a surface: Sander's texture stretch both ways, areas, angles and flipped triangles.

The surface is the judge and says nothing about its own faults: a scan that noise has lengthened flattens with a stretch
of 1 onto a sheet that is too large. Only a known truth tells that (see `deskew.metrics.score`).

References
----------
P. V. Sander, J. Snyder, S. J. Gortler, H. Hoppe, Texture Mapping Progressive Meshes, SIGGRAPH 2001, section 3.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from deskew.errors import require
from deskew.metrics.triangles import Triangles, sheet_triangles, signed_areas, upward
from deskew.types import Flattened, Floats, Sheet


def _in_their_planes(points: Floats, triangles: Triangles) -> tuple[Floats, Floats, Floats]:
    """Each triangle in a frame of its own plane: corners at (0, 0), (p, 0), (x, y) with y >= 0."""
    first = points[triangles[:, 1]] - points[triangles[:, 0]]
    second = points[triangles[:, 2]] - points[triangles[:, 0]]
    p = np.linalg.norm(first, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        x = (first * second).sum(axis=1) / p
        y = np.linalg.norm(np.cross(first, second), axis=1) / p
    return p, x, y


def _singular_values(surface: Floats, flat: Floats, triangles: Triangles) -> tuple[Floats, Floats]:
    """Largest and smallest singular value of each triangle's Jacobian, surface to plane; signed: below 0 if flipped."""
    p, x, y = _in_their_planes(surface, triangles)
    along, across = flat[triangles[:, 1]] - flat[triangles[:, 0]], flat[triangles[:, 2]] - flat[triangles[:, 0]]
    u = along / p[:, None]  # image of the unit vector along the first edge, and of the one across it
    v = (across - u * x[:, None]) / y[:, None]
    turn = np.hypot(u[:, 0] + v[:, 1], u[:, 1] - v[:, 0])
    mirror = np.hypot(u[:, 0] - v[:, 1], u[:, 1] + v[:, 0])
    return 0.5 * (turn + mirror), 0.5 * (turn - mirror)


def _angles(points: Floats, triangles: Triangles) -> Floats:
    """Angle at each corner, (F, 3) [degrees]."""
    corners = points[triangles]
    ahead, behind = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    sine = np.sqrt(np.maximum((ahead**2).sum(-1) * (behind**2).sum(-1) - (ahead * behind).sum(-1) ** 2, 0.0))
    return np.asarray(np.degrees(np.arctan2(sine, (ahead * behind).sum(-1))))


def _folds(flipped: npt.NDArray[np.bool_], triangles: Triangles) -> int:
    """Count the edges between a triangle that is flipped and one that is not."""
    if not flipped.any():
        return 0
    ends = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, edge = np.unique(ends, axis=0, return_inverse=True)
    n_flipped = np.bincount(edge.ravel(), weights=np.repeat(flipped, 3))
    return int(((n_flipped > 0) & (n_flipped < np.bincount(edge.ravel()))).sum())


def stretch_figures(surface: Floats, flat: Floats, triangles: Triangles) -> dict[str, float]:
    """Distortion of a map from a surface onto the plane, in which every triangle should turn counterclockwise.

    Parameters
    ----------
    surface : (V, 3) array
        The surface's vertices [mm].
    flat : (V, 2) array
        The same vertices in the plane [mm].
    triangles : (F, 3) int array
        Those without any area on the surface are left out.

    Returns
    -------
    dict
        As :func:`sheet_stretch`.
    """
    areas = 0.5 * np.prod(_in_their_planes(surface, triangles)[::2], axis=0)
    real = areas > 0  # also leaves out NaN, where two corners lie in one place
    require(bool(real.any()), "sheet", "have triangles of some area", "none")
    triangles, areas = triangles[real], areas[real]
    largest, smallest = _singular_values(surface, flat, triangles)
    signed = signed_areas(flat, triangles)
    flipped = signed <= 0
    weights = areas / areas.sum()
    with np.errstate(divide="ignore"):
        back = np.where(flipped, np.inf, 1.0 / smallest)  # Sander's larger singular value, from the plane back
        there = np.where(flipped, np.inf, largest)
        squares = 0.5 * (back**2 + 1.0 / largest**2), 0.5 * (there**2 + smallest**2)
    angles = np.abs(_angles(surface, triangles) - np.where(flipped, -1, 1)[:, None] * _angles(flat, triangles))
    return {
        "stretch_l2": float(np.sqrt((weights * squares[0]).sum())),
        "stretch_linf": float(back.max()),
        "stretch_inverse_l2": float(np.sqrt((weights * squares[1]).sum())),
        "stretch_inverse_linf": float(there.max()),
        "area_error": float((weights * np.abs(signed / areas - 1.0)).sum()),
        "angle_mean_deg": float((weights * angles.mean(axis=1)).sum()),
        "flips": float(flipped.sum()),
        "folds": float(_folds(flipped, triangles)),
    }


def sheet_stretch(sheet: Sheet, flattened: Flattened) -> dict[str, float]:
    """Distortion of a flattened sheet, triangle by triangle, weighted by area on the sheet as scanned.

    Parameters
    ----------
    sheet : Sheet
        As scanned; that says which way its triangles should turn (see `deskew.metrics.triangles.upward`).
    flattened : Flattened
        The same vertices flattened; only X and Y count.

    Returns
    -------
    dict
        With G >= g the singular values of the map from the plane to the surface on a triangle, 1 where it is isometric:
        `stretch_l2`, root mean square of ``sqrt((G^2 + g^2) / 2)`` over the sheet, and `stretch_linf`, the largest G:
        both grow where flattening shrank the paper. `stretch_inverse_l2`, `stretch_inverse_linf`: the same norms of the
        inverse map, surface to plane, whose singular values are 1 / g >= 1 / G: they grow where it was stretched. All
        four are infinite if any triangle is flipped or has no area left.
        `area_error`: mean of ``|A' / A - 1|`` with A' signed, so that a flipped triangle counts 2 and not 0.
        `angle_mean_deg`: mean change of the triangles' angles [degrees], of a flipped one their sum.
        `flips`: triangles that turn the other way, or have no area left. `folds`: edges along which the sheet folds
        over, between a triangle that is flipped and one that is not.

    Raises
    ------
    InputError
        If the shapes differ, a place is not finite or no triangle has an area.
    """
    shape = sheet.vertices.shape
    require(flattened.vertices.shape == shape, "flattened", f"have the sheet's shape {shape}", flattened.vertices.shape)
    surface, flat = sheet.vertices.reshape(-1, 3), flattened.vertices.reshape(-1, 3)[:, :2]
    require(bool(np.isfinite(flat).all()), "flattened", "have finite vertices", "NaN or infinity")
    return stretch_figures(surface, flat * [1.0, upward(sheet)], sheet_triangles(sheet))

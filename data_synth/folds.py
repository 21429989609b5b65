"""Crumpled sheets that are exactly isometric: a rolled sheet, then mirror folds, scaled to a wanted slope.

Reflecting the part of a surface beyond a plane leaves every length on it unchanged, so any number of mirror folds of
an isometric surface is isometric. The plane is nearly level: it cuts the sheet in a crease and folds it there by twice
the angle between them. (Composing rounded folds on a sheet already bent is not isometric, hence the mirrors.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from scipy.optimize import brentq

from data_synth.cylinder import Bend, roll
from data_synth.sheets import LEAST_CELL, PAGE_SIZE_MM, TrueSheet, page_grid, page_grid_of, slopes_deg, to_world
from deskew.errors import StepError, require
from deskew.types import Floats

# Facets make the slopes' distribution step, so a coarser grid would misplace its 90th percentile by over a degree.
_COARSE_MM = 0.75
_ATTEMPTS = 200
_TOLERANCE_DEG = 1.0


@dataclass(frozen=True, slots=True)
class View:
    """What a sheet must stay inside of: seen from `eye_mm`, it may cover this rectangle of the bed.

    Attributes
    ----------
    eye_mm : (3,) tuple
        The camera's centre in the world [mm].
    half_size_mm : (half width, half height)
        Half of the bed that camera and projector share [mm].
    relief_mm : float
        Height of the shared working volume [mm].
    """

    eye_mm: tuple[float, float, float] = (6.0, -5.0, 800.0)
    half_size_mm: tuple[float, float] = (149.5, 111.5)
    relief_mm: float = 60.0


@dataclass(frozen=True, slots=True)
class _Recipe:
    """Random numbers of one sheet; every angle is in units of the common severity that the slope is solved with."""

    azimuth: float
    bends: tuple[Bend, ...]
    anchors: Floats  # (n, 3) points of the flat page in the world that each mirror passes through [mm]
    tilts: Floats  # (n, 2) horizontal components of each mirror's tilt


def crumpled(
    rng: np.random.Generator,
    page_size_mm: tuple[float, float] = PAGE_SIZE_MM,
    slope_p90_deg: float = 20.0,
    *,
    n_folds: tuple[int, int] = (5, 10),
    view: View | None = None,
    shape: tuple[int, int] | None = None,
) -> TrueSheet:
    """Draw a crumpled sheet that is isometric to the page and has the wanted severity.

    The slope is reached by scaling all angles of one drawn sheet. A sheet is drawn anew only if it has near-vertical
    walls or overlaps itself as the camera sees it (smallest projected cell under 0.3 of the median), or leaves `view`.

    Parameters
    ----------
    rng : numpy Generator
        The only source of randomness.
    page_size_mm : (width, height)
        Page [mm].
    slope_p90_deg : float
        90th percentile of the slope, in [1, 45]; met within a degree, nearly always within .3.
    n_folds : (fewest, most)
        Mirror folds, both included.
    view : View
        Volume to stay in; by default that of the default rig.
    shape : (rows, columns)
        Grid that the surface is handed back on; by default the renderer's, 0.3 mm apart. The surface drawn is the same.

    Returns
    -------
    TrueSheet
        With its best-fit tilt removed, its lowest vertex on the bed, centred in the camera's view.

    Raises
    ------
    StepError
        If 200 drawn sheets were all rejected.
    """
    require(1 <= slope_p90_deg <= 45, "slope_p90_deg", "be in [1, 45]", slope_p90_deg)
    require(1 <= n_folds[0] <= n_folds[1], "n_folds", "be (fewest, most) with 1 <= fewest <= most", n_folds)
    view = view or View()
    coarse = page_grid(page_size_mm, _COARSE_MM)
    for _ in range(_ATTEMPTS):
        recipe = _draw(rng, page_size_mm, n_folds)
        severity = _solve_severity(recipe, coarse, page_size_mm, slope_p90_deg)
        # The coarse grid decides first: it costs a sixth of the fine one.
        if severity is None or not _acceptable(_folded(recipe, severity, coarse, coarse, page_size_mm, view), view):
            continue
        flat = page_grid(page_size_mm)
        sheet = TrueSheet(_folded(recipe, severity, flat, coarse, page_size_mm, view), flat)
        if _acceptable(sheet.vertices, view) and abs(sheet.slope_p90_deg - slope_p90_deg) < _TOLERANCE_DEG:
            if shape is None:
                return sheet
            flat = page_grid_of(shape, page_size_mm)
            return TrueSheet(_folded(recipe, severity, flat, coarse, page_size_mm, view), flat)
    raise StepError(f"crumpled: {_ATTEMPTS} sheets left the view or had walls; lower `slope_p90_deg` or widen `view`.")


def _draw(rng: np.random.Generator, page_size_mm: tuple[float, float], n_folds: tuple[int, int]) -> _Recipe:
    """Draw one sheet's bends and mirrors."""
    width, height = page_size_mm
    azimuth = float(rng.uniform(0.0, np.pi))
    reach = (width * abs(np.cos(azimuth)) + height * abs(np.sin(azimuth))) / 2
    n_bends = int(rng.integers(1, 4))
    room = 2 * reach / n_bends
    bends = []
    for slot in range(n_bends):
        length = float(rng.uniform(0.1, 0.4)) * room
        centre = -reach + room * slot + float(rng.uniform(0.3, 0.7)) * room
        angle = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 1.5))
        bends.append(Bend(centre, length, angle))
    n = int(rng.integers(n_folds[0], n_folds[1] + 1))
    anchors = to_world(rng.uniform(0.08, 0.92, (n, 2)) * page_size_mm, page_size_mm)
    directions, sizes = rng.uniform(0.0, 2 * np.pi, n), rng.uniform(0.35, 1.0, n)
    tilts = np.stack([sizes * np.cos(directions), sizes * np.sin(directions)], axis=-1)
    return _Recipe(azimuth, tuple(bends), anchors, tilts)


def _surface(recipe: _Recipe, severity: float, points: Floats) -> Floats:
    """Roll and fold flat points (N, 3); closed form, so any density costs what it holds."""
    n = len(recipe.anchors)
    bends = [Bend(b.centre_mm, b.length_mm, severity * b.angle) for b in recipe.bends]
    # The anchors ride along, so that each mirror still passes through its own point of the sheet.
    folded = roll(np.concatenate([points, recipe.anchors]), bends, recipe.azimuth)
    for k, tilt in enumerate(recipe.tilts):
        angle = severity * float(np.hypot(*tilt))
        normal = np.array([*(np.sin(angle) * tilt / np.hypot(*tilt)), np.cos(angle)])
        # Alternate sides, or the sheet would be pushed one way only and curl up.
        _reflect(folded, folded[len(points) + k].copy(), normal if k % 2 == 0 else -normal)
    return folded[: len(folded) - n]


@njit(cache=True)
def _reflect(points: Floats, through: Floats, normal: Floats) -> None:
    """Mirror the points (N, 3) that lie beyond a plane, in place."""
    for i in range(len(points)):
        height = 0.0
        for axis in range(3):
            height += (points[i, axis] - through[axis]) * normal[axis]
        if height > 0.0:
            for axis in range(3):
                points[i, axis] -= 2.0 * height * normal[axis]


def _folded(
    recipe: _Recipe, severity: float, flat: Floats, coarse: Floats, page_size_mm: tuple[float, float], view: View
) -> Floats:
    """Vertices (h, w, 3) of the placed sheet; the pose comes from the coarse grid, whatever the density of `flat`."""
    target = to_world(coarse, page_size_mm).reshape(-1, 3)
    model = _surface(recipe, severity, target)
    R = best_rotation(model - model.mean(axis=0), target)
    points = _surface(recipe, severity, to_world(flat, page_size_mm).reshape(-1, 3))
    points = np.einsum("ij,kj->ik", points, R)
    points[:, 2] -= points[:, 2].min()
    eye_x, eye_y, eye_z = view.eye_mm
    for axis, eye in ((0, eye_x), (1, eye_y)):
        # Centre what the camera sees: two steps settle the small effect of height on the centre.
        for _ in range(2):
            seen = eye + (points[:, axis] - eye) * eye_z / (eye_z - points[:, 2])
            points[:, axis] -= (seen.min() + seen.max()) / 2
    return np.asarray(points.reshape(*flat.shape[:2], 3))


def best_rotation(source: Floats, target: Floats) -> Floats:
    """Return the rotation (3, 3) that best turns centred `source` (N, 3) onto `target` (N, 3) [mm], after Kabsch.

    It levels a bent sheet and squares it up.
    """
    U, _, Vt = np.linalg.svd(np.einsum("ni,nj->ij", source, target))
    D = np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))])
    return np.asarray(Vt.T @ D @ U.T)


def _solve_severity(
    recipe: _Recipe, coarse: Floats, page_size_mm: tuple[float, float], slope_p90_deg: float
) -> float | None:
    """Severity [rad] at which the placed sheet's slope is the wanted one; None if it is out of reach."""
    target = to_world(coarse, page_size_mm).reshape(-1, 3)

    def excess(severity: float) -> float:
        model = _surface(recipe, severity, target)
        R = best_rotation(model - model.mean(axis=0), target)
        level = np.einsum("ij,kj->ik", model, R).reshape(*coarse.shape[:2], 3)
        return float(np.percentile(slopes_deg(level), 90)) - slope_p90_deg

    # Slopes grow with the severity, by about one to three times it.
    low, high = 0.0, np.radians(slope_p90_deg) / 2
    while excess(high) < 0:
        low, high = high, 1.5 * high
        if high > 1.5:
            return None
    return float(brentq(excess, low, high, xtol=5e-4))


def _acceptable(vertices: Floats, view: View) -> bool:
    """Tell whether a placed sheet stays in view and shows the camera no wall and no overlap."""
    eye_x, eye_y, eye_z = view.eye_mm
    if float(vertices[..., 2].max()) > view.relief_mm:
        return False
    scale = eye_z / (eye_z - vertices[..., 2])
    x, y = (vertices[..., 0] - eye_x) * scale + eye_x, (vertices[..., 1] - eye_y) * scale + eye_y
    if max(float(np.abs(x).max()) / view.half_size_mm[0], float(np.abs(y).max()) / view.half_size_mm[1]) > 1:
        return False
    # Twice the projected area of each cell by its diagonals; negative where the cell is seen from behind.
    area = (x[:-1, 1:] - x[1:, :-1]) * (y[:-1, :-1] - y[1:, 1:]) - (y[:-1, 1:] - y[1:, :-1]) * (x[:-1, :-1] - x[1:, 1:])
    return float(area.min()) >= LEAST_CELL * float(np.median(area))

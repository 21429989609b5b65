"""Sheets of paper as surfaces with known page coordinates: flat, tilted, domed, and a tent that casts a shadow.

World: Z = 0 is the bed, Z up. Page: u to the right, v down, [mm], with the page's centre over the world's origin.
Crumpled sheets are in :mod:`data_synth.folds` and :mod:`data_synth.physical`, smooth ones in
:mod:`data_synth.developables`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from data_synth.cylinder import Bend, roll
from deskew.errors import require
from deskew.types import Floats

PAGE_SIZE_MM = (279.0, 216.0)
"""The paper's page, letter size in landscape (width, height)."""

SPACING_MM = 0.3
"""Distance of the vertices: 931 x 721 on a letter page, three times finer than the 0.9 mm whose floor is 0.066 mm."""

LEAST_CELL = 0.3
"""Smallest projected cell of a height field over their median: below it are near-vertical walls and overhangs."""


@dataclass(frozen=True, slots=True)
class TrueSheet:
    """A surface whose page coordinates are known; only the renderer and the metrics see it.

    Attributes
    ----------
    vertices : (h, w, 3) array
        Positions in the world [mm]; rows run along v, columns along u.
    flat : (h, w, 2) array
        Page coordinates (u, v) of the vertices [mm].
    """

    vertices: Floats
    flat: Floats

    def __post_init__(self) -> None:
        vertices = np.ascontiguousarray(self.vertices, dtype=np.float64)
        flat = np.ascontiguousarray(self.flat, dtype=np.float64)
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "flat", flat)
        shape = vertices.shape
        grid = vertices.ndim == 3 and shape[2] == 3 and min(shape[:2]) >= 2
        require(grid, "vertices", "have shape (h, w, 3) with h, w >= 2", shape)
        require(flat.shape == (*shape[:2], 2), "flat", f"have shape {(*shape[:2], 2)}", flat.shape)
        require(bool(np.isfinite(vertices).all()), "vertices", "be finite", "NaN or infinity")
        require(bool(np.isfinite(flat).all()), "flat", "be finite", "NaN or infinity")

    @property
    def page_size_mm(self) -> tuple[float, float]:
        """Width and height of the flat page [mm]."""
        # Axis by axis: numpy is slow at reducing pairs.
        return float(np.ptp(self.flat[..., 0])), float(np.ptp(self.flat[..., 1]))

    @property
    def slope_p90_deg(self) -> float:
        """90th percentile over the page's area of the angle between the surface and the bed [deg]."""
        return float(np.percentile(slopes_deg(self.vertices), 90))

    @property
    def relief_mm(self) -> float:
        """Height of the highest vertex above the lowest [mm]."""
        return float(np.ptp(self.vertices[..., 2]))


def slopes_deg(vertices: Floats) -> Floats:
    """Angle of each cell of a grid against the bed, from the cross product of its diagonals.

    Parameters
    ----------
    vertices : (h, w, 3) array
        World [mm].

    Returns
    -------
    (h - 1, w - 1) array
        Degrees in [0, 180]; beyond 90 the cell is seen from behind.
    """
    normals = np.cross(vertices[:-1, 1:] - vertices[1:, :-1], vertices[:-1, :-1] - vertices[1:, 1:])
    return np.asarray(np.degrees(np.arctan2(np.linalg.norm(normals[..., :2], axis=-1), normals[..., 2])))


def projected_cells(vertices: Floats) -> Floats:
    """Signed area of each cell of a grid (h, w, 3) as seen from above: (h - 1, w - 1) [mm^2], positive if facing up."""
    x, y = vertices[..., 0], vertices[..., 1]
    rising = (x[:-1, 1:] - x[1:, :-1]) * (y[:-1, :-1] - y[1:, 1:])
    falling = (y[:-1, 1:] - y[1:, :-1]) * (x[:-1, :-1] - x[1:, 1:])
    return np.asarray(rising - falling) / 2


def least_cell(vertices: Floats) -> float:
    """Smallest projected cell of a grid (h, w, 3) over their median; negative where the sheet hangs over itself."""
    area = projected_cells(vertices)
    return float(area.min() / np.median(area))


def laid(vertices: Floats) -> Floats:
    """Lay a sheet (h, w, 3) on the bed with its bounding box centred over the world's origin [mm]."""
    low, high = vertices.min(axis=(0, 1)), vertices.max(axis=(0, 1))
    return np.asarray(vertices - np.array([(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, low[2]]))


def page_grid(page_size_mm: tuple[float, float], spacing_mm: float = SPACING_MM) -> Floats:
    """Page coordinates of a regular grid over the page.

    Parameters
    ----------
    page_size_mm : (width, height)
        Page [mm].
    spacing_mm : float
        Distance of neighbours [mm], rounded so that the page holds a whole number of cells.

    Returns
    -------
    (h, w, 2) array
        (u, v) [mm].
    """
    width, height = page_size_mm
    finite = bool(np.isfinite(page_size_mm).all())
    require(finite and min(page_size_mm) >= 10 * spacing_mm, "page_size_mm", "be at least ten cells", page_size_mm)
    u = np.linspace(0.0, width, round(width / spacing_mm) + 1)
    v = np.linspace(0.0, height, round(height / spacing_mm) + 1)
    return np.stack(np.meshgrid(u, v), axis=-1)


def page_grid_of(shape: tuple[int, int], page_size_mm: tuple[float, float]) -> Floats:
    """Page coordinates of a regular grid of given size that spans the page.

    Parameters
    ----------
    shape : (rows, columns)
        Vertices along v and along u, at least 2.
    page_size_mm : (width, height)
        Page [mm].

    Returns
    -------
    (rows, columns, 2) array
        (u, v) [mm].
    """
    require(min(shape) >= 2, "shape", "be (rows, columns), each at least 2", shape)
    width, height = page_size_mm
    sound = bool(np.isfinite(page_size_mm).all()) and min(page_size_mm) > 0
    require(sound, "page_size_mm", "be positive and finite", page_size_mm)
    u, v = np.linspace(0.0, width, shape[1]), np.linspace(0.0, height, shape[0])
    return np.stack(np.meshgrid(u, v), axis=-1)


def to_world(flat: Floats, page_size_mm: tuple[float, float]) -> Floats:
    """Lay page coordinates (..., 2) flat on the bed: (..., 3), X = u - W / 2, Y = H / 2 - v, Z = 0 [mm]."""
    width, height = page_size_mm
    return np.stack([flat[..., 0] - width / 2, height / 2 - flat[..., 1], np.zeros(flat.shape[:-1])], axis=-1)


def flat_sheet(page_size_mm: tuple[float, float] = PAGE_SIZE_MM) -> TrueSheet:
    """Return the page lying flat on the bed: the control's geometry."""
    flat = page_grid(page_size_mm)
    return TrueSheet(to_world(flat, page_size_mm), flat)


def posed(page_size_mm: tuple[float, float], R: Floats, t: Floats) -> TrueSheet:
    """Return the flat page moved rigidly.

    Parameters
    ----------
    page_size_mm : (width, height)
        Page [mm].
    R, t : (3, 3) and (3,) arrays
        World pose of the page whose centre is the origin: ``X = R x + t`` [mm].
    """
    flat = page_grid(page_size_mm)
    return TrueSheet(np.einsum("...j,kj->...k", to_world(flat, page_size_mm), R) + t, flat)


def plane(
    page_size_mm: tuple[float, float] = PAGE_SIZE_MM, *, tilt_deg: float = 0.0, azimuth_deg: float = 0.0
) -> TrueSheet:
    """Return a rigid plane that touches the bed with its lowest corner (the targets of section 2.5).

    Parameters
    ----------
    page_size_mm : (width, height)
        Plane [mm].
    tilt_deg : float
        Angle against the bed, in [0, 45].
    azimuth_deg : float
        Direction in which the plane rises, counter-clockwise from +X.
    """
    require(0 <= tilt_deg <= 45, "tilt_deg", "be in [0, 45]", tilt_deg)
    require(bool(np.isfinite(azimuth_deg)), "azimuth_deg", "be finite", azimuth_deg)
    tilt, azimuth = np.radians([tilt_deg, azimuth_deg])
    flat = page_grid(page_size_mm)
    world = to_world(flat, page_size_mm)
    uphill = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    along = np.einsum("...i,i", world, uphill)
    # Turning about the horizontal axis across `uphill` moves each point in the (uphill, Z) plane only.
    vertices = world + along[..., None] * ((np.cos(tilt) - 1.0) * uphill + np.array([0.0, 0.0, np.sin(tilt)]))
    vertices[..., 2] -= vertices[..., 2].min()
    return TrueSheet(vertices, flat)


def dome(page_size_mm: tuple[float, float] = PAGE_SIZE_MM, *, radius_mm: float = 600.0) -> TrueSheet:
    """Return a spherical cap over a rectangle, resting on its four corners.

    A sphere is not isometric to a page: `flat` holds the vertical projection, which serves a blank target only.

    Parameters
    ----------
    page_size_mm : (width, height)
        Rectangle that the cap covers on the bed [mm].
    radius_mm : float
        Radius of the sphere, at least 1.5 times the rectangle's half diagonal.
    """
    flat = page_grid(page_size_mm)
    vertices = to_world(flat, page_size_mm)
    reach = float(np.hypot(*page_size_mm)) / 2
    require(radius_mm >= 1.5 * reach, "radius_mm", f"be at least {1.5 * reach:.1f}", radius_mm)
    squared = (vertices[..., :2] ** 2).sum(axis=-1)
    vertices[..., 2] = np.sqrt(radius_mm**2 - squared) - np.sqrt(radius_mm**2 - reach**2)
    return TrueSheet(vertices, flat)


def tent(page_size_mm: tuple[float, float] = PAGE_SIZE_MM, *, steep_deg: float = 76.0) -> TrueSheet:
    """Return a page with one ridge along Y whose steep side faces -X: it casts a shadow on the page beyond.

    The default rig's projector stands at +X and its rays descend at about 67 degrees, so a wall of 76 degrees is dark
    and shades the flat page to the left of it, while the camera still sees the wall and the shaded strip.

    Parameters
    ----------
    page_size_mm : (width, height)
        Page [mm].
    steep_deg : float
        Slope of the steep side, in [10, 80]; the gentle side falls by 25 degrees.
    """
    require(10 <= steep_deg <= 80, "steep_deg", "be in [10, 80]", steep_deg)
    steep, gentle = np.radians([steep_deg, 25.0])
    wall_mm = 30.0
    slope_mm = wall_mm * np.sin(steep) / np.sin(gentle)
    foot, ridge, end = -20.0, -20.0 + wall_mm, -20.0 + wall_mm + slope_mm
    bends = (Bend(foot, 3.0, steep), Bend(ridge, 3.0, -steep - gentle), Bend(end, 3.0, gentle))
    flat = page_grid(page_size_mm)
    vertices = roll(to_world(flat, page_size_mm), bends, azimuth=0.0)
    vertices[..., 2] -= vertices[..., 2].min()
    vertices[..., 0] -= (vertices[..., 0].min() + vertices[..., 0].max()) / 2
    return TrueSheet(vertices, flat)

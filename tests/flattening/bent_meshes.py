"""Triangle meshes with a known development, and meshes that have none."""

from __future__ import annotations

import numpy as np
from scipy.spatial import Delaunay

from deskew.types import Array
from tests.flattening.bent_sheets import cylinder, mirror_folds, rigid_error
from tests.flattening.bent_sheets import fold as fold_grid

Mesh = tuple[Array, Array, Array]  # vertices (V, 3), faces (F, 3), flat (V, 2)


def halves(rows: int, columns: int) -> Array:
    """Faces (F, 3) of a grid, wound counter-clockwise for rows along -Y and columns along +X."""
    number = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = _corners(number)
    return np.concatenate([np.stack([a, c, b], axis=-1), np.stack([b, c, d], axis=-1)])


def _corners(number: Array) -> tuple[Array, Array, Array, Array]:
    return number[:-1, :-1].ravel(), number[:-1, 1:].ravel(), number[1:, :-1].ravel(), number[1:, 1:].ravel()


def meshed(grid: Array, flat: Array) -> Mesh:
    """Make a mesh of a grid (R, C, 3) and its development (R, C, 2)."""
    return grid.reshape(-1, 3).copy(), halves(*grid.shape[:2]), flat.reshape(-1, 2)


def folded_mesh(n: int = 30, seed: int = 3, slope_deg: float = 20.0) -> Mesh:
    """A page with sharp mirror folds."""
    return meshed(*mirror_folds(seed, (n, n), slope_deg))


def arch(shape: tuple[int, int] = (25, 41)) -> Mesh:
    """A page bent to a half turn and more, radius 25 mm."""
    return meshed(*cylinder(25.0, shape))


def roll(turns: float, shape: tuple[int, int] = (9, 121), inner_mm: float = 15.0, gap_mm: float = 3.0) -> Mesh:
    """A sheet rolled to a spiral about Y; its development measures along the chords, as the mesh does."""
    angle = np.linspace(0, 2 * np.pi * turns, shape[1])
    radius = inner_mm + gap_mm * angle / (2 * np.pi)
    x, z = radius * np.cos(angle), radius * np.sin(angle)
    along = np.concatenate([[0], np.cumsum(np.hypot(np.diff(x), np.diff(z)))])
    y = np.linspace(0, -40, shape[0])[:, None]
    grid = np.stack(np.broadcast_arrays(x, y, z), axis=-1)
    return meshed(grid, np.stack(np.broadcast_arrays(along, y), axis=-1))


def irregular_fold(n: int = 400, seed: int = 0) -> Mesh:
    """Random points in Delaunay triangles, folded along mirrors."""
    rng = np.random.default_rng(seed)
    flat = rng.uniform(0, 1, (n, 2)) * (150.0, 100.0)
    faces = Delaunay(flat).simplices
    a, b, c = (flat[faces[:, k]] for k in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    faces[area < 0] = faces[area < 0][:, ::-1]
    faces = faces[np.abs(area) > 0.5]  # slivers along the hull
    sheet = np.pad(flat, ((0, 0), (0, 1)))[None]
    return fold_grid(sheet, rng, 0.12, 4)[0], faces, flat


def error_mm(vertices: Array, flat: Array, of: Array | None = None) -> Array:
    """Distances left after the best rotation and translation, of some vertices or all (V,) [mm]."""
    of = np.arange(len(flat)) if of is None else np.unique(of)
    return rigid_error(vertices[of, None, :2], flat[of, None])


def moebius() -> tuple[Array, Array]:
    """A strip with one side."""
    n, width = 40, 4
    t, w = np.meshgrid(np.linspace(0, 2 * np.pi, n, endpoint=False), np.linspace(-1, 1, width), indexing="ij")
    reach = 10 + w * np.cos(t / 2)
    vertices = np.stack([reach * np.cos(t), reach * np.sin(t), w * np.sin(t / 2)], axis=-1).reshape(-1, 3)
    here = np.arange(n * width).reshape(n, width)
    there = np.concatenate([here[1:], here[:1, ::-1]])
    a, b, c, d = (k.ravel() for k in (here[:, :-1], there[:, :-1], here[:, 1:], there[:, 1:]))
    return vertices, np.concatenate([np.stack([a, b, c], axis=-1), np.stack([c, b, d], axis=-1)])


def torus(n: int = 12, m: int = 8) -> tuple[Array, Array]:
    """A closed surface with a handle."""
    u, v = np.meshgrid(2 * np.pi * np.arange(n) / n, 2 * np.pi * np.arange(m) / m, indexing="ij")
    reach = 10 + 3 * np.cos(v)
    vertices = np.stack([reach * np.cos(u), reach * np.sin(u), 3 * np.sin(v)], axis=-1).reshape(-1, 3)
    number = np.pad(np.arange(n * m).reshape(n, m), ((0, 1), (0, 1)), mode="wrap")
    a, b, c, d = _corners(number)
    return vertices, np.concatenate([np.stack([a, c, b], axis=-1), np.stack([b, c, d], axis=-1)])

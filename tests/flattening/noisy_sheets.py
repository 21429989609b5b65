"""Dense scans as triangle meshes, of sheets whose development is known."""

from __future__ import annotations

import numpy as np

from deskew.io.meshes import grid_faces
from deskew.types import Array
from tests.flattening.bent_sheets import cylinder, mirror_folds

Scan = tuple[Array, Array, Array]


def triangulated(grid: Array) -> tuple[Array, Array]:
    """Vertices (V, 3) and faces (F, 3) of an (R, C, 3) grid."""
    return grid.reshape(-1, 3), grid_faces(*grid.shape[:2])


def arch() -> Scan:
    """Vertices, faces and flat places (V, 2) of a bent page of 100 x 60 mm, 1.2 mm apart."""
    bent, flat = cylinder(70.0, (51, 84))
    return *triangulated(bent), flat.reshape(-1, 2)


def folds() -> Scan:
    """Return a page of 279 x 216 mm with eight sharp folds, 1.5 mm apart."""
    bent, flat = mirror_folds(4, (145, 187))
    return *triangulated(bent), flat.reshape(-1, 2)


def roof(slope: float = 0.5, offset_mm: float = 0.4, turn: float = 0.0) -> Scan:
    """Return two planes that rise by `slope` to a ridge through the middle, `offset_mm` beside a vertex line."""
    u, v = np.meshgrid(1.2 * np.arange(61) - 36, 1.2 * np.arange(51) - 30)
    c, s = np.cos(turn), np.sin(turn)
    across, along = c * u + s * v - offset_mm, c * v - s * u
    x = across / np.hypot(1, slope)
    grid = np.stack([c * x - s * along, s * x + c * along, 30 - slope * abs(x)], axis=-1)
    return *triangulated(grid), np.stack([u, v], axis=-1).reshape(-1, 2)


def scroll() -> Scan:
    """Return a page rolled by three quarters of a turn: a mesh with overhangs."""
    bent, flat = cylinder(100 / 4.7, (51, 84))
    return *triangulated(bent), flat.reshape(-1, 2)


def noisy(vertices: Array, sigma: float = 0.3, seed: int = 11) -> Array:
    """Vertices with white noise on z."""
    scan = vertices.copy()
    scan[:, 2] += np.random.default_rng(seed).normal(0, sigma, len(scan))
    return scan


SHEETS = {"arch": arch, "folds": folds, "roof": roof}

"""Sheets with a known development, and particles that no sheet holds together."""

from __future__ import annotations

import numpy as np

from deskew.flattening.forces import System
from deskew.types import Array


def flat_grid(shape: tuple[int, int] = (9, 11), size_mm: tuple[float, float] = (60.0, 48.0)) -> Array:
    """Vertices (R, C, 3) of a flat page: columns along +X, rows along -Y."""
    x, y = np.meshgrid(np.linspace(0, size_mm[0], shape[1]), np.linspace(0, -size_mm[1], shape[0]))
    return np.stack([x, y, np.zeros_like(x)], axis=-1)


def cylinder(radius_mm: float, shape: tuple[int, int] = (15, 21)) -> tuple[Array, Array]:
    """A page bent into an arch about Y, and its exact development (both (R, C, ...) [mm])."""
    flat = flat_grid(shape, (100.0, 60.0))
    angle = (flat[..., 0] - 50.0) / radius_mm
    bent = np.stack([radius_mm * np.sin(angle), flat[..., 1], radius_mm * np.cos(angle)], axis=-1)
    return bent, flat[..., :2]


def mirror_folds(
    seed: int, shape: tuple[int, int] = (45, 45), slope_deg: float = 20.0, n_folds: int = 8
) -> tuple[Array, Array]:
    """A page folded isometrically to a p90 slope, and its development (both (R, C, ...) [mm])."""
    flat = flat_grid(shape, (279.0, 216.0))
    low, high = 0.0, 0.6
    for _ in range(20):
        tilt = (low + high) / 2
        sheet = upright(fold(flat, np.random.default_rng(seed), tilt, n_folds))
        low, high = (tilt, high) if slope_p90_deg(sheet) < slope_deg else (low, tilt)
    return sheet, flat[..., :2]


def fold(sheet: Array, rng: np.random.Generator, tilt: float, n_folds: int) -> Array:
    """Replace what lies beyond a plane tilted by about `tilt` [rad] by its mirror image, again and again."""
    for _ in range(n_folds):
        through = sheet[rng.integers(sheet.shape[0]), rng.integers(sheet.shape[1])]
        polar, azimuth = tilt * rng.uniform(0.6, 1.2), rng.uniform(0, 2 * np.pi)
        normal = np.array([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)])
        side = np.maximum if rng.random() < 0.5 else np.minimum
        sheet = sheet - 2 * side((sheet - through) @ normal, 0.0)[..., None] * normal
    return sheet


def upright(sheet: Array) -> Array:
    """Turn a page so that its best plane is level, right side up."""
    centred = sheet.reshape(-1, 3) - sheet.reshape(-1, 3).mean(axis=0)
    axes = np.linalg.svd(centred, full_matrices=False)[2]
    up = axes[2] * np.sign(axes[2, 2])
    along = axes[0] * np.sign(axes[0, 0])
    return (centred @ np.stack([along, np.cross(up, along), up]).T).reshape(sheet.shape)


def rigid_error(xy: Array, truth: Array) -> Array:
    """Distances left between two (R, C, 2) grids after the best rotation and translation, (V,) [mm]."""
    a, b = xy.reshape(-1, 2) - xy.mean(axis=(0, 1)), truth.reshape(-1, 2) - truth.mean(axis=(0, 1))
    u, _, vt = np.linalg.svd(a.T @ b)
    turn = u @ np.diag([1.0, np.linalg.det(u @ vt)]) @ vt
    return np.linalg.norm(a @ turn - b, axis=1)


def slope_p90_deg(vertices: Array) -> float:
    """90th percentile of the quads' slopes."""
    normals = np.cross(np.diff(vertices, axis=1)[:-1], np.diff(vertices, axis=0)[:, :-1])
    return float(
        np.degrees(np.percentile(np.arctan2(np.linalg.norm(normals[..., :2], axis=-1), abs(normals[..., 2])), 90))
    )


def free_particles(n: int, gravity: float, drag: float = 0.0) -> System:
    """Particles of unit mass that no spring joins."""
    return System(np.zeros((4, n)), np.zeros((4, n)), n, 0.0, 1.0, gravity, drag)

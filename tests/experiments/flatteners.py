"""Methods under test that know that their sheet is a cylinder of 25 mm about Y, and an integrator that is none."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from deskew.types import Array, Flattened, Floats, Sheet, Status


def _unrolled(sheet: Sheet) -> Floats:
    x, y, z = sheet.vertices.T
    return np.column_stack([25.0 * np.arctan2(x, z), y, 0 * y])


def unroll(sheet: Sheet, **settings: Any) -> Flattened:
    radius = np.linalg.norm(sheet.vertices[:, [0, 2]], axis=1)
    noise = float(np.abs(radius - 25.0).max())
    return Flattened(_unrolled(sheet), Status.AT_REST, "", {"noise_estimated_mm": noise} | settings)


def project(sheet: Sheet) -> Flattened:
    return Flattened(sheet.vertices * [1.0, 1.0, 0.0], Status.LOCKED, "push harder")


def fold(sheet: Sheet) -> Flattened:
    flat = _unrolled(sheet)
    if len(flat) > 100:
        flat[40, 0] += 2.5
    return Flattened(flat, Status.FOLDED, "try again")


def mirror(sheet: Sheet) -> Flattened:
    return Flattened(_unrolled(sheet) * [-1.0, 1.0, 1.0], Status.AT_REST)


def stand_still(x: Array, v: Array, acceleration: Callable[[Array, Array], Array], dt: float) -> tuple[Array, Array]:
    """Step nowhere: an integrator that is none."""
    return x, v

"""Arrays, and what every type asks of them."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from deskew.errors import require

Array = npt.NDArray[Any]
Floats = npt.NDArray[np.floating[Any]]
Size = tuple[int, int]

# Squares of lengths beyond these vanish or overflow, and what is a page has lost its digits before.
SHORTEST_MM, FARTHEST_MM = 1e-9, 1e9


def require_finite(name: str, values: Array, shape: tuple[int, ...]) -> None:
    """Require an array of a shape, without NaN and infinity."""
    require(values.shape == shape, name, f"have shape {shape}", values.shape)
    require(bool(np.isfinite(values).all()), name, "be finite", "NaN or infinity")


def require_places(name: str, places: Array) -> None:
    """Require places (..., N) [mm] that are finite and within `FARTHEST_MM` of the origin along each axis."""
    n_bad = int((~np.isfinite(places)).any(-1).sum())
    require(n_bad == 0, name, "be finite", f"{n_bad} places with NaN or infinity")
    farthest = float(np.abs(places).max(initial=0.0))
    require(farthest <= FARTHEST_MM, name, f"lie within {FARTHEST_MM:g} mm of the origin", f"{farthest:g} mm")


def require_numbers(name: str, values: object, kinds: str) -> None:
    """Require an array of one of numpy's `kinds`: "iu" of whole numbers, "fiu" of real ones."""
    got = values.dtype if isinstance(values, np.ndarray) else type(values).__name__
    good = isinstance(values, np.ndarray) and values.dtype.kind in kinds
    if good and np.ma.is_masked(values):
        good, got = False, "masked values"
    require(good, name, f"be an array of {'whole' if kinds == 'iu' else 'real'} numbers", got)


def require_size(name: str, size: Size) -> None:
    """Require (width, height) of at least one pixel."""
    require(len(size) == 2 and min(size) >= 1, name, "be (width, height) of at least 1 pixel", size)

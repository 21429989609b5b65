"""Arrays, and what every type asks of them."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from deskew.errors import require

Array = npt.NDArray[Any]
Floats = npt.NDArray[np.floating[Any]]
Size = tuple[int, int]


def require_finite(name: str, values: Array, shape: tuple[int, ...]) -> None:
    """Require an array of a shape, without NaN and infinity."""
    require(values.shape == shape, name, f"have shape {shape}", values.shape)
    require(bool(np.isfinite(values).all()), name, "be finite", "NaN or infinity")


def require_numbers(name: str, values: object, kinds: str) -> None:
    """Require an array of one of numpy's `kinds`: "iu" of whole numbers, "fiu" of real ones."""
    got = values.dtype if isinstance(values, np.ndarray) else type(values).__name__
    good = isinstance(values, np.ndarray) and values.dtype.kind in kinds
    require(good, name, f"be an array of {'whole' if kinds == 'iu' else 'real'} numbers", got)


def require_size(name: str, size: Size) -> None:
    """Require (width, height) of at least one pixel."""
    require(len(size) == 2 and min(size) >= 1, name, "be (width, height) of at least 1 pixel", size)

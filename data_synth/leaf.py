"""The vellum leaf in its paper sleeve: which part of a page is which material."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from data_synth.sheets import PAGE_SIZE_MM
from deskew.errors import require
from deskew.types import Floats


@dataclass(frozen=True, slots=True)
class Leaf:
    """A rectangle of the page's aspect with rounded corners, in the middle of the page; the rest is the sleeve.

    Attributes
    ----------
    page_size_mm : (width, height)
        Page [mm].
    share : float
        Of the page's area, in [0.1, 0.9].
    corner_mm : float
        Radius of the corners, not negative and no more than a quarter of the page's short side.
    """

    page_size_mm: tuple[float, float] = PAGE_SIZE_MM
    share: float = 0.6
    corner_mm: float = 5.0

    def __post_init__(self) -> None:
        require(0.1 <= self.share <= 0.9, "share", "be in [0.1, 0.9]", self.share)
        largest = min(self.page_size_mm) / 4
        fits = 0 <= self.corner_mm <= largest and 2 * self.corner_mm < min(self.size_mm)
        require(fits, "corner_mm", f"be in [0, {largest:g}] and fit into the leaf", self.corner_mm)

    @property
    def size_mm(self) -> tuple[float, float]:
        """Width and height between the straight edges [mm]."""
        width, height = self.page_size_mm
        # The corners cut (4 - pi) r^2 off the rectangle.
        scale = np.sqrt(self.share + (4 - np.pi) * self.corner_mm**2 / (width * height))
        return float(scale * width), float(scale * height)

    def depth(self, u: Floats, v: Floats) -> Floats:
        """Distance of page points (u, v) to the leaf's border [mm]: positive on the leaf, negative on the sleeve."""
        half_u, half_v = (extent / 2 - self.corner_mm for extent in self.size_mm)
        # Beyond the rectangle of the corners' centres.
        x = np.abs(np.asarray(u) - self.page_size_mm[0] / 2) - half_u
        y = np.abs(np.asarray(v) - self.page_size_mm[1] / 2) - half_v
        return np.asarray(
            self.corner_mm - np.hypot(np.maximum(x, 0), np.maximum(y, 0)) - np.minimum(np.maximum(x, y), 0)
        )

    def holds(self, u: Floats, v: Floats) -> Floats:
        """Whether page points (u, v) [mm] lie on the leaf: bool array."""
        return np.asarray(self.depth(u, v) > 0)

"""A picture of a lettered page, read by machine: its misses, and how unevenly its blank paper is lit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from data_synth import Lettered
from deskew import metrics, projection, restoration
from deskew.metrics import Misses, OcrEngine
from deskew.types import Array, Floats, Pinhole
from experiments.studies.placed import Placed

INSET_MM = 6.0
"""All pictures are cut alike: to the flat page's place less this border, so that a flat page shows no desk."""

# Paper counts as blank this far from any ink and from the page's border.
_BLANK_MM = 3.0


@dataclass(frozen=True, slots=True)
class PageReader:
    """Reads pictures of one page seen through one ideal camera.

    Attributes
    ----------
    engine : OcrEngine
        The reading machine.
    page : Lettered
        The true page; only the count and the blank paper know of it.
    view : Pinhole
        The ideal camera of the pictures.
    """

    engine: OcrEngine
    page: Lettered
    view: Pinhole

    @property
    def capital_px(self) -> float:
        """Height of a capital of the flat page [px]."""
        at, above = projection.project(self.view, np.array([(0.0, 0.0, 0.0), (0.0, self.page.capital_mm, 0.0)]))
        return float(np.linalg.norm(above - at))

    def cut(self, image: Array) -> Array:
        """Cut a picture (height, width) to the flat page's place."""
        return cut_to_page(image, self.view, self.page.page_size_mm)

    def placed(self, image: Array, true_uv: Floats | None) -> Array:
        """Bring a picture of the page alone, at any size, to where the flat page lies in the view.

        Parameters
        ----------
        image : (h, w) array
            The picture.
        true_uv : (h, w, 2) array or None
            True page coordinates of its pixels [mm], NaN off the page; without them its edges are taken for the page's.
        """
        own: Floats
        uv: Floats
        page = np.array(self.page.page_size_mm)
        height, width = image.shape[:2]
        if true_uv is None:
            share = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
            own, uv = np.asarray(share * (width, height) - 0.5), np.asarray(share * page)
        else:
            own, uv = projection.pixel_grid((width, height)).reshape(-1, 2), np.asarray(true_uv).reshape(-1, 2)
        flat = np.column_stack([(uv - page / 2) * (1.0, -1.0), np.zeros(len(uv))])
        return Placed.onto(self.view, image, own, projection.project(self.view, flat)).image

    def misses(self, image: Array, suffix: str = "") -> dict[str, float]:
        """Read a picture and count `misses` and its parts; `letters` and `error_rate_percent` too."""
        found = self._count(self.engine.read(self.cut(image), self.capital_px))
        return found.figures(suffix) if suffix else _counts(found)

    def shuffled_misses(self, rng: np.random.Generator) -> dict[str, float]:
        """Count the misses of the true letters in random order: what a reading scores that has nothing but them."""
        return _counts(self._count(metrics.shuffled(" ".join(self.page.words), rng)))

    def _count(self, read: str) -> Misses:
        return metrics.count_misses(read, " ".join(self.page.words))

    def normalised_misses(self, image: Array) -> dict[str, float]:
        """Read a picture divided by its local white; `misses_normalised` and its parts."""
        return self.misses(restoration.divide_by_local_white(image, self.capital_px), "_normalised")

    def blank(self, true_uv: Floats) -> npt.NDArray[np.bool_]:
        """Mark the pixels that show blank paper, (H, W), from the true page coordinates of each (H, W, 2) [mm]."""
        u, v = true_uv.reshape(-1, 2).T
        width, height = self.page.page_size_mm
        # NaN, off the page, is not inside either.
        inside = (u > _BLANK_MM) & (u < width - _BLANK_MM) & (v > _BLANK_MM) & (v < height - _BLANK_MM)
        pixels = np.flatnonzero(inside)
        side = np.full(pixels.size, 2 * _BLANK_MM)
        inside[pixels] = self.page.lettering.coverage(u[pixels], v[pixels], side, side) == 0.0
        return np.asarray(inside.reshape(true_uv.shape[:2]))


def cut_to_page(image: Array, view: Pinhole, page_size_mm: tuple[float, float]) -> Array:
    """Cut a picture (height, width), seen through an ideal camera, to the flat page's place less `INSET_MM`."""
    half = np.array(page_size_mm) / 2 - INSET_MM
    corners = np.array([(-half[0], half[1], 0.0), (half[0], -half[1], 0.0)])
    (left, top), (right, bottom) = np.rint(projection.project(view, corners)).astype(int)
    return image[max(top, 0) : bottom, max(left, 0) : right]


def _counts(found: Misses) -> dict[str, float]:
    rate = 100.0 * found.character_error_rate
    return found.figures() | {
        "letters": float(found.letters),
        "error_rate_percent": rate,
        "without_miss": float(found.total == 0),
    }


def shading_percent(image: Array, blank: npt.NDArray[np.bool_]) -> float:
    """Return the standard deviation over the mean of blank paper's grey levels: 0 for even light without noise."""
    paper = image[blank].astype(np.float64)
    return float(100.0 * paper.std() / paper.mean())

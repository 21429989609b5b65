"""Whether hidden writing shows in a picture of a page: as a pattern, and letter by letter."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from data_synth import Layer, Manuscript, glyph
from data_synth.lettering import ALPHABET
from deskew import projection
from deskew.metrics import fit_rigid
from deskew.types import Array, Floats, Pinhole

# Shading varies more slowly than letters do: the standard deviation of what is taken out, and of the local contrast.
_LOCAL_MM = 5.0
# Visible ink is left out of the comparison with this much around it.
_INK_REACH_MM = 1.0
# Room around a letter in which it is compared.
_ROOM_MM = 0.5
# What a picture is compared with is averaged over this much: a pixel, the lens's blur and the restoration's.
_FOOTPRINT_PX = 2.0
# A letter counts if so much of its box is free of visible ink, and that is so many pixels.
_FREE_MIN, _N_PIXELS_MIN = 0.6, 30


@dataclass(frozen=True, slots=True)
class _Letter:
    """One hidden letter's place: its `pixels` (n,) in the flattened picture, and every letter's `patterns` (22, n)."""

    letter: str
    pixels: npt.NDArray[np.intp]
    patterns: Floats


@dataclass(frozen=True, slots=True)
class Reader:
    """Knows the true page and where a picture should show each bit of it, were the page flat.

    Attributes
    ----------
    page : (H, W) bool array
        Pixels that show the page free of visible ink.
    pixel_mm : float
        Side of a pixel on the bed.
    texts : mapping of Layer to (pixels, pattern)
        The pixels (n,) around each hidden text, and how it shows there (n,).
    letters : mapping of Layer to list of _Letter
        Those of its letters that visible ink leaves free.
    """

    page: npt.NDArray[np.bool_]
    pixel_mm: float
    texts: dict[Layer, tuple[npt.NDArray[np.intp], Floats]]
    letters: dict[Layer, list[_Letter]]

    @classmethod
    def of(cls, manuscript: Manuscript, true_uv: Floats, view: Pinhole) -> Reader:
        """Lay the flat page where the picture's own page lies best, by a rotation and a translation alone.

        Parameters
        ----------
        manuscript : Manuscript
            The true page.
        true_uv : (H, W, 2) array
            True page coordinates of each pixel [mm], NaN off the page.
        view : Pinhole
            The ideal camera of the picture.
        """
        shown = np.isfinite(true_uv).all(axis=-1)
        places = projection.onto_bed(view, projection.pixel_grid(view.size))
        mirror = np.array([1.0, -1.0])  # v runs against the world's Y
        uv = fit_rigid(places[shown], true_uv[shown] * mirror).apply(places) * mirror
        pixel_mm = float(np.median(np.linalg.norm(np.diff(places, axis=1), axis=-1)))
        u, v = uv[..., 0].ravel(), uv[..., 1].ravel()
        side = np.full(u.shape, 2 * _INK_REACH_MM)
        inked = manuscript.visible.lettering.coverage(u, v, side, side).reshape(shown.shape) > 0
        page = shown & ~inked
        texts = {layer: _around_text(manuscript, layer, uv, page, pixel_mm) for layer in manuscript.hidden}
        letters = {layer: _free_letters(manuscript, layer, uv, page, pixel_mm) for layer in manuscript.hidden}
        return cls(page, pixel_mm, texts, letters)

    def flattened_contrast(self, image: Array) -> Floats:
        """Return a picture (H, W) with level and contrast made alike everywhere, 0 where it is not compared."""
        sigma = _LOCAL_MM / self.pixel_mm
        weight = self.page.astype(np.float64)
        share = cv2.GaussianBlur(weight, (0, 0), sigma) + 1e-9
        values = np.where(self.page, image.astype(np.float64), 0.0)
        varied = weight * (values - cv2.GaussianBlur(values, (0, 0), sigma) / share)
        spread = np.sqrt(cv2.GaussianBlur(varied**2, (0, 0), sigma) / share)
        floor = 0.05 * float(np.median(spread[self.page])) + 1e-9
        return np.asarray(varied / np.maximum(spread, floor))

    def correlation(self, contrast: Floats, layer: Layer) -> float:
        """Correlation of a picture of :meth:`flattened_contrast` with a hidden text, whichever way its contrast goes.

        Only pixels near the text's letters count, so that blank page does not dilute it.
        """
        pixels, pattern = self.texts[layer]
        return _agreement(contrast.ravel()[pixels], pattern)

    def letters_read(self, contrast: Floats, layer: Layer) -> float:
        """Share of a hidden text's letters that resemble themselves more than any other letter of the alphabet.

        A letter is looked for where it should be and nowhere else; letters that visible ink covers are left out.
        Guessing reads 1 in 22.
        """
        values = contrast.ravel()
        right = 0
        for place in self.letters[layer]:
            scores = [_agreement(values[place.pixels], pattern) for pattern in place.patterns]
            right += ALPHABET[int(np.argmax(scores))] == place.letter
        return right / max(len(self.letters[layer]), 1)


def _agreement(a: Floats, b: Floats) -> float:
    """Size of the correlation of two signals, 0 where one is even."""
    a, b = a - a.mean(), b - b.mean()
    norm = float(np.linalg.norm(a) * np.linalg.norm(b))
    return abs(float(a @ b)) / norm if norm > 0 else 0.0


def _around_text(
    manuscript: Manuscript, layer: Layer, uv: Floats, page: npt.NDArray[np.bool_], pixel_mm: float
) -> tuple[npt.NDArray[np.intp], Floats]:
    u, v = uv[..., 0].ravel(), uv[..., 1].ravel()
    near = np.full(u.size, 2 * _LOCAL_MM)
    pixels = np.flatnonzero(page.ravel() & (manuscript.hidden[layer].coverage(u, v, near, near) > 0))
    side = np.full(pixels.size, _FOOTPRINT_PX * pixel_mm)
    return pixels, manuscript.writing(layer, u[pixels], v[pixels], side)


def _free_letters(
    manuscript: Manuscript, layer: Layer, uv: Floats, page: npt.NDArray[np.bool_], pixel_mm: float
) -> list[_Letter]:
    hidden = manuscript.hidden[layer]
    glyphs = [glyph(letter, hidden.capital_mm) for letter in ALPHABET]
    to_pixel = _page_to_pixel(uv)
    places = []
    for letter, u0, v0, width in hidden.letters:
        pixels = _box(uv, to_pixel, (u0, v0 - hidden.capital_mm), (width, hidden.capital_mm), pixel_mm)
        free = pixels[page.ravel()[pixels]]
        if free.size < max(_N_PIXELS_MIN, _FREE_MIN * pixels.size):
            continue
        u, v = uv.reshape(-1, 2)[free].T
        side = np.full(free.size, _FOOTPRINT_PX * pixel_mm)
        du, dv = u - (u0 + width / 2), v - v0 + 2 * hidden.capital_mm
        patterns = [manuscript.pattern(layer, one, du + one.page_size_mm[0] / 2, dv, side) for one in glyphs]
        places.append(_Letter(letter, free, np.stack(patterns)))
    return places


def _page_to_pixel(uv: Floats) -> Floats:
    """Affine map (3, 2) from page coordinates (u, v, 1) to pixels: the view looks nearly straight down."""
    height, width = uv.shape[:2]
    pixels = np.stack(np.meshgrid(np.arange(0, width, 16), np.arange(0, height, 16)), axis=-1).reshape(-1, 2)
    points = uv[pixels[:, 1], pixels[:, 0]]
    design = np.concatenate([points, np.ones((len(points), 1))], axis=1)
    return np.asarray(np.linalg.lstsq(design, pixels.astype(np.float64), rcond=None)[0])


def _box(
    uv: Floats, to_pixel: Floats, start: tuple[float, float], extent: tuple[float, float], pixel_mm: float
) -> npt.NDArray[np.intp]:
    """Flat indices of the pixels that should show a box of the page with a little room around it."""
    (u, v), (w, h) = start, extent
    corners = np.array([[u + a * w, v + b * h, 1.0] for a in (0, 1) for b in (0, 1)]) @ to_pixel
    room = _ROOM_MM / pixel_mm + 4.0
    height, width = uv.shape[:2]
    left, top = np.maximum(np.floor(corners.min(axis=0) - room), 0).astype(int)
    right, bottom = np.minimum(np.ceil(corners.max(axis=0) + room), (width, height)).astype(int)
    part = uv[top:bottom, left:right]
    inside = (np.abs(part - (u + w / 2, v + h / 2)) <= (w / 2 + _ROOM_MM, h / 2 + _ROOM_MM)).all(axis=-1)
    rows, columns = np.nonzero(inside)
    return np.asarray((rows + top) * width + columns + left)

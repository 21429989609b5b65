"""Pages that answer each kind of light in their own way: a lettered one, and one with writing that one light shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from data_synth.lettering import Lettering, pseudo_words, set_words
from data_synth.pages import INK_ALBEDO, PAPER_ALBEDO, Page
from data_synth.sheets import PAGE_SIZE_MM
from deskew.types import Floats

# How far a stroke that a stylus pressed into the page leans at its flanks, as a slope, and how wide a flank is [mm].
_STROKE_SLOPE, _FLANK_MM = 0.12, 0.5
RAKING_BEARING = (-1.0, 0.0)
"""Direction from the page to the standard raking lamp, in page coordinates."""


class Layer(StrEnum):
    """What of a page a light brings out."""

    REFLECTANCE = "reflectance"
    RELIEF = "relief"  # reflectance under light so low that the slope of a pressed stroke shows
    FLUORESCENCE = "fluorescence"
    TRANSMITTANCE = "transmittance"


# What paper and visible ink give back or let through in each layer, and what hidden writing there does.
_PAPER = {Layer.REFLECTANCE: PAPER_ALBEDO, Layer.RELIEF: PAPER_ALBEDO, Layer.FLUORESCENCE: 0.40}
_PAPER[Layer.TRANSMITTANCE] = 0.50
_INK = {Layer.REFLECTANCE: INK_ALBEDO, Layer.RELIEF: INK_ALBEDO, Layer.FLUORESCENCE: 0.06, Layer.TRANSMITTANCE: 0.12}
_HIDDEN = {Layer.FLUORESCENCE: 0.80, Layer.TRANSMITTANCE: 0.28}


@dataclass(frozen=True, slots=True)
class Lettered:
    """Black letters on white paper, for reading machines (section 4.2).

    Attributes
    ----------
    words : sequence of str
        What is printed; :func:`data_synth.page_words` draws the paper's 176 letters.
    page_size_mm : (width, height)
        Page [mm].
    capital_mm : float
        Height of a capital [mm].
    margin_mm : float
        Free border all round [mm].
    """

    words: Sequence[str]
    page_size_mm: tuple[float, float] = PAGE_SIZE_MM
    capital_mm: float = 10.0
    margin_mm: float = 16.0
    lettering: Lettering = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        lettering = set_words(self.words, self.page_size_mm, capital_mm=self.capital_mm, margin_mm=self.margin_mm)
        object.__setattr__(self, "lettering", lettering)

    @property
    def lines(self) -> tuple[str, ...]:
        """What a reader should find, line by line."""
        return self.lettering.lines

    def albedo(self, u: Floats, v: Floats, du: Floats, dv: Floats) -> Floats:
        """Return the mean reflectance over footprints, exact for the drawn letters."""
        return PAPER_ALBEDO + (INK_ALBEDO - PAPER_ALBEDO) * self.lettering.coverage(u, v, du, dv)


@dataclass(frozen=True, slots=True)
class Manuscript:
    """A lettered page that carries three more texts, each shown by one light alone.

    Attributes
    ----------
    visible : Lettered
        The print, which every light shows.
    hidden : mapping of Layer to Lettering
        `FLUORESCENCE`: an erased ink that glows; `TRANSMITTANCE`: ink under a pasted strip, which holds light back;
        `RELIEF`: strokes of a dry stylus.
    """

    visible: Lettered
    hidden: dict[Layer, Lettering]

    @property
    def page_size_mm(self) -> tuple[float, float]:
        """Width and height [mm]."""
        return self.visible.page_size_mm

    def albedo(self, u: Floats, v: Floats, du: Floats, dv: Floats) -> Floats:
        """Return what white light and the projector show: the print alone."""
        return self.visible.albedo(u, v, du, dv)

    def under(self, layer: Layer, bearing: tuple[float, float] = RAKING_BEARING, cotangent: float = 0.0) -> Page:
        """Return the page as one light sees it.

        Parameters
        ----------
        layer : Layer
            What the light brings out.
        bearing : (2,) tuple
            Unit direction from the page to the lamp, in page coordinates; for `RELIEF` alone.
        cotangent : float
            Of the lamp's height above the horizon; for `RELIEF` alone.
        """
        return _Face(self, layer, bearing, cotangent)

    def writing(self, layer: Layer, u: Floats, v: Floats, side: Floats) -> Floats:
        """Return what a layer's hidden text adds at page points (u, v), over cells of `side` [mm]: (N,)."""
        return self.pattern(layer, self.hidden[layer], u, v, side)

    def pattern(self, layer: Layer, text: Lettering, u: Floats, v: Floats, side: Floats) -> Floats:
        """Return how a text shows in a layer, up to a factor: as it covers the page, or as its strokes' flanks lean."""
        if layer is Layer.RELIEF:
            return flank_lean(text, RAKING_BEARING, u, v, side, side)
        return text.coverage(u, v, side, side)


@dataclass(frozen=True, slots=True)
class _Face:
    """A manuscript under one light: a page with one layer."""

    manuscript: Manuscript
    layer: Layer
    bearing: tuple[float, float]
    cotangent: float

    @property
    def page_size_mm(self) -> tuple[float, float]:
        return self.manuscript.page_size_mm

    def albedo(self, u: Floats, v: Floats, du: Floats, dv: Floats) -> Floats:
        """Return the layer's mean over footprints."""
        layer, manuscript = self.layer, self.manuscript
        ink = manuscript.visible.lettering.coverage(u, v, du, dv)
        level: Floats = np.full(np.shape(u), _PAPER[layer])
        if layer in _HIDDEN:
            level += (_HIDDEN[layer] - level) * manuscript.hidden[layer].coverage(u, v, du, dv)
        level += (_INK[layer] - level) * ink
        if layer is Layer.RELIEF:
            text = manuscript.hidden[layer]
            level *= 1.0 + self.cotangent * _STROKE_SLOPE * flank_lean(text, self.bearing, u, v, du, dv)
        return level


def flank_lean(text: Lettering, bearing: tuple[float, float], u: Floats, v: Floats, du: Floats, dv: Floats) -> Floats:
    """How far the flanks of pressed strokes lean to a lamp, in -1 to 1: light there gains cot(height) slope times it.

    The stroke lies below the page, so it is the flank away from the lamp that faces it.
    """
    a, b = (_FLANK_MM / 2 * part for part in bearing)
    return text.coverage(u - a, v - b, du, dv) - text.coverage(u + a, v + b, du, dv)


def hidden_manuscript(rng: np.random.Generator, page_size_mm: tuple[float, float] = PAGE_SIZE_MM) -> Manuscript:
    """Draw a page of print with three hidden texts across it, each of other words and in other lines."""
    visible = Lettered(pseudo_words(rng), page_size_mm, capital_mm=7.0)
    sizes = {Layer.FLUORESCENCE: 9.0, Layer.TRANSMITTANCE: 11.0, Layer.RELIEF: 13.0}
    hidden = {
        layer: set_words(pseudo_words(rng, n, 6), page_size_mm, capital_mm=capital, margin_mm=22.0)
        for n, (layer, capital) in zip((14, 12, 9), sizes.items(), strict=True)
    }
    return Manuscript(visible, hidden)

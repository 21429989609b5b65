"""A leaf of a medieval manuscript, set in a paper sleeve: ruled, written in two columns, with a decorated initial."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from matplotlib.artist import Artist
from matplotlib.font_manager import FontProperties
from matplotlib.patches import Ellipse, FancyBboxPatch, PathPatch, Rectangle
from matplotlib.path import Path
from matplotlib.textpath import TextPath
from matplotlib.transforms import Affine2D

from data_synth.drawing import CELLS_PER_MM, drawn, integral_of, mean_over
from data_synth.initial import initial
from data_synth.leaf import Leaf
from data_synth.pages import PAPER_ALBEDO
from data_synth.splines import spline
from deskew.types import Floats

VELLUM_ALBEDO = 0.60
_INK, _RUBRIC, _RULE, _SEAM, _PRICK = "0.11", "0.30", "0.50", "0.47", "0.2"

_MARGIN_MM, _GUTTER_MM, _PITCH_MM, _X_HEIGHT_MM = 18.0, 12.0, 7.0, 2.6
_N_LINES = 19
_INITIAL_LINES = 7
_SQUEEZED = 0.82  # written narrow and heavy, as book hands are
_FONT = FontProperties(family="DejaVu Serif", weight="bold")
_X_OVER_SIZE = 0.532  # height of DejaVu Serif's x over its size

# What mottles vellum, clouds of the skin to its grain: distance of the random numbers [mm] and what they do to albedo.
_MOTTLE = ((30.0, 0.016), (7.0, 0.010), (0.7, 0.008))

_LATIN = (
    "in principio erat verbum et apud deum hoc omnia per ipsum facta sunt sine ipso factum est nihil quod vita lux "
    "hominum lucet tenebris eam non fuit homo missus cui nomen venit testimonium ut perhiberet de "
    "lumine crederent illum quae illuminat omnem venientem mundum mundo eum cognovit propria sui receperunt quotquot "
    "autem dedit eis potestatem filios fieri his qui credunt nomine eius sanguinibus neque voluntate carnis viri sed "
    "nati caro habitavit nobis vidimus gloriam quasi unigeniti patris plenum gratiae veritatis"
)


@dataclass(frozen=True, slots=True)
class VellumPage:
    """A manuscript leaf in its sleeve, drawn anew for every seed: other words, another initial, another skin.

    Attributes
    ----------
    seed : int
        Of what is written and how the vellum is mottled.
    leaf : Leaf
        Where the vellum is.
    """

    seed: int
    leaf: Leaf = field(default_factory=Leaf)
    integral: Floats = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        rng = np.random.default_rng(self.seed)
        ink = drawn(_artists(self.leaf, rng), self.page_size_mm, ground=PAPER_ALBEDO)
        object.__setattr__(self, "integral", integral_of((1.0 - ink) * _mottled(self.leaf, ink.shape, rng)))

    @property
    def page_size_mm(self) -> tuple[float, float]:
        """Width and height of leaf and sleeve together [mm]."""
        return self.leaf.page_size_mm

    def albedo(self, u: Floats, v: Floats, du: Floats, dv: Floats) -> Floats:
        """Return the mean reflectance over footprints, exact for the drawn cells, of what of them lies on the page."""
        (u, du), (v, dv) = (
            _on_page(x, side, extent) for x, side, extent in zip((u, v), (du, dv), self.page_size_mm, strict=True)
        )
        return mean_over(self.integral, u, v, du, dv)


def _on_page(x: Floats, side: Floats, extent: float) -> tuple[Floats, Floats]:
    """Cut footprints at the page's border: middles and sides [mm]; those beyond it become its outermost .01 mm."""
    low = np.clip(np.asarray(x, dtype=np.float64) - np.asarray(side) / 2, 0.0, extent - 0.01)
    high = np.clip(np.asarray(x, dtype=np.float64) + np.asarray(side) / 2, low + 0.01, extent)
    return (low + high) / 2, high - low


def _mottled(leaf: Leaf, shape: tuple[int, ...], rng: np.random.Generator) -> Floats:
    """Factors on the cells' albedo: 1 on the sleeve, clouds and grain on the vellum, which darkens to its border."""
    factor = np.ones(shape)
    for distance_mm, strength in _MOTTLE:
        rows, columns = (int(n / CELLS_PER_MM / distance_mm) + 1 for n in shape)
        factor += strength / VELLUM_ALBEDO * spline(rng.standard_normal((rows, columns)), (shape[0], shape[1]), 3)
    v, u = ((np.arange(n) + 0.5) / CELLS_PER_MM for n in shape)
    depth = leaf.depth(*np.meshgrid(u, v))
    factor -= 0.12 * np.exp(-np.maximum(depth, 0) / 9.0)
    return np.asarray(np.where(depth > 0, factor, 1.0))


def _artists(leaf: Leaf, rng: np.random.Generator) -> Iterator[Artist]:
    """Draw all that is on the page, from the back to the front."""
    width, height = leaf.size_mm
    left, top = ((extent - size) / 2 for extent, size in zip(leaf.page_size_mm, leaf.size_mm, strict=True))
    r = leaf.corner_mm
    inner = (left + r, -(top + height) + r), width - 2 * r, height - 2 * r
    # The strip that pastes the leaf into its sleeve shows as a darker line.
    for pad, grey in ((r + 0.5, _SEAM), (r, str(VELLUM_ALBEDO))):
        yield FancyBboxPatch(
            *inner, boxstyle=f"round,pad={pad},rounding_size={max(pad, 1e-3)}", facecolor=grey, linewidth=0
        )
    column = (width - 2 * _MARGIN_MM - _GUTTER_MM) / 2
    lefts = left + _MARGIN_MM, left + _MARGIN_MM + column + _GUTTER_MM
    first = top + (height - (_N_LINES - 1) * _PITCH_MM) / 2 + _X_HEIGHT_MM / 2
    baselines = first + _PITCH_MM * np.arange(_N_LINES)
    yield from _ruling(leaf, lefts, column, baselines)
    words = list(rng.choice(_LATIN.split(), 500))
    letter = str(rng.choice(list("ABDEHMNPQRSV")))
    side = (_INITIAL_LINES - 1) * _PITCH_MM + _X_HEIGHT_MM + 2.0
    for i, at in enumerate(lefts):
        for row, baseline in enumerate(baselines):
            indent = side + 3.0 if i == 0 and row < _INITIAL_LINES else 0.0
            grey = _RUBRIC if row == 0 or rng.random() < 0.06 else _INK
            yield from _line(words, at + indent, baseline, column - indent, grey)
    yield from initial(letter, lefts[0] - 2.0, baselines[0] - _X_HEIGHT_MM - 1.0, side, rng)


def _ruling(leaf: Leaf, lefts: Sequence[float], column: float, baselines: Floats) -> Iterator[Artist]:
    """Lines of a plummet under the writing and beside the columns, and the pricks that they were ruled by."""
    (width, height), (page_width, page_height) = leaf.size_mm, leaf.page_size_mm
    u, v = (page_width - width) / 2, (page_height - height) / 2
    for baseline in baselines:
        yield Rectangle((lefts[0] - 8.0, -baseline - 0.45), lefts[-1] + column - lefts[0] + 16.0, 0.2, facecolor=_RULE)
        for at in (u + 4.0, u + width - 4.0):
            yield Ellipse((at, -baseline - 0.35), 0.7, 0.7, facecolor=_PRICK, linewidth=0)
    for at in lefts:
        for upright in (at - 1.2, at + column + 1.2):
            yield Rectangle((upright, -(v + height - 3.0)), 0.2, height - 6.0, facecolor=_RULE, linewidth=0)


def _line(words: list[str], left: float, baseline: float, room: float, grey: str) -> Iterator[Artist]:
    """Write as many of the words as fit, flush to both sides, and take them off the list."""
    size = _X_HEIGHT_MM / _X_OVER_SIZE
    paths: list[tuple[Path, float]] = []
    total = 0.0
    while True:
        path = TextPath((0, 0), words[0], size=size, prop=_FONT).transformed(Affine2D().scale(_SQUEEZED, 1.0))
        extent = float(path.get_extents().x1)
        if paths and total + extent + len(paths) * 0.45 * size > room:
            break
        paths.append((path, extent))
        total += extent
        words.pop(0)
    gap = (room - total) / max(len(paths) - 1, 1)
    for path, extent in paths:
        yield PathPatch(path.transformed(Affine2D().translate(left, -baseline)), facecolor=grey, linewidth=0)
        left += extent + gap

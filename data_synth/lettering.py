"""Writing: upper-case pseudo-words set in DejaVu Sans, and how much of any footprint on the page they cover."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from matplotlib.font_manager import FontProperties
from matplotlib.patches import PathPatch
from matplotlib.textpath import TextPath, text_to_path
from matplotlib.transforms import Affine2D

from data_synth.drawing import drawn, integral_of, mean_over
from data_synth.sheets import PAGE_SIZE_MM
from deskew.errors import require
from deskew.types import Floats

ALPHABET = "ABCDEFGHKLMNOPRSTUWXYZ"
"""22 letters: A to Z without I, J, Q and V, which readers of single characters confuse."""

# Height of DejaVu Sans's capitals over its size.
_CAPITAL = 0.729
# Free line between two lines of capitals, and a word's distance from the next, as shares of a capital's height.
_GAP, _SPACE = 0.45, 0.9


def pseudo_words(rng: np.random.Generator, n_words: int = 22, n_letters: int = 8) -> tuple[str, ...]:
    """Draw words that no dictionary helps with; 22 words of 8 letters hold each letter of `ALPHABET` eight times.

    Parameters
    ----------
    rng : numpy Generator
        Of the order.
    n_words, n_letters : int
        Words, and letters of each. Pages of the paper's experiment are drawn by :func:`data_synth.page_words`.
    """
    require(n_words >= 1 and n_letters >= 1, "n_words", "be at least 1, as the letters", (n_words, n_letters))
    needed = n_words * n_letters
    letters = rng.permutation(np.resize(list(ALPHABET), needed))
    return tuple("".join(letters[i : i + n_letters]) for i in range(0, needed, n_letters))


@dataclass(frozen=True, slots=True)
class Lettering:
    """Lines of capitals on a page, kept as the integral of their coverage from the page's top left corner.

    The letters' outlines are drawn anti-aliased at 16 cells a millimetre and averaged down to 8; between the cells'
    corners the integral is bilinear, so the mean over any footprint is exact for what was drawn.

    Attributes
    ----------
    lines : tuple of str
        What is written, top to bottom.
    page_size_mm : (width, height)
        Page [mm].
    letters : tuple of (letter, u, v, width)
        Each letter with the left end of its baseline and its advance [mm].
    capital_mm : float
        Height of a capital [mm].
    integral : (h + 1, w + 1) array
        Covered area from the corner (0, 0) to each corner of a cell [cells].
    """

    lines: tuple[str, ...]
    page_size_mm: tuple[float, float]
    letters: tuple[tuple[str, float, float, float], ...]
    capital_mm: float
    integral: Floats

    def coverage(self, u: Floats, v: Floats, du: Floats, dv: Floats) -> Floats:
        """Share of footprints of sides `du` x `dv` [mm] centred on (u, v) [mm] that is covered: (N,), in [0, 1]."""
        return mean_over(self.integral, u, v, du, dv)


def set_words(
    words: Sequence[str],
    page_size_mm: tuple[float, float] = PAGE_SIZE_MM,
    *,
    capital_mm: float = 10.0,
    margin_mm: float = 16.0,
) -> Lettering:
    """Set words in lines, from the top left, with ragged lines spread evenly over the page's height.

    Parameters
    ----------
    words : sequence of str
        Words of letters that the font has.
    page_size_mm : (width, height)
        Page [mm].
    capital_mm : float
        Height of a capital [mm]; 10 mm are 21 camera pixels on the default rig.
    margin_mm : float
        Free border all round [mm].

    Raises
    ------
    InputError
        If the words do not fit on the page.
    """
    require(bool(words) and all(words), "words", "be at least one word", list(words))
    require(capital_mm > 0 and margin_mm >= 0, "capital_mm", "be positive, the margin not negative", capital_mm)
    room = page_size_mm[0] - 2 * margin_mm
    lines: list[list[str]] = [[]]
    at = 0.0
    for word in words:
        width = sum(_advance(letter, capital_mm) for letter in word)
        require(width <= room, "words", f"fit in {room:.0f} mm at {capital_mm:g} mm a capital", repr(word))
        if lines[-1] and at + width > room:
            lines.append([])
            at = 0.0
        lines[-1].append(word)
        at += width + _SPACE * capital_mm
    pitch = (page_size_mm[1] - 2 * margin_mm - capital_mm) / max(len(lines) - 1, 1)
    tight = len(lines) > 1 and pitch < (1 + _GAP) * capital_mm
    require(not tight, "words", f"fit on {page_size_mm} mm at {capital_mm:g} mm a capital", f"{len(lines)} lines")
    written = tuple(" ".join(line) for line in lines)
    letters = []
    for row, line in enumerate(written):
        at = margin_mm
        for letter in line:
            width = _SPACE * capital_mm if letter == " " else _advance(letter, capital_mm)
            if letter != " ":
                letters.append((letter, at, margin_mm + capital_mm + row * pitch, width))
            at += width
    integral = _integral(letters, capital_mm, page_size_mm)
    return Lettering(written, page_size_mm, tuple(letters), capital_mm, integral)


@cache
def glyph(letter: str, capital_mm: float) -> Lettering:
    """Return one letter alone, with a letter's height of white round it: the pattern that a reader compares with."""
    width = _advance(letter, capital_mm)
    size = (width + 2 * capital_mm, 3 * capital_mm)
    letters = ((letter, capital_mm, 2 * capital_mm, width),)
    return Lettering((letter,), size, letters, capital_mm, _integral(letters, capital_mm, size))


_FONT = FontProperties(family="DejaVu Sans")


def _advance(letter: str, capital_mm: float) -> float:
    """Width that a letter takes in a line [mm]."""
    size = capital_mm / _CAPITAL
    font = _FONT.copy()
    font.set_size(100.0)
    return float(text_to_path.get_text_width_height_descent(letter, font, ismath=False)[0]) * size / 100.0


def _integral(
    letters: Sequence[tuple[str, float, float, float]], capital_mm: float, page_size_mm: tuple[float, float]
) -> Floats:
    """Draw letters with their baselines' starts at (u, v) and integrate what they cover."""
    outlines = {c: TextPath((0, 0), c, size=capital_mm / _CAPITAL, prop=_FONT) for c, *_ in letters}
    moved = (outlines[letter].transformed(Affine2D().translate(u, -v)) for letter, u, v, _ in letters)
    return integral_of(drawn((PathPatch(path, facecolor="black", linewidth=0) for path in moved), page_size_mm))

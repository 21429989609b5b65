from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import data_synth as ds
from data_synth.lettering import ALPHABET, set_words
from deskew.errors import InputError

SIZE = (120.0, 60.0)
TEXT = set_words(("HELMET", "OXE"), SIZE, capital_mm=12.0, margin_mm=8.0)


def share(u: float, v: float, du: float, dv: float) -> float:
    return float(TEXT.coverage(*(np.array([x]) for x in (u, v, du, dv)))[0])


def test_the_papers_page_holds_every_letter_eight_times() -> None:
    words = ds.pseudo_words(np.random.default_rng(0))
    assert [len(word) for word in words] == [8] * 22
    assert Counter("".join(words)) == dict.fromkeys(ALPHABET, 8)
    assert words != ds.pseudo_words(np.random.default_rng(1))
    assert "".join(ds.Lettered(words).lines).replace(" ", "") == "".join(words)


@given(
    u=st.floats(5.0, 115.0), v=st.floats(5.0, 55.0), du=st.floats(0.2, 9.0), dv=st.floats(0.2, 9.0), n=st.integers(2, 5)
)
@settings(deadline=None, max_examples=60)
def test_a_footprint_covers_what_its_parts_cover(u: float, v: float, du: float, dv: float, n: int) -> None:
    parts = (np.arange(n) + 0.5) / n - 0.5
    mean = np.mean([share(u + a * du, v + b * dv, du / n, dv / n) for a in parts for b in parts])
    assert share(u, v, du, dv) == pytest.approx(mean, abs=1e-9)


def test_capitals_have_their_height_and_stand_on_their_line() -> None:
    _, u, v, width = TEXT.letters[0]
    rows = np.linspace(v - 14.0, v + 2.0, 641)
    inked = TEXT.coverage(np.full(641, u + width / 2), rows, np.full(641, width), np.full(641, 0.01)) > 0.05
    assert rows[inked].max() == pytest.approx(v, abs=0.1)
    assert np.ptp(rows[inked]) == pytest.approx(12.0, abs=0.15)
    # An H is two stems and a bar: its stems alone are inked at the top, its bar in the middle.
    assert share(u + width / 2, v - 11.0, 0.5, 0.5) == 0.0
    assert share(u + width / 2, v - 6.4, 0.5, 0.5) == pytest.approx(1.0, abs=0.01)


def test_a_glyph_is_the_letter_as_it_stands_in_a_line() -> None:
    letter, u, v, width = TEXT.letters[1]
    alone = ds.glyph(letter, 12.0)
    rng = np.random.default_rng(0)
    x, y = rng.uniform(u + 1, u + width - 1, 300), rng.uniform(v - 12, v, 300)
    side = np.full(300, 0.5)
    moved = alone.coverage(x - u + 12.0, y - v + 24.0, side, side)
    # Each is drawn on its own cells of 1/8 mm.
    assert np.abs(moved - TEXT.coverage(x, y, side, side)).mean() < 0.03


def test_too_many_words_are_refused() -> None:
    with pytest.raises(InputError, match="`words` must fit on"):
        set_words(("HELMET",) * 9, SIZE, capital_mm=12.0, margin_mm=8.0)
    with pytest.raises(InputError, match="`words` must fit in 104 mm"):
        set_words(("HELMETHELMETHELMET",), SIZE, capital_mm=12.0, margin_mm=8.0)

"""What every metric reads of a truth that is spoilt by a known amount, as `deskew.metrics.nulls` tabulates it."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from deskew.errors import InputError
from deskew.metrics import count_misses, image_figures, shifted, shuffled
from tests.metrics.printed_pages import printed_page


def test_image_figures_of_a_shifted_truth() -> None:
    page = printed_page()
    truth, moved = image_figures(page, page), image_figures(shifted(page, 0, 2), page)
    for name in ("ms_ssim_docunet", "ms_ssim_wang"):
        assert 0.3 < moved[name] < 0.95
        assert truth[name] == pytest.approx(1.0)
    assert moved["ld_dis_px"] == pytest.approx(1.0, abs=0.05)
    assert 0.0 <= moved["ad_dis"] < 0.02
    assert 0.0 <= moved["lid_dis_px"] < 0.1
    for name in ("text_lines", "line_straightness_px", "line_spread_deg"):
        assert moved[name] == pytest.approx(truth[name], abs=0.02)


@settings(max_examples=30, deadline=None)
@given(st.text(st.sampled_from("ABCDEFGHKLMNOPRSTU \n"), min_size=1, max_size=200), st.integers(0, 1000))
def test_shuffling_keeps_the_letters_and_the_words(text: str, seed: int) -> None:
    mixed = shuffled(text, np.random.default_rng(seed))
    assert Counter(mixed) == Counter(text)
    assert [len(word) for word in mixed.split()] == [len(word) for word in text.split()]


def test_a_shuffled_text_misses_most_of_its_letters() -> None:
    rng = np.random.default_rng(1)
    text = "".join(rng.choice(list("ABCDEFGHKLMNOPRSTUWXYZ"), 176))
    rates = [count_misses(shuffled(text, rng), text).character_error_rate for _ in range(10)]
    assert 0.7 < np.mean(rates) < 0.9


def test_a_shift_repeats_the_border() -> None:
    image = np.arange(12, dtype=np.uint8).reshape(3, 4)
    assert shifted(image, 1).tolist() == [[0, 0, 1, 2], [4, 4, 5, 6], [8, 8, 9, 10]]
    assert shifted(image, 0, -2).tolist() == [[8, 9, 10, 11]] * 3
    assert shifted(np.dstack([image] * 3), -1).shape == (3, 4, 3)
    with pytest.raises(InputError, match="`dx, dy` must move less than 4x3 px"):
        shifted(image, 4)

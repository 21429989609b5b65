"""Pages of Experiment II hold exactly the paper's 176 letters, whatever they say."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from data_synth import N_LETTERS, Lettered, Text, page_words
from data_synth.lettering import ALPHABET
from data_synth.texts import _SENTENCE_LETTERS, _SENTENCES


@given(seed=st.integers(0, 2**32 - 1), text=st.sampled_from(Text))
@settings(max_examples=60, deadline=None)
def test_a_page_has_exactly_176_letters(seed: int, text: Text) -> None:
    words = page_words(np.random.default_rng(seed), text)
    assert sum(len(word) for word in words) == N_LETTERS == 176
    assert all(word.isalpha() and word.isascii() for word in words)
    assert words == page_words(np.random.default_rng(seed), text)
    assert words != page_words(np.random.default_rng(seed + 1), text)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_capitals_are_eight_of_each_in_words_of_4_to_8(seed: int) -> None:
    words = page_words(np.random.default_rng(seed))
    assert Counter("".join(words)) == dict.fromkeys(ALPHABET, 8)
    assert {len(word) for word in words} <= {4, 5, 6, 7, 8}
    assert not any("OU" in word for word in words)


def test_the_full_alphabet_is_6_or_7_of_each() -> None:
    counts = [Counter("".join(page_words(np.random.default_rng(seed), Text.FULL))) for seed in range(2)]
    for count in counts:
        assert sorted(count.values()) == [6] * 6 + [7] * 20
    # Chance decides which letters come once more.
    assert counts[0] != counts[1]


def test_prose_is_made_of_whole_sentences_in_lower_case() -> None:
    assert {len(sentence.replace(" ", "")) for sentence in _SENTENCES} == {_SENTENCE_LETTERS}
    assert len(set(_SENTENCES)) == len(_SENTENCES) == 24
    text = " ".join(page_words(np.random.default_rng(5), Text.PROSE))
    assert text == text.lower()
    assert sum(sentence in text for sentence in _SENTENCES) == 8


@pytest.mark.parametrize("text", Text)
def test_a_page_can_be_set(text: Text) -> None:
    words = page_words(np.random.default_rng(0), text)
    assert "".join(Lettered(words).lines).replace(" ", "") == "".join(words)

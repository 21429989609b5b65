from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rapidfuzz.distance import Levenshtein

from deskew.errors import InputError
from deskew.metrics import count_misses, match_words
from deskew.metrics.misses import Misses

texts = st.text(st.sampled_from("ABCD"), max_size=24)


@settings(deadline=None)
@given(texts)
def test_a_text_read_as_it_is_has_no_misses(text: str) -> None:
    assert count_misses(text, text) == Misses(0, 0, 0, len(text))


@settings(deadline=None)
@given(texts.filter(bool), st.data())
def test_one_letter_read_as_another_is_one_substitution(text: str, data: st.DataObject) -> None:
    at = data.draw(st.integers(0, len(text) - 1))
    assert count_misses(f"{text[:at]}x{text[at + 1 :]}", text) == Misses(1, 0, 0, len(text))


@settings(deadline=None)
@given(texts, st.data())
def test_one_letter_too_many_is_one_insertion_and_one_too_few_one_deletion(text: str, data: st.DataObject) -> None:
    at = data.draw(st.integers(0, len(text)))
    longer = f"{text[:at]}x{text[at:]}"
    assert count_misses(longer, text) == Misses(0, 1, 0, len(text))
    assert count_misses(text, longer) == Misses(0, 0, 1, len(text) + 1)


@settings(deadline=None)
@given(texts, texts, st.lists(st.sampled_from([" ", "\n", "\t", ""]), min_size=24, max_size=24))
def test_white_space_does_not_matter(read: str, true: str, spaces: list[str]) -> None:
    def spread(text: str) -> str:
        return "".join(letter + space for letter, space in zip(text, spaces, strict=False))

    assert count_misses(spread(read), spread(true)) == count_misses(read, true)


@settings(deadline=None)
@given(texts, texts)
def test_exchanging_the_texts_exchanges_insertions_and_deletions(first: str, second: str) -> None:
    there, back = count_misses(first, second), count_misses(second, first)
    assert (there.substitutions, there.insertions, there.deletions) == (
        back.substitutions,
        back.deletions,
        back.insertions,
    )


@settings(deadline=None)
@given(texts, texts)
def test_the_counts_are_an_alignment_with_the_fewest_edits(read: str, true: str) -> None:
    found = count_misses(read, true)
    assert found.total == Levenshtein.distance(read, true)
    assert found.insertions - found.deletions == len(read) - len(true)
    tags = [edit.tag for edit in Levenshtein.editops(true, read)]
    assert found.substitutions >= tags.count("replace")
    assert min(found.substitutions, found.insertions, found.deletions) >= 0


def plain_edits(read: str, true: str) -> tuple[int, int]:
    """Fewest edits, and the fewest insertions and deletions of alignments with so few (Wagner and Fischer)."""
    row = [(j, j) for j in range(len(read) + 1)]
    for i, wanted in enumerate(true, 1):
        before, row = row, [(i, i)]
        for j, found in enumerate(read, 1):
            edits, unpaired = before[j - 1]
            (up, up_unpaired), (left, left_unpaired) = before[j], row[-1]
            row.append(
                min((edits + (wanted != found), unpaired), (up + 1, up_unpaired + 1), (left + 1, left_unpaired + 1))
            )
    return row[-1]


@settings(deadline=None)
@given(texts, texts)
def test_the_counts_are_those_of_a_plain_dynamic_program(read: str, true: str) -> None:
    """A substitution that costs nothing, or as much as two edits, gives other counts."""
    found = count_misses(read, true)
    assert (found.total, found.insertions + found.deletions) == plain_edits(read, true)


def test_the_character_error_rate_is_of_the_true_text() -> None:
    assert count_misses("HELLO WORLD!!", "HELLO WORLD").character_error_rate == pytest.approx(0.2)
    assert count_misses("HELLO", "HELLO WORLD").character_error_rate == pytest.approx(0.5)
    assert count_misses("XXXXX", "HELLO").character_error_rate == 1.0
    assert count_misses("hello", "HELLO").character_error_rate == 1.0
    assert count_misses("A NOISY PAGE", "A").character_error_rate == 9.0
    with pytest.raises(InputError, match="`true` must hold letters"):
        _ = count_misses("A", " ").character_error_rate


def test_the_papers_count_leaves_deletions_out() -> None:
    # H is lost, the second L is read as I, and there is a tilde before O.
    found = count_misses("E L I ~ O", "HELLO")
    assert found == Misses(1, 1, 1, 5)
    assert found.figures("_x") == {
        "misses_x": 3.0,
        "substitutions_x": 1.0,
        "insertions_x": 1.0,
        "deletions_x": 1.0,
        "misses_paper_x": 2.0,
    }


def test_of_equally_short_alignments_the_one_with_most_substitutions_counts() -> None:
    # Two substitutions, or one deletion and one insertion.
    assert count_misses("BA", "AB") == Misses(2, 0, 0, 2)


@settings(deadline=None)
@given(st.permutations(["net", "net", "total", "12.50"]))
def test_a_bag_of_words_has_no_order(words: list[str]) -> None:
    assert match_words(words, ["net", "total", "net", "12.50"]) == {"word_recall": 1.0, "word_precision": 1.0}


def test_a_word_is_found_as_often_as_it_is_there() -> None:
    figures = match_words(["net", "net", "net", "12.5O"], ["net", "net", "total", "12.50"])
    assert figures == {"word_recall": pytest.approx(0.5), "word_precision": pytest.approx(0.5)}
    assert match_words([], ["net"]) == {"word_recall": 0.0, "word_precision": 0.0}

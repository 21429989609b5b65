"""What a page of Experiment II says: exactly 176 letters, drawn anew for each page (section 4.2)."""

from __future__ import annotations

from enum import StrEnum

import numpy as np

from data_synth.lettering import ALPHABET

N_LETTERS = 176
"""Letters of the paper's document."""

_WORD_LETTERS = 4, 8
# Readers that know words take it for QU, on the flattest page; so it is left out as I, J, Q and V are.
_CONFUSED = "OU"
_ALL_LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"


class Text(StrEnum):
    """A kind of text.

    `CAPITALS`: pseudo-words of 4 to 8 capitals out of the 22 that readers of single letters tell apart, each 8 times,
    and no O before U. `FULL`: the same out of all 26 letters, each 6 or 7 times. `PROSE`: plain English in lower case.
    """

    CAPITALS = "capitals"
    FULL = "full"
    PROSE = "prose"


def page_words(rng: np.random.Generator, text: Text = Text.CAPITALS) -> tuple[str, ...]:
    """Draw the words of a page.

    Parameters
    ----------
    rng : numpy Generator
        The only source of randomness.
    text : Text
        The kind of text.

    Returns
    -------
    tuple of str
        Words of `N_LETTERS` letters altogether; no punctuation.
    """
    if text is Text.PROSE:
        lines = rng.permutation(len(_SENTENCES))[: N_LETTERS // _SENTENCE_LETTERS]
        return tuple(word for line in lines for word in _SENTENCES[line].split())
    alphabet = ALPHABET if text is Text.CAPITALS else _ALL_LETTERS
    # Where the alphabet does not go into the page evenly, chance decides which letters come once more.
    letters = np.resize(rng.permutation(list(alphabet)), N_LETTERS)
    ends = np.cumsum(_word_lengths(rng))
    while True:
        words = tuple("".join(word) for word in np.split(rng.permutation(letters), ends[:-1]))
        if text is Text.FULL or not any(_CONFUSED in word for word in words):
            return words


def _word_lengths(rng: np.random.Generator) -> list[int]:
    """Draw lengths of words that add up to the page."""
    fewest, most = _WORD_LETTERS
    lengths: list[int] = []
    left = N_LETTERS
    while left > 0:
        # What is left over must be no word, or at least the shortest one.
        fitting = [n for n in range(fewest, most + 1) if left - n == 0 or left - n >= fewest]
        lengths.append(int(rng.choice(fitting)))
        left -= lengths[-1]
    return lengths


_SENTENCE_LETTERS = 22
# Eight of these make a page.
_SENTENCES = (
    "a clerk folded every sheet",
    "an old book lay on the shelf",
    "no one opened the box again",
    "the map shows a narrow road",
    "his hand wrote a small note",
    "the paper dried by the fire",
    "they kept the rolls in jars",
    "a lens made the words clear",
    "each leaf has its own story",
    "the print is sharp and dark",
    "the monks ruled every leaf",
    "fold the map along its edge",
    "the text runs over the fold",
    "water marks tell the maker",
    "a mouse ate the first verse",
    "the seal broke in two parts",
    "nobody had read it in years",
    "the shelf stood in a cellar",
    "each corner lifts a little",
    "salt and damp had done harm",
    "an ink blot covers the name",
    "rough paper drinks the ink",
    "a knife cut along the spine",
    "the dean lent us the volume",
)

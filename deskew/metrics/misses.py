"""Misses of a reading against the true text, letter by letter (section 4.2), and word by word where order is unknown.

The paper counts letters that are misclassified and "noise" letters that are inserted. A letter that is not read at all
it does not mention: counting deletions as misses too is our reading, and the paper's own count stands beside it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from rapidfuzz.distance import Levenshtein

from deskew.errors import require


@dataclass(frozen=True, slots=True)
class Misses:
    """How a reading differs from the true text.

    Attributes
    ----------
    substitutions, insertions, deletions : int
        Letters read as another, read where there is none, and not read.
    letters : int
        Letters of the true text.
    """

    substitutions: int
    insertions: int
    deletions: int
    letters: int

    @property
    def total(self) -> int:
        """All three together: the Levenshtein distance, which the field calls edit distance (ED)."""
        return self.substitutions + self.insertions + self.deletions

    @property
    def character_error_rate(self) -> float:
        """The field's CER: the edit distance over the letters of the true text; above 1 if much is inserted.

        Of the true text and not of a reading of its scan, which would forgive whatever the machine misreads on both.
        """
        require(self.letters > 0, "true", "hold letters for a character error rate", "none")
        return self.total / self.letters

    @property
    def paper(self) -> int:
        """As the paper counts, without deletions."""
        return self.substitutions + self.insertions

    def figures(self, suffix: str = "") -> dict[str, float]:
        """Return `misses`, `substitutions`, `insertions`, `deletions`, `misses_paper`, each with `suffix` after it."""
        named = {
            "misses": self.total,
            "substitutions": self.substitutions,
            "insertions": self.insertions,
            "deletions": self.deletions,
            "misses_paper": self.paper,
        }
        return {f"{name}{suffix}": float(count) for name, count in named.items()}


def letters_of(text: str) -> str:
    """Return a text without its white space, which no reader is held to."""
    return "".join(text.split())


def count_misses(read: str, true: str) -> Misses:
    """Align a reading with the true text by the fewest edits and count them by kind.

    Of several alignments with equally few edits the one with most substitutions counts: a letter misread is then not
    taken for one lost and another found, and the three counts are unique.

    Parameters
    ----------
    read, true : str
        White space is left out of both; case and punctuation count.

    Returns
    -------
    Misses
        Of the letters of `true`.
    """
    found, wanted = letters_of(read), letters_of(true)
    # An insertion or deletion costs a little more than a substitution: so little that all of them together do not make
    # up for one edit. Total and split then follow from one distance.
    edit = len(found) + len(wanted) + 1
    cost = Levenshtein.distance(wanted, found, weights=(edit + 1, edit + 1, edit))
    total, unpaired = divmod(cost, edit)
    insertions = (unpaired + len(found) - len(wanted)) // 2
    return Misses(total - unpaired, insertions, unpaired - insertions, len(wanted))


def match_words(read: Sequence[str], true: Sequence[str]) -> dict[str, float]:
    """Compare two bags of words: what a page says, whatever order a reader takes its columns in.

    Parameters
    ----------
    read, true : sequences of str
        Words, as often as they occur; equal means equal in every letter.

    Returns
    -------
    dict
        `word_recall`, the share of the true words that were read, and `word_precision`, the share of the words read
        that are true; in [0, 1], 0 where there are none.
    """
    common = sum((Counter(read) & Counter(true)).values())
    return {"word_recall": common / max(len(true), 1), "word_precision": common / max(len(read), 1)}

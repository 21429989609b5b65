"""What a page of tables is made of, before it becomes Markdown or a part of the report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from experiments.reporting.markdown import markdown_table


@dataclass(frozen=True, slots=True)
class Heading:
    """A heading; `level` 1 is the page's own."""

    text: str
    level: int = 2

    @property
    def markdown(self) -> str:
        """The heading as a line of Markdown."""
        return f"{'#' * self.level} {self.text}"


@dataclass(frozen=True, slots=True)
class Note:
    """Sentences, in Markdown that has nothing but `code` and **bold** in it."""

    text: str

    @property
    def markdown(self) -> str:
        """The sentences as they are."""
        return self.text


@dataclass(frozen=True, slots=True)
class Table:
    """Cells as text, and which metrics of `results.csv` or `timings.csv` they show.

    Attributes
    ----------
    headings : sequence of str
        One a column.
    lines : sequence of sequences of str
        As long as `headings`.
    of_columns : sequence of str
        The metric of each column, "" for one that shows none; empty where the lines have the metrics.
    of_lines : sequence of str
        The metric of each line; empty where the columns have them.
    """

    headings: Sequence[str]
    lines: Sequence[Sequence[str]]
    of_columns: Sequence[str] = ()
    of_lines: Sequence[str] = ()

    @property
    def markdown(self) -> str:
        """The table in Markdown."""
        return markdown_table(self.headings, self.lines)


Block = Heading | Note | Table


def markdown_page(blocks: Sequence[Block]) -> str:
    """Return a page of Markdown, its parts one empty line apart."""
    return "\n\n".join(block.markdown for block in blocks) + "\n"

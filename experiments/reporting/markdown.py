"""Tables in Markdown, and numbers as their cells show them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from experiments.reporting.statistics import Interval, share_interval

NONE = "–"


def markdown_table(headings: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table; the first column is text, the others are set flush right."""
    rule = ["---"] + ["---:"] * (len(headings) - 1)
    return "\n".join("| " + " | ".join(cells) + " |" for cells in (headings, rule, *lines))


def with_interval(value: float | None, ends: Interval | None, digits: int) -> str:
    """Return `0.12 (0.10..0.15)`, without an interval the number alone, without a number a dash."""
    if value is None:
        return NONE
    interval = "" if ends is None else f" ({ends[0]:.{digits}f}..{ends[1]:.{digits}f})"
    return f"{value:.{digits}f}{interval}"


def share(n_ones: int, n: int) -> str:
    """Return `46 of 50 (81..97 %)` with Wilson's interval; of none at all a dash."""
    if n == 0:
        return NONE
    low, high = share_interval(n_ones, n)
    return f"{n_ones} of {n} ({100 * low:.0f}..{100 * high:.0f} %)"

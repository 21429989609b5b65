"""Rows by page: which values stand side by side, and which pages failed."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from experiments.trials.record import FAILED
from experiments.trials.schema import Row

Place = tuple[str, str]
"""Condition and method."""

Page = tuple[int, int]
"""Trial and seed."""

_NO_METHOD = "-"
_NUMBER = re.compile(r"(\d+(?:\.\d+)?)")


@dataclass(frozen=True, slots=True)
class PlacePages:
    """What the pages gave under one condition by one method.

    Attributes
    ----------
    values : mapping of metric to values by page
        Of pages that gave some.
    failed : frozenset of Page
        Pages that failed here, or whose trial failed as a whole.
    """

    values: Mapping[str, Mapping[Page, float]]
    failed: frozenset[Page]

    def of(self, metric: str) -> list[float]:
        """Return a metric's values in the order of the pages."""
        return [value for _, value in sorted(self.values.get(metric, {}).items())]


def pages_by_place(rows: Sequence[Row]) -> dict[Place, PlacePages]:
    """Return the pages of each condition and method, sorted by name and, within a name, by number: 2 before 10.

    A trial that fails as a whole is recorded once, under the condition that it was planned for and the method "-". It
    is missing from all that the trial would have measured, and so counts as failed wherever the condition's name
    contains the planned one's and the page has no value.
    """
    values: dict[Place, dict[str, dict[Page, float]]] = defaultdict(lambda: defaultdict(dict))
    failed: dict[Place, set[Page]] = defaultdict(set)
    for row in rows:
        place, page = (row.condition, row.method), (row.trial, row.seed)
        if row.metric == FAILED:
            failed[place].add(page)
        else:
            values[place][row.metric][page] = row.value
    whole = [(_parts(condition), pages) for (condition, method), pages in failed.items() if method == _NO_METHOD]
    found = {}
    for place in sorted({*values, *failed}, key=_in_order):
        there = {page for pages in values[place].values() for page in pages}
        lost = {page for parts, pages in whole if parts <= _parts(place[0]) for page in pages} - there
        found[place] = PlacePages(dict(values[place]), frozenset(failed[place] | lost))
    return found


def _in_order(place: Place) -> tuple[list[str | float], str]:
    """Return a key to sort by: of the condition's pieces every second one is a number."""
    pieces = _NUMBER.split(place[0])
    return [float(piece) if i % 2 else piece for i, piece in enumerate(pieces)], place[1]


def _parts(condition: str) -> frozenset[str]:
    """Split a condition at "/"; that of a trial which covers all conditions has no parts."""
    return frozenset(condition.split("/")) - {_NO_METHOD}

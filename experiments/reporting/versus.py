"""Rows to paired comparisons: two methods, or two conditions, on the same pages."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from experiments.reporting.blocks import Table
from experiments.reporting.layout import Changes, Column, Versus, named_by
from experiments.reporting.markdown import NONE, share, with_interval
from experiments.reporting.pages import Place, PlacePages
from experiments.reporting.statistics import Comparison, compare

HOW_TO_READ = (
    "Paired by page: the mean of the pages' differences and the ratio of the two means, each with its 95 % bootstrap "
    "interval, and the pages on which the figure is smaller, with Wilson's. Less is better, so a negative difference "
    "and a ratio below 1 are an improvement. `failed (against)` counts the pages that gave no figure, and those for "
    "which what it is compared with gave none: they are no pairs, and must be held against whoever lost them."
)


@dataclass(frozen=True, slots=True)
class Paired:
    """One metric at two places, on the pages that have it at both.

    Attributes
    ----------
    found : Comparison or None
        None if no page has both.
    n_failed, n_failed_against : int
        Pages that failed at the one place, and at the other; a page that failed at both counts in both.
    """

    found: Comparison | None
    n_failed: int
    n_failed_against: int

    def counts(self) -> list[str]:
        """Return the cells that say how many pages are compared and how many are missing."""
        n = 0 if self.found is None else self.found.n
        return [str(n), f"{self.n_failed} ({self.n_failed_against})"]

    def difference(self, digits: int) -> str:
        """Return the cell of the mean difference."""
        if self.found is None:
            return NONE
        small = 0 < abs(self.found.difference) < 0.5 * 10.0**-digits
        return with_interval(self.found.difference, self.found.interval, digits + 2 if small else digits)

    def verdict(self) -> list[str]:
        """Return the cells of the ratio of means and of the pages that are better."""
        found = self.found
        if found is None:
            return [NONE, NONE]
        return [with_interval(found.ratio, found.ratio_interval, 2), share(found.n_better, found.n)]


def paired(one: PlacePages, other: PlacePages, metric: str) -> Paired:
    """Compare a metric at two places, page by page."""
    ones, others = one.values.get(metric, {}), other.values.get(metric, {})
    both = sorted(ones.keys() & others.keys())
    found = compare([ones[page] for page in both], [others[page] for page in both]) if both else None
    return Paired(found, len(one.failed), len(other.failed))


def method_against_method(
    versus: Versus, columns: Sequence[Column], places: Mapping[Place, PlacePages]
) -> Table | None:
    """Return a table with a line a condition, method and metric; None if no two methods can be compared."""
    asked = [column for column in columns if column.metric in versus.metrics]
    lines, metrics = [], list[str]()
    for wanted in versus.conditions:
        for (condition, method), one in places.items():
            other = places.get((condition, versus.baseline))
            if other is None or method in ("-", versus.baseline) or not named_by(wanted, condition):
                continue
            # Where both lost every page, a line still says so.
            measured = [column for column in asked if column.metric in {**one.values, **other.values}] or asked[:1]
            for column in measured:
                pair = paired(one, other, column.metric)
                equal = str(pair.found.n_equal) if pair.found is not None else NONE
                cells = [*pair.counts(), pair.difference(column.digits), *pair.verdict(), equal]
                lines.append([condition, method, column.heading, *cells])
                metrics.append(column.metric)
    headings = ["condition", "method", "figure", "pages", "failed (against)", "difference", "ratio of means"]
    return Table([*headings, "better on", "equal on"], lines, of_lines=metrics) if lines else None


def condition_against_condition(
    changes: Changes, columns: Sequence[Column], places: Mapping[Place, PlacePages]
) -> Table | None:
    """Return a table with a line a pair and method, a column a metric; None if there is nothing to compare."""
    shown = [next(column for column in columns if column.metric == metric) for metric in changes.metrics]
    lines = []
    for (condition, method), against in changed_places(changes.pairs, places):
        one, other = places[condition, method], places[against, method]
        pairs = [paired(one, other, column.metric) for column in shown]
        differences = [pair.difference(column.digits) for pair, column in zip(pairs, shown, strict=True)]
        lines.append([condition, against, method, *pairs[0].counts(), *differences, *pairs[0].verdict()])
    if not lines:
        return None
    headings = ["condition", "against", "method", "pages", "failed (against)", *(column.heading for column in shown)]
    headings += [f"{shown[0].heading}: ratio of means", "better on"]
    metrics = ["", "", "", "", "", *(column.metric for column in shown), "", ""]
    if all(line[2] == "-" for line in lines):
        headings, metrics, *lines = ([*line[:2], *line[3:]] for line in (headings, metrics, *lines))
    return Table(headings, lines, of_columns=metrics)


def changed_places(pairs: Sequence[tuple[str, str]], places: Mapping[Place, PlacePages]) -> Iterator[tuple[Place, str]]:
    """Yield each place that is compared with the same method's under another condition, and that condition."""
    for wanted, against in pairs:
        for condition, method in places:
            same = against + condition.removeprefix(wanted) if against.endswith(("/", "=")) else against
            if named_by(wanted, condition) and condition != same and (same, method) in places:
                yield (condition, method), same

"""Rows to quantiles: what is true of most pages, and of nearly all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from experiments.reporting.blocks import Table
from experiments.reporting.layout import Column, Tails, named_by
from experiments.reporting.markdown import NONE, share
from experiments.reporting.pages import Place, PlacePages
from experiments.reporting.statistics import quantile_interval

_QUANTILES = (("half of the pages below", 0.5), ("9 in 10 below", 0.9), ("19 in 20 below", 0.95))


def tails_table(tails: Tails, columns: Sequence[Column], places: Mapping[Place, PlacePages]) -> Table | None:
    """Return a line a condition, method and metric with its quantiles; None without data.

    Parameters
    ----------
    tails : Tails
        What is shown.
    columns : sequence of Column
        How the metrics are called and rounded.
    places : mapping of (condition, method) to PlacePages
        All results.
    """
    by_metric = {column.metric: column for column in columns}
    lines, metrics = [], list[str]()
    for wanted in tails.conditions:
        for (condition, method), pages in places.items():
            ones = pages.of(tails.share)
            if not named_by(wanted, condition) or not (ones or pages.failed):
                continue
            # Where every page failed there is no share: the summary counts them.
            kept = share(int(sum(ones)), len(ones) + len(pages.failed)) if ones else NONE
            for column in (by_metric[metric] for metric in tails.metrics):
                cells = _quantiles(pages.of(column.metric), column.digits)
                lines.append([condition, method, column.heading, kept, *cells])
                metrics.append(column.metric)
    headings = ["condition", "method", "figure", by_metric[tails.share].heading, *(text for text, _ in _QUANTILES)]
    return Table([*headings, "largest"], lines, of_lines=metrics) if lines else None


def _quantiles(values: Sequence[float], digits: int) -> list[str]:
    if not values:
        return [NONE] * (len(_QUANTILES) + 1)
    cells = [_quantile(values, level, digits) for _, level in _QUANTILES]
    return [*cells, f"{max(values):.{digits}f}"]


def _quantile(values: Sequence[float], level: float, digits: int) -> str:
    """Return a quantile with its interval, open where too few pages bound it; a tail of less than a page is a dash."""
    if round(len(values) * (1 - level), 9) < 1:
        return NONE
    low, high = (None if end is None else f"{end:.{digits}f}" for end in quantile_interval(values, level))
    value = f"{np.quantile(values, level):.{digits}f}"
    if low is None:
        return value if high is None else f"{value} (< {high})"
    return f"{value} (> {low})" if high is None else f"{value} ({low}..{high})"

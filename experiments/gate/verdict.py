"""The judgement: every figure of a rerun against the baseline's, page by page.

With d the mean over the pages of how much worse they have become, and s the standard deviation that redrawn noise alone
gives such a mean (:mod:`.floors`), a figure is worse if

    d > max(3 s, slack)   and   p(d / s) < 0.01 after Holm's correction for all figures judged.

It is better if the same holds of -d. A t-test over the pages would ask another question, whether pages never seen would
be worse too; of few pages it misses a page that is ruined: one of four off by any length gives t = 1.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from deskew.errors import InputError, require
from deskew.types import Floats
from experiments.gate.baseline import place_of
from experiments.gate.directions import Direction, direction_of, is_identity
from experiments.gate.floors import Figure, Noise
from experiments.trials import Row
from experiments.trials.record import FAILED

ALPHA = 0.01
"""Probability that noise alone calls any figure of a rerun worse, were it normal."""

Page = tuple[int, int]
Failed = tuple[str, str, str, int, int]
"""What failed: experiment, condition, method, trial, seed."""

Reasons = Mapping[Failed, str]
"""Why it did."""

_SAME = 1e-6  # relative, of figures that tell one page from another


class Call(StrEnum):
    """What is said of a figure."""

    HOLDS = "holds"
    WORSE = "worse"
    BETTER = "better"
    MISSING = "missing"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class Verdict:
    """One figure's judgement.

    Attributes
    ----------
    figure : Figure
        As the baseline names it.
    call : Call
        Worse, missing and failed are regressions. The metric of what failed is `failed`; its figures are missing.
    pages : int
        Pages compared; of a missing or failed figure those that are so.
    before, now : float
        Means over the pages compared, in the metric's unit.
    worsening, floor : float
        Mean over the pages of how much worse they have become, and what it must exceed to be called.
    p_value : float
        That noise alone does as much, after Holm's correction.
    reason : str
        Why it failed.
    """

    figure: Figure
    call: Call
    pages: int
    before: float = 0.0
    now: float = 0.0
    worsening: float = 0.0
    floor: float = 0.0
    p_value: float = 1.0
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Judgement:
    """What is said of a rerun.

    Attributes
    ----------
    verdicts : tuple of Verdict
        Of every figure that is judged.
    new : tuple of Figure
        Figures of the rerun that the baseline does not have.
    unjudged : int
        Figures without a direction.
    """

    verdicts: tuple[Verdict, ...]
    new: tuple[Figure, ...]
    unjudged: int

    def of(self, *calls: Call) -> list[Verdict]:
        """Return the verdicts of some kinds, in the order of the kinds."""
        return [verdict for call in calls for verdict in self.verdicts if verdict.call == call]

    @property
    def regressions(self) -> list[Verdict]:
        """What fails the gate."""
        return self.of(Call.FAILED, Call.MISSING, Call.WORSE)


def judge(
    baseline: Iterable[Row],
    present: Iterable[Row],
    floors: Mapping[Figure, Noise],
    reasons: Reasons | None = None,
) -> Judgement:
    """Compare a rerun with a baseline.

    Parameters
    ----------
    baseline, present : iterables of Row
        The rerun's rows name methods as the baseline does.
    floors : mapping of Figure to Noise
        Of every figure of the baseline that has a direction.
    reasons : mapping, optional
        Why what failed did.

    Raises
    ------
    InputError
        If they are not of the same pages, the baseline itself holds failures, or a floor is missing.
    """
    before, now = _by_figure(baseline), _by_figure(present)
    failed = {figure: now.pop(figure) for figure in list(now) if figure.metric == FAILED}
    for figure in before:
        require(figure.metric != FAILED, "the baseline", "hold no failed trial", _named(figure))
    _require_same_pages(before, now)
    losses = [_failed(figure, pages, reasons or {}) for figure, pages in sorted(failed.items())]
    compared, unjudged = [], 0
    for figure, pages in sorted(before.items()):
        direction = direction_of(figure.condition, figure.metric)
        if direction is None:
            unjudged += 1
            continue
        there = now.get(figure, {})
        lost = set(pages) - set(there)
        if lost:
            losses.append(Verdict(figure, Call.MISSING, len(lost)))
        else:
            require(figure in floors, f"the floor of {_named(figure)}", "be derived before it can be judged", "none")
            compared.append(_compared(figure, direction, pages, there, floors[figure]))
    return Judgement((*losses, *_called(compared)), tuple(sorted(set(now) - set(before))), unjudged)


def _by_figure(rows: Iterable[Row]) -> dict[Figure, dict[Page, float]]:
    found: dict[Figure, dict[Page, float]] = defaultdict(dict)
    for row in rows:
        experiment, condition, method, trial, seed, metric = place_of(row)
        found[Figure(experiment, condition, method, metric)][trial, seed] = row.value
    return dict(found)


def _named(figure: Figure) -> str:
    return " ".join(figure)


def _require_same_pages(
    before: Mapping[Figure, Mapping[Page, float]], now: Mapping[Figure, Mapping[Page, float]]
) -> None:
    for figure, pages in before.items():
        if is_identity(figure.metric):
            for page in set(pages) & set(now.get(figure, {})):
                one, other = pages[page], now[figure][page]
                if not abs(one - other) <= _SAME * max(1.0, abs(one)):
                    raise InputError(
                        f"`{_named(figure)}` must be the same as in the baseline, {one:g} in trial {page[0]}, got "
                        f"{other:g}: these are other pages."
                    )


def _failed(figure: Figure, pages: Mapping[Page, float], reasons: Reasons) -> Verdict:
    experiment, condition, method, _ = figure
    known = (reasons.get((experiment, condition, method, *page)) for page in sorted(pages))
    return Verdict(figure, Call.FAILED, len(pages), reason=next(filter(None, known), ""))


def _compared(
    figure: Figure, direction: Direction, before: Mapping[Page, float], now: Mapping[Page, float], noise: Noise
) -> Verdict:
    """Compare the pages of one figure; what is called waits until all have been compared."""
    pages = sorted(before)
    olds, news = (np.array([side[page] for page in pages]) for side in (before, now))
    worsening = float(np.mean([direction.badness(n) - direction.badness(o) for n, o in zip(news, olds, strict=True)]))
    return Verdict(
        figure,
        Call.HOLDS,
        len(pages),
        float(olds.mean()),
        float(news.mean()),
        worsening,
        noise.floor(len(pages), direction.slack(len(pages))),
        # Of the change, whichever way it went: a figure is called worse or better, never both.
        noise.p_value(abs(worsening), len(pages)),
    )


def _called(compared: Sequence[Verdict]) -> list[Verdict]:
    """Correct the p values for the number of figures, and call."""
    found = []
    corrected = holm(np.array([verdict.p_value for verdict in compared]))
    for verdict, p_value in zip(compared, corrected, strict=True):
        beyond = abs(verdict.worsening) > verdict.floor and p_value < ALPHA
        changed = Call.WORSE if verdict.worsening > 0 else Call.BETTER
        found.append(replace(verdict, call=changed if beyond else Call.HOLDS, p_value=float(p_value)))
    return found


def holm(p_values: Floats) -> Floats:
    """Return p values corrected for their number, so that the probability of any false call is kept.

    References
    ----------
    S. Holm, "A simple sequentially rejective multiple test procedure", Scandinavian Journal of Statistics 6, 1979.
    """
    n = len(p_values)
    order = np.argsort(p_values, kind="stable")
    corrected = np.empty(n)
    corrected[order] = np.maximum.accumulate(np.minimum(1.0, p_values[order] * (n - np.arange(n))))
    return corrected

"""What a claim is: the paper's words, what is measured, which rule judges it, and what the figures mean."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from experiments.reporting.claims.measures import Mean, Measure, Share, Values
from experiments.reporting.claims.rules import Rule

EULER, BEST = "paper_euler", "spring"
"""The paper's method and this project's best one."""


@dataclass(frozen=True, slots=True)
class Line:
    """One thing that a claim says.

    Attributes
    ----------
    what : str
        What is measured.
    paper : str
        The paper's figure; "no figure" where it has words alone.
    measure, rule : Measure, Rule
        Ours, and when it counts as reproduced.
    best : Measure or None
        The same by this project's best method instead of the paper's.
    """

    what: str
    paper: str
    measure: Measure
    rule: Rule
    best: Measure | None = None


@dataclass(frozen=True, slots=True)
class Claim:
    """One claim of the paper.

    Attributes
    ----------
    title, section, quote : str
        What it is about, where it stands, and the paper's words.
    test : str
        How it is tested, for somebody who never saw the code.
    lines : tuple of Line
        Its parts.
    why : str
        What the figures mean; `{name}` stands for a detail.
    details : mapping of name to Measure
        Further figures, which decide nothing.
    """

    title: str
    section: str
    quote: str
    test: str
    lines: tuple[Line, ...]
    why: str
    details: Mapping[str, Measure] = field(default_factory=dict)


def mean(
    report: str, condition: str, metric: str, method: str = "-", unit: str = "", digits: int = 3, scale: float = 1.0
) -> Mean:
    """Return the mean of one metric of one condition and method."""
    return Mean((Values(report, condition, metric, method),), unit, digits, scale)


def share(report: str, condition: str, metric: str, method: str = "-", at_most: float | None = None) -> Share:
    """Return the share of the trials in which one metric is 1, or at most so much."""
    return Share(Values(report, condition, metric, method), at_most)

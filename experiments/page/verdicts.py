"""The head of the report: what came out in a few figures, and every claim of the paper with its verdict."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from experiments.page.markup import element, inline, slug, table_html
from experiments.reporting.blocks import Table
from experiments.reporting.claims import acquisition, results
from experiments.reporting.claims.claim import Claim
from experiments.reporting.claims.measures import Evidence
from experiments.reporting.claims.page import Judged, capital, details_of, judge, reports_of
from experiments.reporting.claims.paper import CLAIMS, UNTESTED
from experiments.reporting.claims.rules import Verdict

_CLASS = {
    Verdict.EXCEEDED: "exceeded",
    Verdict.REPRODUCED: "reproduced",
    Verdict.NOT_REPRODUCED: "missed",
    Verdict.UNDECIDED: "open",
    Verdict.NOT_TESTED: "open",
}
# What the paper's abstract and conclusions promise, by its own figures: claim and lines.
_IN_SHORT = (
    (results.DISTANCE, "mirror folds: mean of the pages' means"),
    (results.DISTANCE, "crumples: mean of the pages' means"),
    (results.READING, "restored, mean misses"),
    (results.READING, "unrestored, error rate"),
    (acquisition.ACCURACY, "printed plane"),
    (results.MINUTE, "flattening alone, explicit Euler to rest"),
)


@dataclass(frozen=True, slots=True)
class JudgedClaim:
    """A claim with its number in the paper's order, its judged lines and what they mean."""

    number: int
    claim: Claim
    lines: Sequence[Judged]
    why: str
    reports: Sequence[str]

    @property
    def anchor(self) -> str:
        """Name for a link."""
        return f"claim-{self.number}-{slug(self.claim.title)}"


def judged_claims(evidence: Evidence) -> list[JudgedClaim]:
    """Judge every claim by the reports; one whose report is missing is not tested."""
    return [
        JudgedClaim(
            number,
            claim,
            [judge(line, evidence) for line in claim.lines],
            claim.why.format_map(details_of(claim, evidence)),
            reports_of(claim, evidence),
        )
        for number, claim in enumerate(CLAIMS, 1)
    ]


def summary_html(claims: Sequence[JudgedClaim]) -> str:
    """Return the tally of all verdicts and the paper's main figures beside ours."""
    return _tally([line for claim in claims for line in claim.lines]) + _in_short(claims)


def claims_html(claims: Sequence[JudgedClaim]) -> str:
    """Return every claim, folded up behind its verdicts, and what was not tested."""
    untested = "".join(element("li", inline(text)) for text in UNTESTED)
    not_tested = f"<h3>Not tested</h3><p>The paper also says</p><ul>{untested}</ul>"
    return "".join(_claim(claim) for claim in claims) + not_tested


def _tally(lines: Sequence[Judged]) -> str:
    """Return the verdicts as a bar and in words."""
    counts = Counter(line.verdict for line in lines)
    found = [(verdict, counts[verdict]) for verdict in Verdict if counts[verdict]]
    bars, start = "", 0
    for verdict, count in found:
        bars += f'<rect class="{_CLASS[verdict]}" x="{start}" width="{count - 0.15:g}" height="1"/>'
        start += count
    said = ", ".join(f"{count} {verdict}" for verdict, count in found)
    bar = f'<svg class="tally" viewBox="0 0 {start} 1" preserveAspectRatio="none" role="img" aria-label="{said}">'
    key = "".join(
        f"<li><strong>{count}</strong> {element('span', str(verdict), class_=f'verdict {_CLASS[verdict]}')}"
        for verdict, count in found
    )
    text = f"Of the {len(lines)} figures that the paper's {len(CLAIMS)} claims come to:"
    return f'<h3>Verdicts</h3><p>{text}</p>{bar}{bars}</svg><ul class="tally-key">{key}</ul>'


def _in_short(claims: Sequence[JudgedClaim]) -> str:
    """Return the paper's main figures, each with ours by its own method and by the best one."""
    by_title = {claim.claim.title: claim for claim in claims}
    cards = ""
    for claim, what in _IN_SHORT:
        judged = by_title[claim.title]
        line = next(line for line in judged.lines if line.line.what == what)
        figure = "–" if line.figure is None else line.figure.counted
        main, _, more = figure.partition(" (")
        rest = [("the paper", line.line.paper), ("verdict", _verdict(line.verdict, line.verdict_text))]
        if more:
            rest.insert(1, ("95 %", escape(more.replace(")", "", 1))))
        if line.best is not None:
            rest.append(("best method", escape(line.best.text)))
        unit = "" if line.figure is None or not line.figure.unit else f" {line.figure.unit}"
        main = main if main.endswith(unit) else main + unit
        cells = "".join(f"<span>{name}</span><span>{value}</span>" for name, value in rest)
        title = f'{escape(capital(what))} <a class="small" href="#{judged.anchor}">claim {judged.number}</a>'
        cards += f'<div><dt>{title}<dd class="main">{escape(main)}<dd class="more">{cells}</div>'
    said = "By the paper’s own method, with its 95 % interval."
    return f'<h3>In short</h3><p class="small soft">{said}</p><dl class="figures">{cards}</dl>'


def _verdict(verdict: Verdict, text: str) -> str:
    return element("span", escape(text), class_=f"verdict {_CLASS[verdict]}")


def _claim(judged: JudgedClaim) -> str:
    claim = judged.claim
    counts = Counter(line.verdict for line in judged.lines)
    verdicts = "".join(_verdict(v, f"{counts[v]} {v}") for v in Verdict if counts[v])
    title = element("span", f"{judged.number}. {inline(claim.title)}", class_="title")
    summary = f'<summary>{title}<span class="verdicts">{verdicts}</span></summary>'
    sources = ", ".join(f'<a href="#{slug(name)}">{escape(name)}</a>' for name in judged.reports)
    body = (
        f"<blockquote>{inline(claim.quote)} (section {escape(claim.section)})</blockquote>"
        f"<p><strong>Test.</strong> {inline(claim.test)}</p>{_lines(judged)}"
        f"<p><strong>Why.</strong> {inline(judged.why)}</p>"
    )
    body += f"<p>From {sources}.</p>" if sources else ""
    return f'<details class="claim" id="{judged.anchor}">{summary}{body}</details>'


def _lines(judged: JudgedClaim) -> str:
    headings = ("measured", "the paper", "ours", "verdict", "best", "reproduced if")
    lines = [
        [
            capital(line.line.what),
            line.line.paper,
            "–" if line.figure is None else line.figure.counted,
            line.verdict_text,
            line.best_text,
            line.line.rule.text,
        ]
        for line in judged.lines
    ]
    return table_html(Table(headings, lines), judged.claim.title)

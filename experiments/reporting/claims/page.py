"""The claims page: a summary table, then a paragraph a claim; every figure and verdict comes from the reports."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from experiments.reporting.claims.claim import Claim, Line
from experiments.reporting.claims.measures import Evidence, Measure, MissingError
from experiments.reporting.claims.paper import UNTESTED
from experiments.reporting.claims.rules import Figure, Rule, Verdict
from experiments.reporting.commands import command
from experiments.reporting.markdown import markdown_table

_NONE = "–"
_HEAD = """# The paper's claims

What M. S. Brown and W. B. Seales, "Document Restoration Using 3D Shape" (ICCV 2001), claim, how each claim was tested
here, the figure that came out, and a verdict. The tests run on a synthetic rig: camera, projector, sheets and print of
known shape, so that the truth is known. The reports beside this page have all trials, and this page is generated from
them by `python -m experiments.reporting.claims`: no figure of ours and no verdict is typed.

**Ours** is by the paper's own method where a claim is about a method: the mean of n trials with its 95 % bootstrap
interval, or a share of the trials with Wilson's. **Best** is this project's best method on the same trials.

A verdict follows from the rule that stands beside each figure below:

- **reproduced**: the whole interval is at least as good as what the paper states;
- **exceeded**: the whole interval is better than the better end of what it states (of a bound, than half of it);
- **not reproduced**: the whole interval is worse, or one trial is where all should hold, or one behind a mean failed;
- **undecided**: the interval lies on both sides, or there are too few trials;
- **not tested**: the report that would tell is missing, or has no such rows.

Where the paper has words and no figure, the rule says what they were taken to mean."""


@dataclass(frozen=True, slots=True)
class Judged:
    """A line with its figures and verdicts; without figures where a report is missing."""

    line: Line
    figure: Figure | None
    verdict: Verdict
    best: Figure | None
    best_verdict: Verdict | None

    @property
    def verdict_text(self) -> str:
        """The verdict; an undecided one with the number of trials that did not decide it."""
        return _verdict_text(self.verdict, self.figure)

    @property
    def best_text(self) -> str:
        """The best method's figure and verdict."""
        if self.best is None or self.best_verdict is None:
            return _NONE
        return f"{self.best.text}: {_verdict_text(self.best_verdict, self.best)}"


def _verdict_text(verdict: Verdict, figure: Figure | None) -> str:
    return f"{verdict} at n = {figure.n}" if verdict is Verdict.UNDECIDED and figure is not None else str(verdict)


def judge(line: Line, evidence: Evidence) -> Judged:
    """Measure a line and judge it by its rule."""
    figure, verdict = _judged(line.measure, line.rule, evidence)
    if line.best is None:
        return Judged(line, figure, verdict, None, None)
    best, best_verdict = _judged(line.best, line.rule, evidence)
    return Judged(line, figure, verdict, best, best_verdict)


def _judged(measure: Measure, rule: Rule, evidence: Evidence) -> tuple[Figure | None, Verdict]:
    try:
        figure = measure.figure(evidence)
    except MissingError:
        return None, Verdict.NOT_TESTED
    return figure, rule.verdict(figure)


def claims_page(claims: Sequence[Claim], evidence: Evidence) -> str:
    """Return the whole page as Markdown, the same for the same reports.

    Parameters
    ----------
    claims : sequence of Claim
        In the order of the page.
    evidence : Evidence
        The reports.
    """
    judged = [(claim, [judge(line, evidence) for line in claim.lines]) for claim in claims]
    parts = [_HEAD, _tally([line for _, lines in judged for line in lines]), "## Summary", _summary(judged)]
    for number, (claim, lines) in enumerate(judged, 1):
        parts += list(_paragraph(number, claim, lines, evidence))
    parts += ["## Not tested", "The paper also says", "\n".join(f"- {text};" for text in UNTESTED[:-1])]
    parts[-1] += f"\n- {UNTESTED[-1]}."
    parts += ["## The reports", _reports(claims, evidence)]
    return "\n\n".join(parts) + "\n"


def _tally(lines: Sequence[Judged]) -> str:
    counts = Counter(line.verdict for line in lines)
    said = [f"{counts[verdict]} {verdict}" for verdict in Verdict if counts[verdict]]
    return f"Of {len(lines)} figures: {', '.join(said)}."


def _summary(judged: Sequence[tuple[Claim, Sequence[Judged]]]) -> str:
    """Return a line a figure; the claim is named where its first one stands."""
    rows = [
        [
            "" if i else f"[{number}. {claim.title}](#{number}-{_anchor(claim.title)}) ({claim.section})",
            line.line.what,
            line.line.paper,
            _NONE if line.figure is None else line.figure.counted,
            line.verdict_text,
            line.best_text,
        ]
        for number, (claim, lines) in enumerate(judged, 1)
        for i, line in enumerate(lines)
    ]
    return markdown_table(("claim (section)", "measured", "the paper", "ours", "verdict", "best"), rows)


def _anchor(title: str) -> str:
    return "".join(letter for letter in title.lower().replace(" ", "-") if letter.isalnum() or letter == "-")


def _paragraph(number: int, claim: Claim, lines: Sequence[Judged], evidence: Evidence) -> Iterator[str]:
    yield f"## {number}. {claim.title}"
    yield f"> {claim.quote} (section {claim.section})"
    yield f"**Test.** {claim.test}"
    yield "\n".join(_bullet(line) for line in lines)
    yield f"**Why.** {claim.why.format_map(details_of(claim, evidence))}"
    made = (
        f"[{report}]({report}/table.md) by `{_command(report, evidence)}`" for report in reports_of(claim, evidence)
    )
    sources = "; ".join(made)
    if sources:
        yield f"From {sources}."


def _bullet(line: Judged) -> str:
    figure = "" if line.figure is None else f": {line.figure.counted}"
    best = f" Best: {line.best_text}." if line.best is not None else ""
    return (
        f"- **{line.verdict_text}**. {capital(line.line.what)}{figure}; the paper: {line.line.paper}. "
        f"Reproduced if {line.line.rule.text}.{best}"
    )


def capital(text: str) -> str:
    """Return a sentence's beginning; a symbol stays as it is."""
    return text if text.startswith("k_") else text[0].upper() + text[1:]


def details_of(claim: Claim, evidence: Evidence) -> dict[str, str]:
    """Return what stands for each `{name}` in a claim's explanation."""
    found = {}
    for name, measure in claim.details.items():
        try:
            found[name] = measure.figure(evidence).text
        except MissingError:
            found[name] = "(not measured)"
    return found


def reports_of(claim: Claim, evidence: Evidence) -> list[str]:
    """Return the reports behind a claim that are there, in the order in which it names them."""
    measures = [m for line in claim.lines for m in (line.measure, line.best) if m is not None]
    named = dict.fromkeys(report for measure in [*measures, *claim.details.values()] for report in measure.reports)
    return [report for report in named if (evidence.folder / report / "run.json").is_file()]


def _command(report: str, evidence: Evidence) -> str:
    """Return the command that makes a report again."""
    return command(evidence.run(report), evidence.n_trials(report), f"out/{report}")


def _reports(claims: Sequence[Claim], evidence: Evidence) -> str:
    names = dict.fromkeys(report for claim in claims for report in reports_of(claim, evidence))
    rows = []
    for name in names:
        run = evidence.run(name)
        failures = len({(f["trial"], f["condition"], f["method"]) for f in run["failures"]})
        machine = run["machine"].get("processor", "unknown")
        seed, trials = str(run["config"]["seed"]), str(evidence.n_trials(name))
        rows.append([f"[{name}]({name}/table.md)", seed, trials, str(failures), run["commit"][:10], machine])
    return markdown_table(("report", "seed", "trials", "failed rows", "commit", "processor"), rows)

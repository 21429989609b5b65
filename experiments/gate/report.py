"""What the gate says: Markdown for people, JUnit XML for machines."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from xml.etree import ElementTree

from deskew.errors import InputError
from experiments.gate.baseline import Baseline
from experiments.gate.verdict import ALPHA, Call, Judgement, Verdict
from experiments.reporting.markdown import NONE, markdown_table
from experiments.trials import unit_of

# Less than this no ten draws can tell.
_LEAST_P = 1e-6
_HEADINGS = ("figure", "method", "pages", "baseline", "now", "worse by", "floor", "p", "unit")


def markdown(baseline: Baseline, judgement: Judgement, method: str | None = None) -> str:
    """Return the report: the verdict in a line, what is worse, what is better, and everything else folded away."""
    worse, better = judgement.regressions, judgement.of(Call.BETTER)
    parts = [f"# Gate `{baseline.name}`: {headline(judgement)}", _summary(baseline, judgement, method)]
    if worse:
        parts.append("## Regressions\n\n" + _table(worse))
        reasons = sorted({verdict.reason for verdict in worse if verdict.reason})
        parts += ["\n".join(f"- {reason}" for reason in reasons)] * bool(reasons)
    if better:
        parts.append("## Better than the baseline\n\n" + _table(better))
        parts.append("Record a new baseline to hold what has been won.")
    if judgement.new:
        names = ", ".join(sorted({f"`{figure.metric}` ({figure.condition})" for figure in judgement.new}))
        parts.append(f"New, and not judged: {names}.")
    holds = judgement.of(Call.HOLDS)
    if holds:
        parts.append(f"<details><summary>Within the floor: {len(holds)}</summary>\n\n{_table(holds)}\n\n</details>")
    return "\n\n".join(parts) + "\n"


def headline(judgement: Judgement) -> str:
    """Return the verdict in a few words."""
    if judgement.regressions:
        return f"REGRESSION in {len(judgement.regressions)} of {len(judgement.verdicts)} figures"
    better = judgement.of(Call.BETTER)
    return f"holds; better in {len(better)} of {len(judgement.verdicts)} figures" if better else "holds"


def _summary(baseline: Baseline, judgement: Judgement, method: str | None) -> str:
    counts = ", ".join(f"{len(judgement.of(call))} {call}" for call in Call)
    whose = "" if method is None else f" `{method}` stands in the place of the baseline's method."
    commit = str(baseline.origin.get("commit", ""))[:12] or "unknown"
    return (
        f"{len(judgement.verdicts)} figures judged against commit {commit}: {counts}; {judgement.unjudged} have no "
        f"better or worse.{whose} A figure is worse if its mean over the pages has worsened by more than its floor, "
        f"which redrawn noise set, and p, corrected for the number of figures, is below {ALPHA:g}."
    )


def _table(verdicts: Sequence[Verdict]) -> str:
    return markdown_table(_HEADINGS, [_cells(verdict) for verdict in verdicts])


def _cells(verdict: Verdict) -> tuple[str, ...]:
    figure = verdict.figure
    name = f"{figure.experiment} {figure.condition} `{figure.metric}`"
    if verdict.call in (Call.MISSING, Call.FAILED):
        numbers: tuple[str, ...] = (NONE, verdict.call.value, NONE, NONE, NONE)
    else:
        values = verdict.before, verdict.now, verdict.worsening, verdict.floor
        p_value = f"{verdict.p_value:.1g}" if verdict.p_value >= _LEAST_P else f"< {_LEAST_P:.0e}"
        numbers = (*(f"{value:.4g}" for value in values), p_value)
    return (name, figure.method, str(verdict.pages), *numbers, unit_of(figure.metric))


def junit(baseline: Baseline, judgement: Judgement) -> bytes:
    """Return the report as JUnit XML: a test case for every figure judged."""
    cases = judgement.verdicts
    counts = {"tests": str(len(cases)), "failures": str(len(judgement.regressions)), "errors": "0"}
    suites = ElementTree.Element("testsuites", counts)
    suite = ElementTree.SubElement(suites, "testsuite", {"name": f"gate {baseline.name}", "skipped": "0", **counts})
    for verdict in cases:
        figure = verdict.figure
        names = {"classname": f"{figure.experiment}.{figure.condition}", "name": f"{figure.metric} {figure.method}"}
        case = ElementTree.SubElement(suite, "testcase", {**names, "time": "0"})
        said = " | ".join(f"{heading}: {cell}" for heading, cell in zip(_HEADINGS, _cells(verdict), strict=True))
        if verdict in judgement.regressions:
            failure = ElementTree.SubElement(case, "failure", {"type": verdict.call.value, "message": said})
            failure.text = verdict.reason
        else:
            ElementTree.SubElement(case, "system-out").text = said
    ElementTree.indent(suites)
    text: str = ElementTree.tostring(suites, encoding="unicode")
    return f'<?xml version="1.0" encoding="utf-8"?>\n{text}\n'.encode()


def write_all(files: Iterable[tuple[Path | None, bytes, str]]) -> None:
    """Write what has a place; a mode of "ab" appends.

    Raises
    ------
    InputError
        If a file cannot be written.
    """
    for path, content, mode in files:
        if path is None:
            continue
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with path.open(mode) as file:
                file.write(content)
        except OSError as error:
            raise InputError(f"`{path}` must be a file that can be written, got: {error.strerror}.") from error

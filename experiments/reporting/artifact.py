"""What `ARTIFACT.md` says of runs and figures, filled in from the reports between its markers.

`<!-- runs -->` ... `<!-- end -->` takes a line a report, `<!-- figures -->` ... `<!-- end -->` one a figure to check.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from experiments.reporting.agreement import tolerance_of
from experiments.reporting.claims.measures import Evidence, MissingError
from experiments.reporting.commands import command
from experiments.reporting.expectations import EXPECTED, Expectation, rerun_interval
from experiments.reporting.markdown import NONE, markdown_table
from experiments.trials.record import SECONDS_TRIAL
from experiments.trials.schema import unit_of

_BLOCK = re.compile(r"(<!-- (?P<name>runs|figures) -->\n).*?(<!-- end -->)", re.DOTALL)
_UNITLESS = "1"


def with_artifact(text: str, reports: Path) -> str:
    """Return the text of `ARTIFACT.md` with its marked blocks filled.

    Parameters
    ----------
    text : str
        Markdown with the markers.
    reports : Path
        Folder of the reports.
    """
    evidence = Evidence(reports)
    filled = {"runs": lambda: _runs(evidence), "figures": lambda: _figures(evidence)}
    return _BLOCK.sub(lambda block: f"{block[1]}{filled[block['name']]()}\n{block[3]}", text)


def minutes(timings: Path, cores: int) -> str:
    """Return how long a run takes [min]: what is done once, and all trials, each on one core, over the cores.

    Parameters
    ----------
    timings : Path
        A report's `timings.csv`; of one without the time of whole trials their stages are a lower bound.
    cores : int
        Of the machine that it was made on.
    """
    with timings.open(newline="") as file:
        rows = [(row["metric"], float(row["value"])) for row in csv.DictReader(file)]
    once = sum(value for metric, value in rows if metric == "seconds_prepare")
    whole = sum(value for metric, value in rows if metric == SECONDS_TRIAL)
    stages = sum(value for metric, value in rows if metric.startswith("seconds_")) - whole - once
    found = (once + (whole or stages) / cores) / 60.0
    return f"{'' if whole else 'over '}{found:.0f}" if found >= 1 else "under 1" if whole else "over 0"


def _runs(evidence: Evidence) -> str:
    rows = []
    for path in sorted(evidence.folder.glob("*/run.json")):
        report = path.parent.name
        run, trials = evidence.run(report), evidence.n_trials(report)
        machine = run["machine"]
        rows.append(
            [
                f"[{report}](reports/{report}/table.md)",
                f"`{command(run, trials, f'out/{report}')}`",
                str(trials),
                minutes(path.parent / "timings.csv", machine["cores"]),
                f"{machine.get('processor', 'unknown')}, {machine['cores']} cores",
                run["commit"][:10],
            ]
        )
    return markdown_table(("report", "command", "trials", "minutes", "machine", "commit"), rows)


def _figures(evidence: Evidence) -> str:
    headings = ("figure", "report, condition, method", "metric", "expected", "n", "same seed elsewhere", "another seed")
    return markdown_table(headings, [_figure(expected, evidence) for expected in EXPECTED])


def _figure(expected: Expectation, evidence: Evidence) -> list[str]:
    values, digits = expected.values, expected.digits
    where = [f"{values.report}, {values.condition}, {values.method}", f"`{values.metric}`"]
    try:
        found = [value for _, value in sorted(values.read(evidence).items())]
    except MissingError:
        return [expected.claim, *where, "no report", "0", NONE, NONE]
    unit = unit_of(values.metric)
    allowed, ends = tolerance_of(values.metric, unit), rerun_interval(found)
    same = _same_pages(evidence.run(values.report))
    shown = "" if unit == _UNITLESS else f" {unit}"
    return [
        expected.claim,
        *where,
        f"{sum(found) / len(found):.{digits}f}{shown}",
        str(len(found)),
        NONE if allowed is None else f"± {allowed:g}",
        f"{same}: as expected" if same else (NONE if ends is None else f"{ends[0]:.{digits}f}..{ends[1]:.{digits}f}"),
    ]


def _same_pages(run: Mapping[str, Any]) -> str:
    """Return what another seed leaves as it is, where it draws no other pages; "" where it does."""
    experiment, sheet = run["experiment"], run["config"].get("sheet", {})
    if experiment == "real_boards":
        return "real pictures"
    shipped = experiment == "stiffness" or sheet.get("kind") == "physical"
    return "shipped sheets" if shipped and not sheet.get("drawn") else ""

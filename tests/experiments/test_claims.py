"""The claims page: every verdict is reached from planted rows, nothing is typed, and the committed page is current."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Sequence
from dataclasses import fields, replace
from math import inf, nan
from pathlib import Path
from string import Formatter

import pytest

from experiments.reporting.claims.__main__ import main
from experiments.reporting.claims.claim import Claim, Line, mean, share
from experiments.reporting.claims.measures import Compared, Evidence, Fraction, Mean, Measure, MissingError, Per, Values
from experiments.reporting.claims.page import claims_page, judge
from experiments.reporting.claims.paper import CLAIMS
from experiments.reporting.claims.rules import (
    Above,
    Band,
    Between,
    Every,
    Figure,
    Rule,
    Verdict,
    at_most,
    stated,
    within,
)
from experiments.trials.schema import Row

ROOT = Path(__file__).resolve().parents[2]
Planted = tuple[str, str, str, Sequence[float]]


def plant(folder: Path, report: str, *planted: Planted, backwards: bool = False) -> Evidence:
    """Write a report whose trials 0, 1, ... have the given values of each (condition, method, metric)."""
    (folder / report).mkdir(parents=True, exist_ok=True)
    rows = [
        Row(report, condition, method, trial, 3, metric, float(value), "1")
        for condition, method, metric, values in planted
        for trial, value in enumerate(values)
    ]
    rows.sort(reverse=backwards)
    for kind, times in (("results", False), ("timings", True)):
        with (folder / report / f"{kind}.csv").open("w", newline="") as file:
            writer = csv.writer(file)
            writer.writerow([item.name for item in fields(Row)])
            writer.writerows(row.cells() for row in rows if row.metric.startswith("seconds_") == times)
    run = {
        "experiment": "plane_accuracy",
        "config": {"seed": 3},
        "failures": [],
        "commit": "0123456789abcdef",
        "machine": {},
    }
    (folder / report / "run.json").write_text(json.dumps(run))
    return Evidence(folder)


def figure(low: float, high: float, n: int = 9, n_failed: int = 0) -> Figure:
    return Figure((low + high) / 2, (low, high), n, n_failed=n_failed)


E, R, N, U = Verdict.EXCEEDED, Verdict.REPRODUCED, Verdict.NOT_REPRODUCED, Verdict.UNDECIDED


@pytest.mark.parametrize(
    ("rule", "low", "high", "verdict"),
    [
        (Between(0.25, 0.5), 0.1, 0.2, E),
        (Between(0.25, 0.5), 0.2, 0.3, R),
        (Between(0.25, 0.5), 0.3, 0.5, R),
        (Between(0.25, 0.5), 0.4, 0.6, U),
        (Between(0.25, 0.5), 0.2, 0.6, U),
        (Between(0.25, 0.5), 0.51, 0.6, N),
        (Between(inf, 100.0), 60.0, 90.0, N),
        (Between(inf, 100.0), 100.0, 100.0, R),
        (within(0.5), 0.1, 0.24, E),
        (within(0.5), 0.1, 0.3, R),
        (stated(0.1), 0.0, 0.0, E),
        (stated(0.0), 0.0, 0.0, R),
        (stated(0.0), 0.0, 0.2, U),
        (stated(0.0), 0.1, 0.2, N),
        (at_most(1.0), -5.0, -4.0, R),
        (Band(5.0, 10.0), 5.0, 10.0, R),
        (Band(5.0, 10.0), 4.0, 6.0, U),
        (Band(5.0, 10.0), 9.0, 11.0, U),
        (Band(5.0, 10.0), 1.0, 4.9, N),
        (Band(5.0, 10.0), 10.1, 12.0, N),
        (Above(0.0), 0.1, 0.2, R),
        (Above(0.0), 0.0, 0.2, U),
        (Above(0.0), 0.0, 0.0, N),
    ],
)
def test_a_rule_judges_the_whole_interval(rule: Rule, low: float, high: float, verdict: Verdict) -> None:
    assert rule.verdict(figure(low, high)) is verdict
    assert rule.verdict(replace(figure(low, high), interval=None)) is Verdict.UNDECIDED
    assert rule.verdict(figure(low, high, n_failed=1)) is Verdict.NOT_REPRODUCED


@pytest.mark.parametrize(
    ("n_ones", "n", "verdict"), [(5, 5, R), (50, 50, R), (4, 4, U), (49, 50, N), (0, 1, N), (3, 4, N)]
)
def test_what_holds_in_every_trial_is_refuted_by_one(n_ones: int, n: int, verdict: Verdict) -> None:
    assert Every().verdict(Figure(n_ones / n, (0.0, 1.0), n, share=True)) is verdict


def line(measure: Measure, rule: Rule, best: Measure | None = None) -> Line:
    return Line("what is measured", "1 mm", measure, rule, best)


def test_each_verdict_is_reached_from_rows(tmp_path: Path) -> None:
    found = plant(
        tmp_path,
        "planes",
        ("good", "-", "error_mm", [0.1, 0.11, 0.12, 0.1, 0.11]),
        ("fair", "-", "error_mm", [0.3, 0.31, 0.32, 0.3, 0.31]),
        ("bad", "-", "error_mm", [0.7, 0.71, 0.72, 0.7, 0.71]),
        ("wide", "-", "error_mm", [0.1, 0.9, 0.2, 0.8, 0.4]),
        ("few", "-", "error_mm", [0.3, 0.3]),
        ("some_failed", "-", "error_mm", [0.3, 0.31, 0.32]),
        ("some_failed", "-", "failed", [1.0]),
        ("all_failed", "-", "failed", [1.0, 1.0]),
    )
    expected = {
        "good": E,
        "fair": R,
        "bad": N,
        "wide": U,
        "few": U,
        "some_failed": N,
        "all_failed": N,
        "not_there": Verdict.NOT_TESTED,
    }
    for condition, verdict in expected.items():
        judged = judge(line(mean("planes", condition, "error_mm"), Between(0.25, 0.5)), found)
        assert judged.verdict is verdict, condition
    assert judge(line(mean("spheres", "good", "error_mm"), Between(0.25, 0.5)), found).verdict is Verdict.NOT_TESTED


def test_a_failed_trial_counts_against_a_share_and_is_named_beside_a_mean(tmp_path: Path) -> None:
    found = plant(
        tmp_path,
        "pages",
        ("restored", "m", "corner_max_px", [0.4, 0.5, 0.6, 0.2, 0.1]),
        ("restored", "m", "at_rest", [1, 1, 1, 1, 1]),
        ("broken", "m", "at_rest", [1, 1, 1, 1, 1]),
        ("broken", "m", "failed", [1]),
    )
    assert share("pages", "restored", "at_rest", "m").figure(found).text.startswith("5 of 5 (57..100 %)")
    assert share("pages", "broken", "at_rest", "m").figure(found).text.startswith("5 of 6")
    assert Every().verdict(share("pages", "broken", "at_rest", "m").figure(found)) is Verdict.NOT_REPRODUCED
    assert share("pages", "restored", "corner_max_px", "m", 0.5).figure(found).text.startswith("4 of 5")
    assert mean("pages", "broken", "at_rest", "m").figure(found).counted.endswith("n = 5, 1 failed")


def test_measures_by_hand(tmp_path: Path) -> None:
    found = plant(
        tmp_path,
        "flights",
        ("a", "slow", "seconds_fly", [2.0, 4.0, 8.0]),
        ("a", "fast", "seconds_fly", [1.0, 1.0, 1.0, 9.0]),
        ("push=1", "m", "flat", [1, 0]),
        ("push=2", "m", "flat", [1, 1]),
        ("push=3", "m", "flat", [0, 0]),
        ("push=3", "m", "never", [1, 0]),
    )
    slow, fast = (Values("flights", "a", "seconds_fly", method) for method in ("slow", "fast"))
    ratio = Compared(slow, fast).figure(found)
    assert (round(ratio.value, 9), ratio.n, ratio.unit) == (4.0, 3, "times")
    assert ratio.interval is not None
    assert 2.0 <= ratio.interval[0] < 4.0 < ratio.interval[1] <= 8.0
    assert Compared(slow, fast, difference=True).figure(found).value == pytest.approx(11 / 3)
    total = Mean((slow, fast), "s", 1, 10.0).figure(found)
    assert (total.value, total.n, total.text.startswith("56.7 (")) == (pytest.approx(170 / 3), 3, True)
    assert Per(28.0, Mean((slow,))).figure(found).value == pytest.approx(6.0)
    # Trial 0 was right wherever it stopped, trial 1 once in three.
    fraction = Fraction("flights", "push=", "m", "flat", "never").figure(found)
    assert (fraction.value, fraction.n) == (pytest.approx((100 + 100 / 3) / 2), 2)
    with pytest.raises(MissingError):
        Fraction("flights", "pull=", "m", "flat").figure(found)


CLAIM = Claim(
    "A claim: with 0.5",
    "4.1",
    "It is good.",
    "It is measured.",
    (
        line(mean("planes", "a", "error_mm", unit="mm"), within(1.0), mean("planes", "b", "error_mm", unit="mm")),
        line(mean("planes", "gone", "error_mm", unit="mm"), within(1.0)),
        line(mean("planes", "few", "error_mm", unit="mm"), within(1.0)),
    ),
    "It was {much}, and {more}.",
    {"much": mean("planes", "a", "error_mm", digits=1), "more": mean("spheres", "a", "error_mm")},
)


def planted(folder: Path, *, backwards: bool = False) -> Evidence:
    return plant(
        folder,
        "planes",
        ("a", "-", "error_mm", [0.6, 0.7, 0.8]),
        ("b", "-", "error_mm", [0.2, 0.2, 0.2]),
        ("few", "-", "error_mm", [0.2]),
        backwards=backwards,
    )


def test_the_page_says_claim_figure_verdict_and_how_to_repeat_it(tmp_path: Path) -> None:
    page = claims_page([CLAIM], planted(tmp_path))
    assert "Of 3 figures: 1 reproduced, 1 undecided, 1 not tested: report missing." in page
    row = "what is measured | 1 mm | 0.700 (0.600..0.800) mm, n = 3 | reproduced | 0.200 (0.200..0.200) mm: exceeded |"
    assert f"| [1. A claim: with 0.5](#1-a-claim-with-05) (4.1) | {row}" in page
    assert "|  | what is measured | 1 mm | – | not tested: report missing | – |" in page
    assert "| undecided at n = 1 | – |" in page
    assert "> It is good. (section 4.1)" in page
    assert "Reproduced if the whole interval is at most 1, exceeded if it is below 0.5." in page
    assert "**Why.** It was 0.7 (0.6..0.8), and (not measured)." in page
    command = "python -m experiments experiment=plane_accuracy seed=3 trials=3 out=out/planes"
    assert f"[planes](planes/table.md) by `{command}`" in page
    assert "| [planes](planes/table.md) | 3 | 3 | 0 | 0123456789 | unknown |" in page


def test_the_page_is_the_same_for_the_same_rows_in_any_order(tmp_path: Path) -> None:
    forwards, backwards = (planted(tmp_path / str(order), backwards=order) for order in (False, True))
    assert claims_page([CLAIM], forwards) == claims_page([CLAIM], backwards)


def test_without_any_report_nothing_is_tested_and_the_page_still_stands(tmp_path: Path) -> None:
    page = claims_page(CLAIMS, Evidence(tmp_path))
    n = sum(len(claim.lines) for claim in CLAIMS)
    assert f"Of {n} figures: {n} not tested: report missing." in page
    assert "python -m experiments experiment" not in page


def test_reasons_use_their_details_and_type_neither_a_figure_nor_a_verdict() -> None:
    # Settings that the texts name: an eps, a push, a restitution, a guess among 22 letters.
    named = {"0.05", "0.005", "0.1", "0.3", "0.7", "0.9", "0.25", "0.31"}
    for claim in CLAIMS:
        used = {name for _, name, _, _ in Formatter().parse(claim.why) if name}
        assert used == set(claim.details), claim.title
        assert set(re.findall(r"\d+\.\d+", claim.why)) <= named, claim.title
        assert not re.search(r"reproduced|exceeded|undecided|holds|fails", claim.why), claim.title


def test_the_claims_that_were_asked_for_are_there() -> None:
    sections = {section.strip() for claim in CLAIMS for section in claim.section.split(",")}
    assert {"2.2", "2.3", "2.4", "2.5", "3.3.2", "3.4", "4", "4.1", "4.2", "4.3", "5"} <= sections
    assert len({claim.title for claim in CLAIMS}) == len(CLAIMS)


def test_the_committed_page_is_what_the_committed_reports_give() -> None:
    reports = ROOT / "reports"
    page = (reports / "CLAIMS.md").read_text()
    assert page == claims_page(CLAIMS, Evidence(reports)), "run python -m experiments.reporting.claims"
    tables = set(re.findall(r"\]\((\w+/table\.md)\)", page))
    assert len(tables) > 5
    assert [table for table in tables if not (reports / table).is_file()] == []


def test_a_folder_that_is_none_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(tmp_path / "no")]) == 2
    assert main(["a", "b"]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 2
    assert main([str(tmp_path)]) == 0
    assert (tmp_path / "CLAIMS.md").read_text().startswith("# The paper's claims")


def test_a_figure_of_no_trials_says_that_all_failed() -> None:
    assert Figure(nan, None, 0, "mm", 3, n_failed=4).counted == "all 4 failed"

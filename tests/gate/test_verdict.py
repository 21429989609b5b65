"""The judgement: every direction, every kind of loss, and the statistics against closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from deskew.errors import InputError
from experiments.gate.baseline import Baseline
from experiments.gate.directions import direction_of, directions
from experiments.gate.floors import Figure, Noise, noise_of
from experiments.gate.verdict import ALPHA, Call, holm, judge
from experiments.trials import Row, unit_of

N_PAGES = 4
NOISE = Noise(draws=10, run_sd=0.0, page_sd=0.01)


def rows(metric: str, values: list[float], condition: str = "restored", method: str = "spring") -> list[Row]:
    return [Row("fake", condition, method, i, 1, metric, value, unit_of(metric)) for i, value in enumerate(values)]


def calls(before: list[Row], now: list[Row], noise: Noise = NOISE) -> dict[str, Call]:
    floors = {Figure("fake", row.condition, row.method, row.metric): noise for row in before}
    return {verdict.figure.metric: verdict.call for verdict in judge(before, now, floors).verdicts}


@pytest.mark.parametrize("pattern", sorted(directions()))
def test_every_judged_metric_trips_one_way_and_not_the_other(pattern: str) -> None:
    metric = pattern.replace("*", "mean")
    direction = directions()[pattern]
    before, more, less = ([value + step for value in (1.0, 1.2, 1.1, 1.3)] for step in (0.0, 0.5, -0.5))
    grown, shrunk = (calls(rows(metric, before), rows(metric, values))[metric] for values in (more, less))
    worse = grown if direction.badness(2.0) > direction.badness(1.0) else shrunk
    better = shrunk if worse is grown else grown
    assert (worse, better) == (Call.WORSE, Call.BETTER)
    assert calls(rows(metric, before), rows(metric, before))[metric] is Call.HOLDS


def test_a_bias_is_worse_on_either_side_of_nothing() -> None:
    small, large = [0.01, -0.01, 0.02, 0.0], [-0.5, -0.5, -0.6, -0.5]
    assert calls(rows("depth_bias_mm", small), rows("depth_bias_mm", large))["depth_bias_mm"] is Call.WORSE
    assert calls(rows("depth_bias_mm", large), rows("depth_bias_mm", small))["depth_bias_mm"] is Call.BETTER


@pytest.mark.parametrize(
    ("condition", "metric"),
    [
        ("restored", "steps"),
        ("restored", "strain_rms"),
        ("restored", "meets_paper"),
        ("unrestored", "corner_mean_px"),
        ("unrestored/saddle", "corner_rigid_mean_mm"),
        ("fault/yaw", "plane_rms_mm"),
        ("flattened/folds", "noise_estimated_mm"),
    ],
)
def test_what_is_no_quality_is_not_judged(condition: str, metric: str) -> None:
    assert direction_of(condition, metric) is None
    assert judge(rows(metric, [1.0], condition), rows(metric, [9.0], condition), {}).verdicts == ()


def test_figures_of_the_scan_are_judged_wherever_they_stand() -> None:
    for metric in ("depth_rms_mm", "depth_coverage", "calib_stereo_rms_px"):
        assert direction_of("unrestored", metric) is not None


def test_every_figure_of_the_smoke_baseline_can_be_judged(smoke: Baseline) -> None:
    """A synthetic worsening of each figure by ten of its floors fails the gate by that figure and no other."""
    judgement = judge(smoke.rows, smoke.rows, smoke.floors)
    assert len(judgement.verdicts) > 90
    assert {verdict.call for verdict in judgement.verdicts} == {Call.HOLDS}
    for verdict in judgement.verdicts:
        direction = direction_of(verdict.figure.condition, verdict.figure.metric)
        assert direction is not None
        step = 10 * max(verdict.floor, 0.01)
        step = step if direction.badness(2.0) > direction.badness(1.0) else -step

        def moved(row: Row, step: float = step, figure: Figure = verdict.figure) -> Row:
            here = Figure(row.experiment, row.condition, row.method, row.metric) == figure
            return (
                replace(row, value=row.value + np.copysign(step, row.value or 1) if step > 0 else row.value + step)
                if here
                else row
            )

        found = judge(smoke.rows, [moved(row) for row in smoke.rows], smoke.floors)
        assert [v.figure for v in found.regressions] == [verdict.figure]


def test_missing_and_failed_pages_fail_and_new_rows_are_told() -> None:
    before = rows("dense_mean_mm", [0.1] * N_PAGES) + rows("corners_missing", [0.0] * N_PAGES)
    assert calls(before, before[:-1])["corners_missing"] is Call.MISSING
    assert set(calls(before, []).values()) == {Call.MISSING}
    lost = [row for row in before if row.trial != 3]
    for condition, method in (("restored", "spring"), ("-", "-"), ("restored", "other")):
        failed = [Row("fake", condition, method, 3, 1, "failed", 1.0, "1")]
        assert calls(before, lost + failed) == {
            "dense_mean_mm": Call.MISSING,
            "corners_missing": Call.MISSING,
            "failed": Call.FAILED,
        }
        assert calls(before, before + failed)["failed"] is Call.FAILED
    floors = {Figure("fake", "restored", "spring", row.metric): NOISE for row in before}
    more = judge(before, before + rows("dense_p95_mm", [0.3]), floors)
    assert [figure.metric for figure in more.new] == ["dense_p95_mm"]
    assert not more.regressions


def test_a_metric_that_is_not_judged_may_go_missing() -> None:
    before = rows("dense_mean_mm", [0.1]) + rows("steps", [900.0])
    assert calls(before, before[:1]) == {"dense_mean_mm": Call.HOLDS}


def test_one_ruined_page_is_enough() -> None:
    """A t-test over the pages would say t = 1, p = .2."""
    before, now = [0.1] * N_PAGES, [0.1, 0.1, 0.1, 0.6]
    assert stats.ttest_rel(now, before, alternative="greater").pvalue > 0.19
    assert calls(rows("dense_mean_mm", before), rows("dense_mean_mm", now))["dense_mean_mm"] is Call.WORSE


def test_counts_may_grow_by_one_in_all_pages() -> None:
    quiet, before = Noise(10, 0.0, 0.0), rows("corners_missing", [0.0] * N_PAGES)
    assert calls(before, rows("corners_missing", [0.0, 1.0, 0.0, 0.0]), quiet)["corners_missing"] is Call.HOLDS
    assert calls(before, rows("corners_missing", [0.0, 1.0, 1.0, 0.0]), quiet)["corners_missing"] is Call.WORSE
    rest = rows("at_rest", [1.0] * N_PAGES)
    assert calls(rest, rows("at_rest", [1.0, 1.0, 1.0, 0.0]), quiet)["at_rest"] is Call.WORSE


def test_what_other_machines_round_otherwise_is_no_regression() -> None:
    silent = Noise(10, 0.0, 0.0)
    before = rows("corner_mean_px", [0.1] * N_PAGES)
    assert calls(before, rows("corner_mean_px", [0.1015] * N_PAGES), silent)["corner_mean_px"] is Call.HOLDS
    assert calls(before, rows("corner_mean_px", [0.1025] * N_PAGES), silent)["corner_mean_px"] is Call.WORSE


def test_wrong_pages_failed_baselines_and_missing_floors_cannot_be_judged() -> None:
    before = rows("dense_mean_mm", [0.1]) + rows("slope_p90_deg", [20.0])
    with pytest.raises(InputError, match=r"slope_p90_deg` must be the same as in the baseline, 20 in trial 0, got 21"):
        judge(before, rows("dense_mean_mm", [0.1]) + rows("slope_p90_deg", [21.0]), {})
    with pytest.raises(InputError, match="`the floor of fake restored spring dense_mean_mm` must be derived"):
        judge(before, before, {})
    with pytest.raises(InputError, match="`the baseline` must hold no failed trial, got fake restored spring failed"):
        judge(rows("failed", [1.0]), [], {})


@settings(deadline=None)
@given(st.lists(st.floats(0, 1), min_size=1, max_size=30))
def test_holm_is_what_its_definition_says(p_values: list[float]) -> None:
    found = holm(np.array(p_values))
    ordered = sorted(p_values)
    n = len(ordered)
    for p, corrected in zip(p_values, found, strict=True):
        rank = ordered.index(p) + ordered.count(p) - 1
        assert corrected == pytest.approx(min(1.0, max((n - i) * ordered[i] for i in range(rank + 1))))
    assert (found >= np.array(p_values)).all()


def test_noise_is_told_apart_by_what_all_pages_share() -> None:
    """Closed form of the analysis of variance, and both components of a large made-up table within 5 %."""
    values = np.array([[1.0, 5.0], [2.0, 6.0], [3.0, 7.0]])
    assert noise_of(values) == Noise(3, 1.0, 0.0)
    assert noise_of(values[:, :1]) == Noise(3, 1.0, 0.0)
    rng = np.random.default_rng(8)
    table = rng.normal(0, 3, 20) + rng.normal(0, 0.2, (4000, 1)) + rng.normal(0, 0.5, (4000, 20))
    found = noise_of(table)
    assert (found.run_sd, found.page_sd) == pytest.approx((0.2, 0.5), rel=0.05)


def test_p_values_of_redrawn_noise_are_uniform() -> None:
    """Floors from 10 draws, a rerun against a baseline: Student's t with 9 degrees of freedom and no other law."""
    rng = np.random.default_rng(4)
    found = []
    for _ in range(3000):
        draws = rng.normal(0, 0.3, (12, 1)) + rng.normal(0, 0.5, (12, N_PAGES))
        noise = noise_of(draws[:10])
        found.append(noise.p_value(float(draws[11].mean() - draws[10].mean()), N_PAGES))
    assert stats.kstest(found, "uniform").pvalue > 1e-3


def test_false_alarms_of_a_family_stay_below_alpha_and_a_shift_of_ten_deviations_is_seen() -> None:
    rng = np.random.default_rng(12)
    alarms, seen = 0, 0
    for _ in range(300):
        draws = rng.normal(0, 0.01, (12, 40, N_PAGES))
        noises = [noise_of(draws[:10, k]) for k in range(40)]
        shift = np.where(np.arange(40) == 7, 10 * 0.01 / np.sqrt(N_PAGES) * np.sqrt(2), 0.0)
        for moved in (0.0, shift):
            change = (draws[11] - draws[10]).mean(axis=1) + moved
            p = holm(np.array([n.p_value(float(d), N_PAGES) for n, d in zip(noises, change, strict=True)]))
            if moved is shift:
                seen += bool(p[7] < ALPHA)
            else:
                alarms += bool((p < ALPHA).any())
    assert alarms <= 300 * ALPHA + 5
    assert seen > 0.9 * 300

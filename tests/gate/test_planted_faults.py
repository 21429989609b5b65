"""Faults planted in the running program: each is caught by the gate, by a figure that makes sense."""

from __future__ import annotations

import pytest

from deskew.errors import InputError
from experiments.gate.baseline import Baseline
from experiments.gate.floors import Figure
from experiments.gate.verdict import Call, Judgement
from tests.gate.one_page import OnePage


def worse(judgement: Judgement) -> set[tuple[str, str, str]]:
    assert not judgement.of(Call.MISSING, Call.FAILED)
    return {verdict.figure[1:] for verdict in judgement.of(Call.WORSE)}


def test_the_page_as_it_was_holds_to_the_last_digit(page: OnePage, smoke: Baseline) -> None:
    judgement = page.with_fault("")
    assert not judgement.regressions
    assert not judgement.new
    assert len(judgement.verdicts) > 60
    # Across machines a figure may round otherwise, never by more than its floor.
    assert all(abs(verdict.worsening) <= verdict.floor for verdict in judgement.verdicts)


@pytest.mark.parametrize(
    ("fault", "condition", "method", "metric"),
    [
        ("anisotropic_rest_lengths", "restored", "spring", "dense_mean_mm"),
        ("anisotropic_rest_lengths", "restored/saddle", "spring", "corner_rigid_mean_mm"),
        ("shrunken_rest_lengths", "restored", "spring", "corner_rigid_mean_mm"),
        ("wrong_sign_in_chords", "restored", "spring", "corner_rigid_mean_mm"),
        ("half_texel_everywhere", "control/saddle", "-", "detector_rms_px"),
        ("half_texel_in_restored", "restored/saddle", "spring", "picture_to_map_rms_mm"),
        ("integer_forces", "restored", "paper_euler", "dense_mean_mm"),
        ("integer_forces", "restored", "paper_euler", "at_rest"),
    ],
)
def test_fault_is_caught(page: OnePage, fault: str, condition: str, method: str, metric: str) -> None:
    assert (condition, method, metric) in worse(page.with_fault(fault))


def test_a_decoder_bias_after_calibration_is_caught(page: OnePage) -> None:
    found = worse(page.with_fault("decoder_bias", scan=True))
    assert {("restored", "spring", "depth_bias_mm"), ("restored", "spring", "depth_rms_mm")} <= found


def test_a_uniform_shrink_is_seen_by_rigid_figures_and_not_by_affine_ones(page: OnePage) -> None:
    verdicts = {verdict.figure: verdict for verdict in page.with_fault("shrunken_rest_lengths").verdicts}
    rigid, affine = (
        verdicts[Figure("corner_distance", "restored/saddle", "spring", metric)].worsening
        for metric in ("corner_rigid_mean_mm", "corner_mean_mm")
    )
    assert rigid > 3.0
    assert abs(affine) < 0.01


def test_the_paper_s_method_is_not_blamed_for_the_other_s_lengths(page: OnePage) -> None:
    assert not any(method == "spring" for _, method, _ in worse(page.with_fault("integer_forces")))


def test_meshes_show_anisotropic_lengths_too(smoke: Baseline) -> None:
    found = worse(OnePage(smoke, 1).with_fault("anisotropic_rest_lengths"))
    assert ("flattened/folds", "spring", "flat_rigid_mean_mm") in found


def test_lost_corners_flatter_the_mean_and_are_seen_as_missing(page: OnePage) -> None:
    judgement = page.with_fault("lost_corners")
    found = {verdict.figure[1:]: verdict for verdict in judgement.verdicts}
    missing, mean = (found["restored", "spring", metric] for metric in ("corners_missing", "corner_mean_px"))
    assert missing.call == Call.WORSE
    # A tenth of the restored page's 300 corners, of the control's, or of both.
    assert 30 <= missing.now <= 60
    assert mean.worsening < 0


def test_lost_corners_that_nobody_counts_make_it_another_page(page: OnePage) -> None:
    with pytest.raises(
        InputError, match="corners_expected` must be the same as in the baseline, 300 in trial 0, got 27"
    ):
        page.with_fault("uncounted_lost_corners")

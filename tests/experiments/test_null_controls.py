"""Null controls: every metric scores the truth best, and sees what a spoilt truth lacks unless it is blind to that."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import pytest

from data_synth import Rig
from experiments.program import main
from experiments.settings import RigSettings
from experiments.studies import null_controls
from experiments.studies.bench import configured_rig

Figures = dict[tuple[str, str], float]


def half_as_fine(settings: RigSettings) -> Rig:
    """The rig with a camera of half the pixels each way."""
    rig = configured_rig(settings)
    K = rig.camera.K.copy()
    K[:2] /= 2
    K[:2, 2] -= 0.25
    return replace(rig, camera=replace(rig.camera, size=(320, 240), K=K))


@pytest.fixture(scope="module")
def figures(tmp_path_factory: pytest.TempPathFactory) -> Figures:
    out = tmp_path_factory.mktemp("nulls")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(null_controls, "configured_rig", half_as_fine)
        assert main(["experiment=null_controls", "trials=1", "seed=3", "engine=serial", f"out={out}"]) == 0
    with (out / "results.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert "failed" not in {row["metric"] for row in rows}
    return {(row["condition"].removeprefix("null/"), row["metric"]): float(row["value"]) for row in rows}


def test_rigid_figures_see_a_percent_and_affine_ones_do_not(figures: Figures) -> None:
    # A page of 279 mm, 1 % longer about its middle: 0.7 mm in the mean if every place counts alike.
    assert figures["stretched", "dense_mean_mm"] == pytest.approx(279 / 4 * 0.01, abs=0.05)
    assert figures["stretched", "corner_rigid_mean_mm"] == pytest.approx(0.65, abs=0.1)
    assert figures["stretched", "flat_rigid_mean_mm"] == pytest.approx(279 / 4 * 0.01, abs=0.05)
    assert figures["stretched", "flat_mean_mm"] < 1e-9
    assert figures["stretched", "corner_mean_mm"] == pytest.approx(figures["itself", "corner_mean_mm"], abs=0.03)


def test_no_figure_of_shape_sees_where_the_page_lies(figures: Figures) -> None:
    for metric in ("dense_mean_mm", "corner_rigid_mean_mm", "flat_rigid_mean_mm"):
        assert 0.0 <= figures["shifted", metric] == pytest.approx(figures["itself", metric], abs=0.02)


def test_depth_reads_how_far_it_is_off(figures: Figures) -> None:
    assert figures["itself", "depth_rms_mm"] < 1e-6
    assert figures["shifted", "depth_bias_mm"] == pytest.approx(1.0, abs=1e-6)
    assert figures["shifted", "depth_p95_mm"] == pytest.approx(1.0, abs=1e-6)
    assert 3.0 < figures["another", "depth_rms_mm"] < 40.0
    assert 3.0 < figures["bed", "depth_rms_mm"] < 40.0


def test_a_page_that_was_not_flattened_is_told_from_one_that_was(figures: Figures) -> None:
    for metric in ("dense_mean_mm", "corner_mean_px", "corner_rigid_mean_mm", "flat_rigid_mean_mm"):
        assert figures["unflattened", metric] > 5 * figures["itself", metric]
    for metric in ("dense_mean_mm", "corner_mean_px"):
        assert figures["another", metric] > 5 * figures["itself", metric]


def test_letters_without_order_are_no_text_and_silence_is_only_seen_by_deletions(figures: Figures) -> None:
    assert figures["itself", "misses"] == 0
    for null in ("another", "shuffled"):
        assert 130 < figures[null, "misses"] <= 176
        assert figures[null, "word_recall"] < 0.1
    assert (figures["nothing", "misses"], figures["nothing", "misses_paper"]) == (176, 0)


def test_pictures_score_their_own_truth_best(figures: Figures) -> None:
    for metric in ("ms_ssim_docunet", "ms_ssim_wang"):
        itself, beside, another, bare = (figures[n, metric] for n in ("itself", "shifted", "another", "nothing"))
        assert itself == pytest.approx(1.0)
        assert 0.99 > beside > max(another, bare) > min(another, bare) > 0.1
    for metric in ("ld_dis_px", "ad_dis"):
        assert figures["itself", metric] == pytest.approx(0.0, abs=1e-6)
        assert figures["another", metric] > 5 * figures["shifted", metric] > 0
    assert figures["nothing", "text_lines"] == 0


FAMILIES = ("corner_", "dense_", "depth_", "flat_", "misses", "word_", "ms_ssim", "ld_", "ad_", "lid_")
# Counts and settings that judge nothing, the same metrics under other lights, and what another study's nulls are for.
NOT_JUDGED = ("corners_", "_projector", "_unshaded", "_normalised", "depth_raw", "corner_units", "corner_rms", "_max_")


def test_every_committed_metric_of_these_families_has_a_null(figures: Figures) -> None:
    reports = Path(__file__).parents[2] / "reports"
    with_null = {metric for _, metric in figures}
    for report in ("corner_distance", "ocr_misses", "surfaces", "textures"):
        with (reports / report / "results.csv").open(newline="") as file:
            metrics = {row["metric"] for row in csv.DictReader(file)}
        judged = {name for name in metrics if name.startswith(FAMILIES) and not any(x in name for x in NOT_JUDGED)}
        assert judged <= with_null, report

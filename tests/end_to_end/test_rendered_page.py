"""From rendered captures to a restored page, through an estimated calibration, held against the rig's own truth."""

from __future__ import annotations

import numpy as np
import pytest

import data_synth
from deskew import acquisition, metrics, pipeline, restoration
from deskew.acquisition import DenoiseSettings, SweepSettings
from deskew.errors import StepError
from deskew.projection import centre
from deskew.recipes import BEST
from deskew.types import Status

SEED = 20011  # no other test, experiment or development run uses it
PAGE = data_synth.Checkerboard()


@pytest.fixture(scope="module")
def rig():
    return data_synth.default_rig()


@pytest.fixture(scope="module")
def calibration(rig):
    rng = np.random.default_rng(SEED)
    captures = (data_synth.render_board(rig, pose, rng) for pose in data_synth.board_poses(8))
    return pipeline.calibrate(data_synth.BOARD, captures)


@pytest.fixture(scope="module")
def crumpled(rig):
    rng = np.random.default_rng(SEED + 1)
    sheet = data_synth.crumpled(rng, slope_p90_deg=20.0)
    capture, truth = data_synth.render(rig, sheet, PAGE, rng)
    return capture, truth


@pytest.fixture(scope="module")
def scan(crumpled, calibration):
    return pipeline.scan(crumpled[0], calibration)


def test_calibration_finds_the_rig(rig, calibration):
    """Pixels of the estimated camera lie where the true one's do, and so do both optical centres."""
    assert 0.002 < calibration.residuals["camera_rms_px"] < 0.03
    assert 0.01 < calibration.residuals["projector_rms_px"] < 0.08
    for got, true, most in ((calibration.camera, rig.camera, 0.5), (calibration.projector, rig.projector, 0.8)):
        assert 0.0 < np.linalg.norm(centre(got) - centre(true)) < most
    # The lens shift: the principal point lies below the projector's frame.
    assert abs(calibration.projector.K[1, 2] - rig.projector.K[1, 2]) < 4.0


@pytest.mark.parametrize(("page", "most_mm"), [(data_synth.Blank(), 0.05), (PAGE, 0.15)], ids=["white", "checkered"])
def test_a_plane_is_flat(rig, calibration, page, most_mm):
    sheet = data_synth.plane(page.page_size_mm, tilt_deg=9.0, azimuth_deg=40.0)
    capture, truth = data_synth.render(rig, sheet, page, np.random.default_rng(SEED + 2))
    depth = acquisition.depth_map(calibration, pipeline.decode(capture))
    true_points = truth.points_at(restoration.undistortion_map(calibration.camera).astype(np.float64))
    on_page = np.isfinite(true_points[..., 0])
    assert 0.005 < acquisition.plane_deviation(acquisition.depth_points(depth, on_page)).mean_abs_mm < most_mm
    # The plane's own fit is blind to scale; the depth itself is not. A fifth of a projector pixel would be seen.
    assert abs(metrics.depth_error(depth, true_points)["depth_raw_bias_mm"]) < 0.02
    assert np.isfinite(depth.z[on_page]).mean() > 0.95


def test_spatial_and_temporal_peaks_see_the_same_page(crumpled, calibration):
    capture, _ = crumpled
    temporal = pipeline.decode(capture)
    spatial = pipeline.decode(capture, SweepSettings(mode="spatial"))
    both = (temporal.reason == 0) & (spatial.reason == 0)
    assert both.mean() > 0.5
    assert abs(np.median((spatial.column - temporal.column)[both])) < 0.02


def test_a_crumpled_page_is_restored_as_in_the_paper(rig, crumpled, calibration, scan):
    capture, truth = crumpled
    flat = data_synth.photograph(rig, data_synth.flat_sheet(PAGE.page_size_mm), PAGE, SEED)
    camera, view = calibration.camera, restoration.view_camera(calibration.camera)
    restored = pipeline.restore(scan, method="paper_euler")
    assert restored.flattened is not None
    assert restored.flattened.status is Status.AT_REST
    uv = truth.page_at(restored.backward_map.astype(np.float64))
    dense = metrics.dense_error(restored, uv, PAGE.page_size_mm)
    assert 0.02 < dense["dense_mean_mm"] < 0.8
    assert 0.995 < dense["page_coverage"] <= 1.0
    control = _board_corners(restoration.undistorted_view(flat.white, camera))
    found = _board_corners(restored.image)
    distance = metrics.corner_distance(found, control, view)
    assert distance["corners_missing"] == 0
    assert 0.05 < distance["corner_mean_px"] < 0.75
    unrestored = restoration.undistorted_view(capture.white, camera)
    before = metrics.corner_distance(_board_corners(unrestored), control, view)
    assert before["corner_mean_px"] > 2 * distance["corner_mean_px"]


def test_the_denoiser_brings_the_depth_of_a_printed_crumpled_page_closer_to_the_truth(crumpled, calibration, scan):
    capture, truth = crumpled
    filtered = pipeline.scan(capture, calibration, denoise=DenoiseSettings())
    true_points = truth.points_at(restoration.undistortion_map(calibration.camera).astype(np.float64))
    figures = metrics.depth_error(scan.depth, true_points)
    figures |= metrics.depth_error(filtered.depth, true_points, prefix="depth")
    assert 0.15 < figures["depth_raw_rms_mm"] < 0.25
    assert 0.02 < figures["depth_rms_mm"] < 0.07
    assert 0.03 < figures["depth_p95_mm"] < 0.16  # the ink is not corrected here: part of its bands passes
    assert 0.0 < np.abs(filtered.sheet.vertices - scan.sheet.vertices).max() < 5.0
    np.testing.assert_array_equal(filtered.depth.reason, scan.depth.reason)


def test_the_best_recipe_restores_a_page_several_times_closer_than_the_papers(crumpled, calibration, scan):
    capture, truth = crumpled
    best = pipeline.scan_by(BEST, capture, calibration)
    assert best.sheet.vertices.shape == scan.sheet.vertices.shape == (45, 45, 3)
    errors = {}
    for method, page in (("spring", best), ("paper_rk4", scan)):
        restored = pipeline.restore(page, method=method)
        assert restored.flattened.status is Status.AT_REST
        uv = truth.page_at(restored.backward_map.astype(np.float64))
        errors[method] = metrics.dense_error(restored, uv, PAGE.page_size_mm)
    assert 0.005 < errors["spring"]["dense_mean_mm"] < 0.08
    assert 0.01 < errors["spring"]["dense_p95_mm"] < 0.2
    assert errors["spring"]["dense_mean_mm"] < 0.4 * errors["paper_rk4"]["dense_mean_mm"]
    assert 0.995 < errors["spring"]["page_coverage"] <= 1.0


def test_both_integrators_end_on_the_same_page(scan):
    euler, rk4 = (pipeline.restore(scan, method=method) for method in ("paper_euler", "paper_rk4"))
    apart = np.linalg.norm(euler.flattened.vertices - rk4.flattened.vertices, axis=-1)
    assert apart.max() < 0.1  # of a page of 279 mm; they stop at slightly different residuals


def test_a_diverged_page_is_no_picture(scan):
    with pytest.raises(StepError, match=r"Flattening diverged: .*lower `dt`"):
        pipeline.restore(scan, method="paper_euler", dt=1.0)


def test_the_same_seed_gives_the_same_bytes(rig):
    sheets = [data_synth.crumpled(np.random.default_rng(SEED), slope_p90_deg=20.0) for _ in range(2)]
    first, second = (data_synth.photograph(rig, sheet, PAGE, SEED) for sheet in sheets)
    assert np.array_equal(first.white, second.white)
    assert all(np.array_equal(first.columns[i], second.columns[i]) for i in (0, 511, 1023))


def _board_corners(image):
    return acquisition.find_board(image, (20, 15)).reshape(-1, 2)

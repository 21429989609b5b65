from dataclasses import replace

import cv2
import numpy as np
import pytest

from deskew.acquisition.epipolar import cull_epipolar, epipolar_distance
from deskew.errors import InputError
from deskew.projection import pixel_grid, undistort
from deskew.types import Correspondence, Reason
from tests.acquisition.stripe_scenes import bench, plane_depth, seen_from

TILTED = np.array([0.2, -0.1, 1.0])


@pytest.fixture(scope="module", params=[True, False], ids=["distorted", "ideal"])
def calibration(request):
    return bench(distorted=request.param)


@pytest.fixture
def exact(calibration):
    return seen_from(calibration, plane_depth(calibration.camera, TILTED, 20.0))


def test_consistent_points_lie_on_their_lines(calibration, exact):
    assert np.abs(epipolar_distance(calibration, exact)).max() < 1e-9


def test_lens_distortion_matters_here():
    calibration = bench()
    exact = seen_from(calibration, plane_depth(calibration.camera, TILTED, 20.0))
    for device in ("camera", "projector"):
        ideal = replace(getattr(calibration, device), distortion=np.zeros(5))
        assert np.abs(epipolar_distance(replace(calibration, **{device: ideal}), exact)).max() > 0.1


def test_distances_equal_opencvs_epilines_on_undistorted_points(calibration, exact):
    camera, projector = calibration.camera, calibration.projector
    moved = Correspondence(exact.column + 3.0, exact.row - 2.0, exact.reason)
    R = projector.R @ camera.R.T
    tx, ty, tz = projector.t - R @ camera.t
    E = np.array([[0, -tz, ty], [tz, 0, -tx], [-ty, tx, 0]]) @ R
    F = np.linalg.inv(projector.K).T @ E @ np.linalg.inv(camera.K)

    def undistorted_px(device, pixels):
        return (undistort(device, pixels) @ device.K[:2, :2].T + device.K[:2, 2]).reshape(-1, 2)

    lines = cv2.computeCorrespondEpilines(undistorted_px(camera, pixel_grid(camera.size)), 1, F).reshape(-1, 3)
    points = undistorted_px(projector, np.stack([moved.column, moved.row], axis=-1))
    expected = np.abs((lines[:, :2] * points).sum(1) + lines[:, 2])
    assert 1.0 < expected.mean() < 4.0
    np.testing.assert_allclose(np.abs(epipolar_distance(calibration, moved)).ravel(), expected, atol=1e-6)


def test_a_shifted_row_is_culled_and_the_rest_kept(calibration, exact):
    row = exact.row.copy()
    row[10:20, 30:50] += 4.0
    culled = cull_epipolar(calibration, Correspondence(exact.column, row, exact.reason))
    wrong = np.zeros(row.shape, bool)
    wrong[10:20, 30:50] = True
    np.testing.assert_array_equal(culled.reason, np.where(wrong, Reason.EPIPOLAR, Reason.OK))
    assert np.isnan(culled.column[wrong]).all()
    assert np.isnan(culled.row[wrong]).all()
    np.testing.assert_array_equal(culled.row[~wrong], row[~wrong])


def test_the_tolerance_is_in_projector_pixels(calibration, exact):
    distance = np.abs(epipolar_distance(calibration, Correspondence(exact.column, exact.row + 2.0, exact.reason)))
    assert 1.5 < distance.min() < distance.max() < 2.2  # the lines lean a little, so not the whole shift counts
    for tolerance in (1.6, 1.9):
        culled = cull_epipolar(calibration, Correspondence(exact.column, exact.row + 2.0, exact.reason), tolerance)
        np.testing.assert_array_equal(culled.reason == Reason.EPIPOLAR, distance > tolerance)


def test_errors_along_the_epipolar_line_survive(calibration, exact):
    """The limit of the constraint, and why the depth map has other gates."""
    z = plane_depth(calibration.camera, TILTED, 20.0)
    z[12:15, 40:44] -= 35.0
    moved = seen_from(calibration, z)
    assert np.abs(moved.column - exact.column).max() > 5.0
    assert (cull_epipolar(calibration, moved).reason == Reason.OK).all()


def test_missing_pixels_keep_their_reasons(calibration, exact):
    reason = exact.reason.copy()
    reason[:5] = Reason.SHADOW
    column = np.where(reason == 0, exact.column, np.nan)
    culled = cull_epipolar(calibration, Correspondence(column, np.where(reason == 0, exact.row, np.nan), reason))
    np.testing.assert_array_equal(culled.reason, reason)
    assert np.isnan(epipolar_distance(calibration, culled)[:5]).all()


def test_bad_input_is_named(calibration, exact):
    with pytest.raises(InputError, match=r"`tolerance_px` must be positive \[projector px\], got 0"):
        cull_epipolar(calibration, exact, 0.0)
    small = Correspondence(exact.column[1:], exact.row[1:], exact.reason[1:])
    with pytest.raises(InputError, match=r"`correspondence` must have the calibrated camera's shape \(72, 96\)"):
        cull_epipolar(calibration, small)

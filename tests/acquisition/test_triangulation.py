from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from deskew import pipeline
from deskew.acquisition import require_same_devices
from deskew.acquisition.epipolar import cull_epipolar
from deskew.acquisition.triangulation import triangulate
from deskew.errors import InputError
from deskew.projection import centre, pixel_grid, project, rays, undistort
from deskew.types import Capture, Correspondence, PatternKind, Reason
from tests.acquisition.stripe_scenes import bench, plane_depth, seen_from


def bumpy(calibration):
    z = plane_depth(calibration.camera, np.array([0.3, 0.2, 1.0]), 30.0)
    return z + 10 * np.sin(np.arange(z.shape[1]) / 5) * np.cos(np.arange(z.shape[0])[:, None] / 7)


@pytest.mark.parametrize("distorted", [True, False])
def test_known_depths_are_recovered(distorted):
    calibration = bench(distorted=distorted)
    z = bumpy(calibration)
    np.testing.assert_allclose(triangulate(calibration, seen_from(calibration, z)), z, atol=1e-6)


def test_opencv_triangulates_the_same_points():
    calibration = bench()
    camera, projector = calibration.camera, calibration.projector
    seen = seen_from(calibration, bumpy(calibration))
    ours = centre(camera) + triangulate(calibration, seen)[..., None] * rays(camera, pixel_grid(camera.size))
    directions = [undistort(camera, pixel_grid(camera.size)), undistort(projector, np.dstack([seen.column, seen.row]))]
    poses = [np.column_stack([device.R, device.t]) for device in (camera, projector)]
    theirs = cv2.triangulatePoints(*poses, *(d.reshape(-1, 2).T for d in directions))
    np.testing.assert_allclose(ours.reshape(-1, 3), (theirs[:3] / theirs[3]).T, atol=1e-6)


def test_noisy_points_get_the_depth_of_least_reprojection_error():
    calibration = bench(distorted=False)
    camera, projector = calibration.camera, calibration.projector
    seen = seen_from(calibration, bumpy(calibration))
    rng = np.random.default_rng(4)
    noisy = Correspondence(
        seen.column + rng.normal(0, 1.5, seen.row.shape), seen.row + rng.normal(0, 1.5, seen.row.shape), seen.reason
    )
    z = triangulate(calibration, noisy)
    origin, directions = centre(camera), rays(camera, pixel_grid(camera.size))
    for y, x in rng.integers(0, (72, 96), (12, 2)):
        target = np.array([noisy.column[y, x], noisy.row[y, x]])

        def squared_error(depth, ray=directions[y, x], target=target):
            return float(((project(projector, (origin + depth * ray)[None])[0] - target) ** 2).sum())

        best = minimize_scalar(squared_error, bounds=(600, 900), method="bounded", options={"xatol": 1e-8})
        assert z[y, x] == pytest.approx(best.x, abs=1e-4)


def test_missing_pixels_and_rays_that_part_have_no_depth():
    calibration = bench()
    seen = seen_from(calibration, bumpy(calibration))
    column, row, reason = seen.column.copy(), seen.row.copy(), seen.reason.copy()
    column[:3], row[:3], reason[:3] = np.nan, np.nan, Reason.WEAK
    # A point that moves left by far has rays that meet behind the camera.
    column[-3:] -= 2500.0
    z = triangulate(calibration, Correspondence(column, row, reason))
    assert np.isnan(z[:3]).all()
    assert not (z[-3:] > 0).any()
    assert np.isfinite(z[3:-3]).all()


def test_nothing_decoded_gives_nothing():
    nothing = np.full((72, 96), np.nan)
    z = triangulate(bench(), Correspondence(nothing, nothing, np.full((72, 96), Reason.SHADOW, np.uint8)))
    assert np.isnan(z).all()


def test_devices_in_one_place_give_no_depth_and_no_warning():
    calibration = bench()
    here = replace(calibration.camera, R=np.eye(3), t=np.zeros(3))
    calibration = replace(calibration, camera=here, projector=here)
    x, y = np.moveaxis(pixel_grid(calibration.camera.size), -1, 0)
    seen = Correspondence(x, y, np.zeros(x.shape, np.uint8))
    assert np.isnan(triangulate(calibration, seen)).all()
    assert (cull_epipolar(calibration, seen).reason == Reason.EPIPOLAR).all()


@pytest.mark.parametrize("reason", [np.uint8(8), np.int8(-1), np.float64(0)])
def test_reasons_without_a_meaning_are_refused(reason):
    with pytest.raises(InputError, match=r"`reason` must hold whole numbers in \[0, 7\]"):
        Correspondence(np.full((2, 3), np.nan), np.full((2, 3), np.nan), np.full((2, 3), reason))


def test_a_capture_of_other_devices_is_named_with_both_sizes():
    calibration = bench()
    width, height = calibration.camera.size
    image = np.zeros((height, width), np.uint8)
    capture = Capture(image, image, (2, 2), PatternKind.GRAY_CODE, [image] * 2, [image] * 2)
    with pytest.raises(
        InputError, match=r"`capture.projector_size` must equal calibration.projector.size .*, got \(2, 2"
    ):
        pipeline.scan(capture, calibration)
    with pytest.raises(InputError, match=r"`capture.camera_size` must equal calibration.camera.size"):
        require_same_devices(replace(calibration, camera=replace(calibration.camera, size=(3, 3))), capture)

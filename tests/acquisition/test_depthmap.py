from dataclasses import replace

import numpy as np
import pytest

from deskew.acquisition.depthmap import DepthSettings, depth_map
from deskew.acquisition.triangulation import triangulate
from deskew.errors import InputError, StepError
from deskew.projection import ideal, pixel_grid, undistort
from deskew.types import Correspondence, Reason
from tests.acquisition.stripe_scenes import bench, plane_depth, seen_from

FLAT, TILTED = np.array([0.0, 0.0, 1.0]), np.array([0.25, -0.15, 1.0])
INNER = np.s_[4:-4, 4:-4]  # clear of where the lens leaves the grid without raw pixels
# One pixel of this small camera spans 3 mm of the bed: slopes look ten times steeper than to a real one.
COARSE = DepthSettings(neighbour_mm=6.0, jump_mm=9.0)


def with_pixels(correspondence, **changes):
    column, row, reason = correspondence.column.copy(), correspondence.row.copy(), correspondence.reason.copy()
    for index, why in changes.values():
        reason[index], column[index], row[index] = why, np.nan, np.nan
    return Correspondence(column, row, reason)


@pytest.mark.parametrize("distorted", [True, False])
def test_a_plane_comes_out_on_the_undistorted_grid_without_bias(distorted):
    calibration = bench(distorted=distorted)
    depth = depth_map(calibration, seen_from(calibration, plane_depth(calibration.camera, TILTED, 60.0)), COARSE)
    truth = plane_depth(ideal(calibration.camera), TILTED, 60.0)
    assert (depth.reason[INNER] == Reason.OK).all()
    # Half a pixel would be 0.4 mm here; what is left is the lens's bend within a pixel.
    assert np.nanmax(np.abs(depth.z - truth)) < 2e-3
    assert abs(np.nanmean(depth.z - truth)) < 1e-4
    np.testing.assert_array_equal(depth.camera.distortion, 0)
    np.testing.assert_array_equal(depth.camera.K, calibration.camera.K)


def test_without_distortion_the_grid_is_the_raw_one():
    calibration = bench(distorted=False)
    seen = seen_from(calibration, plane_depth(calibration.camera, TILTED, 60.0))
    depth = depth_map(calibration, seen, COARSE)
    np.testing.assert_allclose(depth.z, triangulate(calibration, seen), atol=1e-6)


@pytest.mark.parametrize("distorted", [True, False])
def test_a_step_is_not_bridged(distorted):
    calibration = bench(distorted=distorted)
    camera = calibration.camera
    low, high = plane_depth(camera, FLAT, 0.0), plane_depth(camera, FLAT, 25.0)
    left = np.arange(camera.size[0]) < 50
    depth = depth_map(calibration, seen_from(calibration, np.where(left, low, high)))
    planes = [plane_depth(ideal(camera), FLAT, offset) for offset in (0.0, 25.0)]
    found = np.isfinite(depth.z)
    off = np.minimum(*(np.abs(depth.z - plane) for plane in planes))
    assert off[found].max() < 1e-3
    if distorted:
        holes = ~found[INNER]
        assert 40 < holes.sum() < 3 * 72
        assert (depth.reason[INNER][holes] == Reason.EDGE).all()
    else:
        assert found.all()


def test_a_page_corner_over_the_bed_keeps_its_pixels():
    calibration = bench(distorted=False)
    camera = calibration.camera
    page = np.zeros((72, 96), bool)
    page[20:50, 30:70] = True
    z = np.where(page, plane_depth(camera, FLAT, 20.0), plane_depth(camera, FLAT, 0.0))
    depth = depth_map(calibration, seen_from(calibration, z))
    assert (depth.reason[page] == Reason.OK).all()


def test_pixels_off_by_an_error_along_the_epipolar_line_are_dropped_as_edges():
    calibration = bench(distorted=False)
    z = plane_depth(calibration.camera, FLAT, 20.0)
    wild = np.zeros(z.shape, bool)
    wild[[10, 30, 30, 50], [20, 40, 41, 70]] = True
    z[wild] -= 40.0
    depth = depth_map(calibration, seen_from(calibration, z))
    np.testing.assert_array_equal(depth.reason, np.where(wild, Reason.EDGE, Reason.OK))


def test_the_working_volume_is_measured_above_the_bed():
    calibration = bench(distorted=False)
    z = plane_depth(calibration.camera, np.array([-1.0, 0.0, 1.0]), 70.0)  # heights 70 + X, from -70 to 210
    depth = depth_map(calibration, seen_from(calibration, z), replace(COARSE, z_min_mm=-20.0, z_max_mm=120.0))
    x, y = np.moveaxis(undistort(calibration.camera, pixel_grid(calibration.camera.size)), -1, 0)
    camera = calibration.camera
    height = (np.dstack([x, y, np.ones_like(x)]) * z[..., None] - camera.t) @ camera.R[:, 2]
    outside = (height < -20) | (height > 120)
    assert 0.1 < outside.mean() < 0.6
    np.testing.assert_array_equal(depth.reason == Reason.RANGE, outside)


@pytest.mark.parametrize("why", [Reason.SHADOW, Reason.SATURATED, Reason.WEAK, Reason.TWO_PEAKS, Reason.EPIPOLAR])
def test_a_hole_keeps_the_reason_it_came_with(why):
    calibration = bench()
    seen = seen_from(calibration, plane_depth(calibration.camera, FLAT, 20.0))
    depth = depth_map(calibration, with_pixels(seen, hole=(np.s_[30:42, 40:56], why)))
    assert (depth.reason[32:40, 42:54] == why).all()
    inner = depth.reason[INNER]
    assert set(np.unique(inner)) == {int(Reason.OK), int(why)}
    # The hole grows by less than a pixel on each side.
    assert 12 * 16 * 0.8 < (inner == why).sum() < 14 * 18


def test_a_single_missing_pixel_leaves_the_triangles_around_it():
    calibration = bench()
    z = plane_depth(calibration.camera, TILTED, 60.0)
    seen = seen_from(calibration, z)
    whole, holed = (depth_map(calibration, c, COARSE) for c in (seen, with_pixels(seen, h=((36, 60), Reason.WEAK))))
    lost = (whole.reason == Reason.OK) & (holed.reason != Reason.OK)
    assert 1 <= lost.sum() <= 3
    assert (holed.reason[lost] == Reason.WEAK).all()
    truth = plane_depth(ideal(calibration.camera), TILTED, 60.0)
    assert np.nanmax(np.abs(holed.z - truth)) < 3e-3


def test_an_inconsistent_row_is_epipolar():
    calibration = bench(distorted=False)
    seen = seen_from(calibration, plane_depth(calibration.camera, FLAT, 20.0))
    row = seen.row.copy()
    row[20:25, 30:35] += 6.0
    depth = depth_map(calibration, Correspondence(seen.column, row, seen.reason))
    wrong = np.zeros(row.shape, bool)
    wrong[20:25, 30:35] = True
    np.testing.assert_array_equal(depth.reason, np.where(wrong, Reason.EPIPOLAR, Reason.OK))


def test_nothing_left_is_a_failed_step_with_counts_and_a_remedy():
    calibration = bench()
    nothing = np.full((72, 96), np.nan)
    empty = Correspondence(nothing, nothing, np.full((72, 96), Reason.SHADOW, np.uint8))
    with pytest.raises(StepError, match=r"no pixel left \(\{'SHADOW': 6912\}\): check that the calibration"):
        depth_map(calibration, empty)
    far = seen_from(calibration, plane_depth(calibration.camera, FLAT, 250.0))
    with pytest.raises(StepError, match=r"'RANGE': 6912.*between -10.0 and 150.0 mm above the bed"):
        depth_map(calibration, far)


def test_a_capture_of_another_camera_is_refused():
    calibration = bench()
    nothing = np.full((10, 96), np.nan)
    with pytest.raises(InputError, match=r"`correspondence` must have the calibrated camera's shape \(72, 96\)"):
        depth_map(calibration, Correspondence(nothing, nothing, np.zeros((10, 96), np.uint8)))


@pytest.mark.parametrize(
    "wrong",
    [{"epipolar_tolerance_px": 0.0}, {"neighbour_mm": -1.0}, {"jump_mm": 0.0}, {"support": 1.0}, {"z_min_mm": 150.0}],
)
def test_settings_out_of_range_are_refused_by_name(wrong):
    with pytest.raises(InputError, match=f"`{next(iter(wrong))}` must"):
        DepthSettings(**wrong)

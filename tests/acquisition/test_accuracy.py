import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from deskew.acquisition.accuracy import (
    PlaneDeviation,
    average_deviation,
    depth_points,
    fit_plane,
    length_errors,
    plane_deviation,
)
from deskew.errors import InputError, StepError
from deskew.projection import ideal
from deskew.types import DepthMap, Reason
from tests.acquisition.stripe_scenes import bench, plane_depth


def checkered_sheet(height):
    """A grid whose points stand alternately above and below z = 0, so that z = 0 stays its best plane."""
    y, x = np.mgrid[0:12, 0:16]
    return np.stack([10.0 * x, 10.0 * y, height * (-1.0) ** (x + y)], axis=-1).reshape(-1, 3)


def test_alternating_heights_have_the_closed_form_deviation():
    deviation = plane_deviation(checkered_sheet(0.3))
    np.testing.assert_allclose([deviation.mean_abs_mm, deviation.rms_mm, deviation.max_mm], 0.3, rtol=1e-9)
    assert deviation.n == 192


def test_gaussian_noise_has_mean_deviation_sqrt_2_over_pi_of_its_rms():
    rng = np.random.default_rng(1)
    points = np.column_stack([rng.uniform(0, 200, (20000, 2)), rng.normal(0, 0.1, 20000)])
    deviation = plane_deviation(points)
    assert 0.098 < deviation.rms_mm < 0.102
    assert 0.99 < deviation.mean_abs_mm / (np.sqrt(2 / np.pi) * deviation.rms_mm) < 1.01


@given(st.integers(0, 10_000), st.lists(st.floats(-500, 500), min_size=3, max_size=3))
@settings(deadline=None)
def test_deviation_ignores_rotation_and_translation(seed, shift):
    rng = np.random.default_rng(seed)
    points = checkered_sheet(0.2) + rng.normal(0, 0.1, (192, 3))
    R = Rotation.random(rng=rng).as_matrix()
    a, b = plane_deviation(points), plane_deviation(points @ R.T + shift)
    np.testing.assert_allclose(
        (b.mean_abs_mm, b.rms_mm, b.max_mm), (a.mean_abs_mm, a.rms_mm, a.max_mm), rtol=1e-6, atol=1e-9
    )


@given(st.integers(0, 10_000))
@settings(deadline=None)
def test_no_nearby_plane_fits_better(seed):
    rng = np.random.default_rng(seed)
    points = rng.normal(0, 1, (40, 3)) * [50, 30, 1] + rng.uniform(-100, 100, 3)
    normal, offset = fit_plane(points)
    best = ((points @ normal - offset) ** 2).sum()
    for _ in range(5):
        other = normal + rng.normal(0, 0.02, 3)
        other /= np.linalg.norm(other)
        assert ((points @ other - (points @ other).mean()) ** 2).sum() >= best - 1e-9
    assert np.linalg.norm(normal) == pytest.approx(1)
    assert normal[np.argmax(np.abs(normal))] > 0


def test_a_steep_plane_is_found_exactly():
    rng = np.random.default_rng(0)
    true = np.array([2.0, 1.0, 0.1]) / np.linalg.norm([2.0, 1.0, 0.1])
    points = rng.uniform(-100, 100, (50, 3))
    points -= np.outer(points @ true - 7.5, true)
    normal, offset = fit_plane(points)
    np.testing.assert_allclose(normal, true, atol=1e-9)
    assert offset == pytest.approx(7.5)


def test_the_average_counts_each_plane_once():
    average = average_deviation([PlaneDeviation(0.1, 0.2, 0.5, 1000), PlaneDeviation(0.3, 0.4, 0.9, 10)])
    assert (average.mean_abs_mm, average.max_mm, average.n) == (pytest.approx(0.2), 0.9, 1010)
    assert average.rms_mm == pytest.approx(0.3)
    with pytest.raises(InputError, match="`planes` must hold at least 1 deviation"):
        average_deviation([])


def test_lengths_see_the_scale_error_that_the_plane_does_not():
    known = checkered_sheet(0.0)
    measured = known * 1.01 + 40.0
    assert plane_deviation(measured).rms_mm < 1e-9
    errors = length_errors(measured, known, min_length=150.0)
    assert 1.499 < errors.min() < errors.max() == pytest.approx(0.01 * np.hypot(150, 110))


def test_lengths_skip_lost_points_and_count_every_pair():
    known = np.array([[0.0, 0, 0], [3, 0, 0], [0, 4, 0], [9, 9, 9]])
    measured = known.copy()
    measured[3] = np.nan
    measured[1, 0] = 3.5
    np.testing.assert_allclose(length_errors(measured, known), [0.5, 0, np.hypot(3.5, 4) - 5])
    with pytest.raises(StepError, match=r"no pair of known points at least 6 apart among 3 found"):
        length_errors(measured, known, 6)
    with pytest.raises(InputError, match="`measured` must hold 4 points"):
        length_errors(measured[:3], known)


def depth_of(z):
    camera = ideal(bench().camera)
    return DepthMap(z, np.where(np.isfinite(z), Reason.OK, Reason.SHADOW).astype(np.uint8), camera)


def test_depth_points_of_a_plane_lie_on_it_in_the_world():
    normal = np.array([0.2, -0.1, 1.0])
    z = plane_depth(ideal(bench().camera), normal, 20.0)
    z[:10] = np.nan
    points = depth_points(depth_of(z))
    assert points.shape == (62 * 96, 3)
    np.testing.assert_allclose(points @ normal, 20.0, atol=1e-9)


def test_depth_points_of_a_mask_are_those_of_its_pixels():
    z = plane_depth(ideal(bench().camera), np.array([0.0, 0.1, 1.0]), 5.0)
    mask = np.zeros(z.shape, bool)
    mask[7, 9] = mask[30, 50] = True
    both = depth_points(depth_of(z), mask)
    np.testing.assert_array_equal(both, depth_points(depth_of(z)).reshape(72, 96, 3)[mask])


def test_empty_and_wrong_inputs_are_named():
    z = plane_depth(ideal(bench().camera), np.array([0.0, 0.0, 1.0]), 5.0)
    with pytest.raises(InputError, match="`mask` must select at least 1 pixel, got an empty mask"):
        depth_points(depth_of(z), np.zeros(z.shape, bool))
    with pytest.raises(InputError, match=r"`mask` must have the depth map's shape \(72, 96\)"):
        depth_points(depth_of(z), np.ones((3, 3), bool))
    with pytest.raises(StepError, match="depth_points found no wanted pixel with a depth"):
        depth_points(depth_of(np.full_like(z, np.nan)))
    for points, message in (
        (np.zeros((2, 3)), r"have shape \(N, 3\) with N >= 3, got \(2, 3\)"),
        (np.zeros((5, 2)), r"have shape \(N, 3\) with N >= 3, got \(5, 2\)"),
        (np.full((5, 3), np.nan), "be finite, got 5 points with NaN or infinity"),
        (np.outer(np.arange(5.0), [1, 2, 3]), "span a plane, got points on one line"),
    ):
        with pytest.raises(InputError, match=f"`points` must {message}"):
            fit_plane(points)

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from deskew.acquisition.denoise import DenoiseSettings, denoise_depth, depth_noise
from deskew.errors import InputError
from deskew.types import DepthMap, Pinhole, Reason

# Window centres lie up to 4 px apart: on 4 n + 1 pixels their lattice is its own mirror image.
HEIGHT, WIDTH = 121, 161
FOCAL, DISTANCE = 1700.0, 800.0  # the bench's: a pixel spans .47 mm
INNER = np.s_[8:-8, 8:-8]
Y, X = (axis.astype(np.float64) for axis in np.mgrid[:HEIGHT, :WIDTH])
PX_MM = DISTANCE / FOCAL


def depth_of(z):
    height, width = z.shape
    K = np.array([[FOCAL, 0, (width - 1) / 2], [0, FOCAL, (height - 1) / 2], [0, 0, 1]])
    camera = Pinhole((width, height), K, np.zeros(5), np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, DISTANCE]))
    return DepthMap(z, np.where(np.isfinite(z), Reason.OK, Reason.WEAK).astype(np.uint8), camera)


def plane(slope_x, slope_y, z=DISTANCE):
    """Camera z of the plane through (0, 0, z) that rises by the slopes [mm/mm]."""
    return z / (1 - slope_x * (X - (WIDTH - 1) / 2) / FOCAL - slope_y * (Y - (HEIGHT - 1) / 2) / FOCAL)


def fold(turn_deg, azimuth=0.4):
    """Two planes that meet on a sharp ridge through the middle, and each pixel's distance from it [px]."""
    slope = np.tan(np.radians(turn_deg) / 2)
    cx, cy = np.cos(azimuth), np.sin(azimuth)
    across = (X - (WIDTH - 1) / 2) * cx + (Y - (HEIGHT - 1) / 2) * cy
    return np.maximum(plane(slope * cx, slope * cy), plane(-slope * cx, -slope * cy)), np.abs(across)


def noise(sigma, seed=0):
    return np.random.default_rng(seed).normal(0.0, 1.0, (HEIGHT, WIDTH)) * sigma


def rms(values):
    return float(np.sqrt(np.nanmean(values**2)))


@given(st.floats(-0.6, 0.6), st.floats(-0.6, 0.6), st.floats(300.0, 2000.0))
@settings(max_examples=15, deadline=None)
def test_planes_come_back_as_they_are(slope_x, slope_y, z):
    true = plane(slope_x, slope_y, z)
    np.testing.assert_allclose(denoise_depth(depth_of(true)).z, true, rtol=1e-9)


def test_noise_on_a_plane_falls_as_the_windows_promise():
    true = plane(0.2, -0.1)
    off = denoise_depth(depth_of(true + noise(0.1))).z - true
    # The best that a plane in 15 x 15 pixels can do is 1 / 15; where windows overlap, their mean is a little wider.
    assert 0.1 / 20 < rms(off[INNER]) < 0.1 / 8
    assert abs(off[INNER].mean()) < 0.1 / 40


@pytest.mark.parametrize("turn_deg", [20.0, 30.0, 40.0])
def test_a_sharp_fold_is_kept_while_the_noise_falls(turn_deg):
    true, distance = fold(turn_deg)
    noisy = true + noise(0.05)
    off = denoise_depth(depth_of(noisy)).z - true
    ridge, beside = distance <= 1.0, (distance > 6) & (distance < 20)
    # A 3 x 3 mean alone cuts such a ridge by .05 to .1 mm.
    assert abs(off[INNER][ridge[INNER]].mean()) < 0.05
    assert 0.0 < rms(off[INNER][ridge[INNER]]) < 0.06
    assert 0.05 / 20 < rms(off[INNER][beside[INNER]]) < 0.05 / 4


@pytest.mark.parametrize("sigma", [0.02, 0.1])
def test_a_fold_of_10_mm_radius_is_not_rounded(sigma):
    across = ((X - (WIDTH - 1) / 2) * np.cos(0.4) + (Y - (HEIGHT - 1) / 2) * np.sin(0.4)) * PX_MM
    half = 10.0 * np.sin(np.radians(15.0))
    arc = 10.0 - np.sqrt(100.0 - np.clip(across, -half, half) ** 2)
    true = DISTANCE + arc + np.tan(np.radians(15.0)) * np.maximum(np.abs(across) - half, 0.0)
    off = np.mean([denoise_depth(depth_of(true + noise(sigma, seed))).z - true for seed in range(3)], axis=0)
    strips = np.round(across[INNER] / 0.25).astype(int)
    rounded = [abs(off[INNER][strips == k].mean()) for k in range(-20, 21)]
    assert 0.0 < max(rounded) < 0.05


def test_a_step_is_not_smeared():
    true = np.where(X < 80.5, DISTANCE, DISTANCE - 2.0)
    off = denoise_depth(depth_of(true + noise(0.05))).z - true
    beside = np.abs(X - 80.5) < 4
    assert 0.0 < rms(off[beside]) < 0.05
    assert np.abs(off).max() < 0.25  # a mean across the step is off by a millimetre


@pytest.mark.parametrize("turn_deg", [30.0, 40.0])
def test_no_plane_is_carried_from_white_paper_across_a_crease_in_ink(turn_deg):
    """A pixel of ink beyond the crease may be off by its noise; nine of them may not."""
    slope = np.tan(np.radians(turn_deg) / 2)
    true = np.maximum(plane(slope, 0.0), plane(-slope, 0.0))
    level = np.where(X < (WIDTH - 1) / 2 - 3, 0.02, 0.3)
    off = np.stack([denoise_depth(depth_of(true + noise(level, seed))).z - true for seed in range(3)])[:, 8:-8, 8:-8]
    assert 0.02 < np.abs(off.mean(axis=1)).max() < 0.25  # of a column
    assert 0.1 < np.abs(off).max() < 0.6


def test_a_facet_narrower_than_every_window_but_one_is_kept():
    steps = np.select([X < 78, X < 82], [0.15, -0.18], 0.2)
    true = DISTANCE + np.cumsum(steps, axis=1) - 12.0
    off = denoise_depth(depth_of(true + noise(0.02))).z - true
    assert 0.005 < np.abs(off[INNER]).max() < 0.04


def test_missing_pixels_stay_missing_for_the_same_reason():
    z = plane(0.1, 0.3) + noise(0.05)
    z[40:60, 30:80] = np.nan
    z[np.random.default_rng(1).random(z.shape) < 0.1] = np.nan
    given_depth = depth_of(z)
    found = denoise_depth(given_depth)
    np.testing.assert_array_equal(np.isnan(found.z), np.isnan(z))
    np.testing.assert_array_equal(found.reason, given_depth.reason)
    assert 0.05 / 20 < rms(found.z - plane(0.1, 0.3)) < 0.05 / 4


def test_a_wild_pixel_is_brought_back():
    true = plane(0.1, 0.0)
    noisy = true + noise(0.02)
    noisy[60, 80] += 3.0
    assert abs(denoise_depth(depth_of(noisy)).z[60, 80] - true[60, 80]) < 0.05


def test_lone_pixels_and_empty_maps_pass():
    z = np.full((HEIGHT, WIDTH), np.nan)
    assert np.isnan(denoise_depth(depth_of(z)).z).all()
    z[20, 30], z[50, 100:103] = 790.0, 800.0
    np.testing.assert_allclose(denoise_depth(depth_of(z)).z, z, atol=1e-9)


@pytest.mark.parametrize("radius_px", [2, 3, 4])
@pytest.mark.parametrize("sigma", [0.01, 0.3])
def test_the_noise_level_is_found_where_it_differs(sigma, radius_px):
    level = np.where(X < 80, sigma, 5 * sigma)
    found = depth_noise(depth_of(fold(30.0)[0] + noise(level)), DenoiseSettings(noise_radius_px=radius_px))
    for part, expected in ((np.s_[:, :70], sigma), (np.s_[:, 90:], 5 * sigma)):
        assert np.median(found[part]) == pytest.approx(expected, rel=0.1)


def test_quiet_pixels_lead_noisy_ones():
    """Black squares ten times as noisy as the white ones around them, as print makes them."""
    black = ((X // 12 + Y // 12) % 2).astype(bool)
    true = plane(0.15, 0.1)
    noisy = true + noise(np.where(black, 0.3, 0.03))
    off = denoise_depth(depth_of(noisy)).z - true
    assert 0.001 < rms(off[INNER][black[INNER]]) < 0.3 / 10


@given(st.floats(-3e-7, 3e-7), st.floats(-3e-7, 3e-7), st.integers(0, 5))
@settings(max_examples=10, deadline=None)
def test_a_plane_added_to_the_inverse_depth_is_added_to_the_result(slope_x, slope_y, seed):
    inverse = 1.0 / (fold(30.0)[0] + noise(0.05, seed))
    added = slope_x * (X - 60.0) + slope_y * (Y - 50.0)
    here, there = (1.0 / denoise_depth(depth_of(1.0 / f)).z for f in (inverse, inverse + added))
    np.testing.assert_allclose(there, here + added, rtol=0, atol=1e-6 / DISTANCE**2)


@pytest.mark.parametrize("mirror", [np.fliplr, np.flipud, lambda z: np.rot90(z, 2), np.transpose])
def test_the_mirrored_map_gives_the_mirrored_result(mirror):
    z = fold(35.0)[0] + noise(0.05)
    z[30:35, 40:60] = np.nan
    mirrored = denoise_depth(depth_of(np.ascontiguousarray(mirror(z)))).z
    np.testing.assert_allclose(mirrored, mirror(denoise_depth(depth_of(z)).z), rtol=0, atol=1e-7)


def bent():
    return DISTANCE - 4.0 * np.sin(X / 25.0) * np.cos(Y / 31.0)


# Uneven curvature reads as a little noise, so that a bent map is known to 1e-4 mm only.
@pytest.mark.parametrize(
    ("true", "most"),
    [(fold(40.0)[0], 3e-6), (np.where(X < 80.5, 800.0, 798.0), 3e-6), (bent(), 1e-4)],
    ids=["fold", "step", "bent"],
)
def test_changes_vanish_with_the_noise(true, most):
    changes = [rms(denoise_depth(depth_of(true + noise(sigma))).z - true) for sigma in (1e-1, 1e-2, 1e-6)]
    assert 0.1 / 20 < changes[0] < 0.1 / 2
    assert changes[0] > changes[1] > changes[2]
    assert changes[2] < most


def test_a_noiseless_fold_comes_back_exactly():
    true = fold(40.0)[0]
    np.testing.assert_allclose(denoise_depth(depth_of(true)).z, true, rtol=0, atol=1e-6)


def test_folds_survive_better_than_under_a_gaussian_of_the_same_strength():
    true, distance = fold(30.0)
    noisy = true + noise(0.05)
    ridge = (distance <= 1.0)[INNER]
    ours, theirs = denoise_depth(depth_of(noisy)).z - true, cv2.GaussianBlur(noisy, (0, 0), 2.0) - true
    assert rms(ours[INNER][ridge]) < rms(theirs[INNER][ridge]) / 3


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("radii_px", ()),
        ("radii_px", (1,)),
        ("radii_px", (7, 16)),
        ("radii_px", (2.5,)),
        ("n_reweightings", -1),
        ("n_reweightings", 21),
        ("noise_radius_px", 1),
        ("noise_radius_px", 5),
    ],
)
def test_settings_out_of_range_are_refused_by_name(name, value):
    with pytest.raises(InputError, match=f"`{name}` must"):
        DenoiseSettings(**{name: value})


def test_depth_behind_the_camera_is_refused():
    z = plane(0.0, 0.0)
    z[5, 5] = -1.0
    with pytest.raises(InputError, match="`depth` must lie before the camera"):
        denoise_depth(depth_of(z))

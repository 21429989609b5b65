"""Scenes whose footprints are summed by brute force: the formula under test is nowhere in them."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter
from scipy.special import ndtr

from deskew.acquisition import GrayCodeSettings, SweepSettings, decode_gray, decode_sweep
from deskew.acquisition.ink import InkSettings, correct_ink, footprint_shift, noise_variance
from deskew.errors import InputError, StepError
from deskew.types import Capture, Correspondence, PatternKind, Reason
from tests.acquisition.stripe_scenes import bench, digitise

SIZE, PROJECTOR = (56, 44), (96, 80)
SUB, MARGIN = 5, 4
LENS_PX = 0.75
FOOTPRINT_PX = float(np.hypot(LENS_PX, np.sqrt(1 / 12)))
STRIPE = 0.67  # standard deviation of a projected line [projector px]
SLOPES = (1.35, -0.12), (0.1, 1.42)  # of column and row, along x and y
CALIBRATION = replace(bench(), camera_psf_px=FOOTPRINT_PX)
INNER = np.s_[4:-4, 4:-4]


def fine_grid():
    """Places (x, y) of the sub-samples, with a margin for the lens."""
    place = ((np.arange((n + 2 * MARGIN) * SUB) + 0.5) / SUB - 0.5 - MARGIN for n in SIZE)
    return np.meshgrid(*place)


def plane(x, y, slopes, extent):
    return extent / 2 + slopes[0] * (x - SIZE[0] / 2) + slopes[1] * (y - SIZE[1] / 2)


def seen(fine):
    """Pixels of a picture given by its sub-samples: the lens, then the mean over a pixel's area."""
    blurred = gaussian_filter(fine, LENS_PX * SUB, truncate=5.0)
    height, width = SIZE[1] + 2 * MARGIN, SIZE[0] + 2 * MARGIN
    return blurred.reshape(height, SUB, width, SUB).mean(axis=(1, 3))[MARGIN:-MARGIN, MARGIN:-MARGIN]


@dataclass
class LitFrames:
    """Each frame shows the albedo under a pattern of the projector's coordinate."""

    patterns: list
    coordinate: np.ndarray
    albedo: np.ndarray
    light: float
    noise: float
    seed: int
    dtype: type

    def __len__(self):
        return len(self.patterns)

    def __iter__(self):
        rng = np.random.default_rng(self.seed)
        for pattern in self.patterns:
            yield shot(self.light * seen(self.albedo * pattern(self.coordinate)), self.noise, rng, self.dtype)


def shot(grey, noise, rng, dtype):
    level = 10.0 * np.iinfo(dtype).max / 255
    return digitise(level + grey + rng.normal(0, noise, grey.shape) if noise else level + grey, dtype)


def line(k):
    return lambda c: np.exp(-0.5 * ((c - k) / STRIPE) ** 2)


def gray_planes(extent):
    """Bit planes and their inverses under a projector's blur, as functions of its coordinate."""
    index = np.arange(extent)
    code = index ^ (index >> 1)
    for bit in range((extent - 1).bit_length() - 1, -1, -1):
        for on in (code >> bit & 1, 1 - (code >> bit & 1)):
            steps = np.diff(np.concatenate([[0], on, [0]]))
            borders = np.flatnonzero(steps)
            yield lambda c, b=borders, s=steps: sum(s[i] * ndtr((c - i + 0.5) / STRIPE) for i in b)


def inked(albedo, pattern=PatternKind.LINE_SWEEP, noise=0.0, seed=0, dtype=np.uint16):
    """A capture of a plane with `albedo(x, y)` on it, and its true column and row at the pixels."""
    fine = fine_grid()
    paper = albedo(*fine)
    light = 0.8 * np.iinfo(dtype).max
    frames = []
    for i, extent in enumerate(PROJECTOR):
        lines = pattern is PatternKind.LINE_SWEEP
        patterns = [line(k) for k in range(extent)] if lines else list(gray_planes(extent))
        frames.append(LitFrames(patterns, plane(*fine, SLOPES[i], extent), paper, light, noise, seed + i, dtype))
    rng = np.random.default_rng([seed, 9])
    white, black = (shot(share * seen(paper), noise, rng, dtype) for share in (light, 0.0))
    pixels = np.meshgrid(*(np.arange(n, dtype=float) for n in SIZE))
    truth = [plane(*pixels, slopes, extent) for slopes, extent in zip(SLOPES, PROJECTOR, strict=True)]
    return Capture(white, black, PROJECTOR, pattern, *frames), *truth


def ramp(gx, gy):
    """Albedo that grows by e^gx per pixel of x and e^gy per pixel of y."""
    return lambda x, y: 0.3 * np.exp(gx * (x - SIZE[0] / 2) + gy * (y - SIZE[1] / 2))


def edges(x, y, dark=0.1, square=9.0):
    """Slanted squares of ink and paper."""
    u, v = (0.97 * x + 0.24 * y) / square, (0.97 * y - 0.24 * x) / square
    return np.where((np.floor(u) + np.floor(v)) % 2 == 0, 1.0, dark)


def errors(correspondence, column, row):
    """Of both coordinates, of pixels well inside the picture."""
    ok = (correspondence.reason == Reason.OK)[INNER]
    pairs = (correspondence.column, column), (correspondence.row, row)
    return np.concatenate([(got - true)[INNER][ok] for got, true in pairs])


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


@pytest.mark.parametrize(("gx", "gy"), [(0.05, 0.0), (0.0, 0.05), (-0.03, 0.04)])
def test_on_a_ramp_of_albedo_the_bias_is_the_formula_s(gx, gy):
    capture, column, row = inked(ramp(gx, gy))
    decoded = decode_sweep(capture)
    for got, true, slopes in ((decoded.column, column, SLOPES[0]), (decoded.row, row, SLOPES[1])):
        expected = FOOTPRINT_PX**2 * (slopes[0] * gx + slopes[1] * gy)
        assert np.median((got - true)[INNER]) == pytest.approx(expected, rel=0.02, abs=2e-4)
    shift = footprint_shift(capture.white, capture.black, FOOTPRINT_PX)[INNER]
    np.testing.assert_allclose(
        np.median(shift, axis=(0, 1)), FOOTPRINT_PX**2 * np.array([gx, gy]), rtol=0.01, atol=1e-4
    )
    assert rms(errors(correct_ink(CALIBRATION, decoded, capture), column, row)) < 0.05 * rms(
        errors(decoded, column, row)
    )


def test_per_pixel_more_than_four_fifths_of_the_bias_of_squares_of_ink_goes():
    capture, column, row = inked(edges)
    decoded = decode_sweep(capture)
    before, after = (errors(c, column, row) for c in (decoded, correct_ink(CALIBRATION, decoded, capture)))
    assert 0.1 < rms(before) < 0.6
    assert 0.0 < rms(after) < 0.2 * rms(before)
    assert np.abs(after).max() < 0.5 * np.abs(before).max()


@pytest.mark.parametrize(("gx", "gy"), [(0.05, 0.0), (0.0, 0.05), (-0.03, 0.04)])
def test_per_curve_the_bias_on_a_ramp_points_the_other_way_along_the_search(gx, gy):
    capture, column, row = inked(ramp(gx, gy))
    decoded = decode_sweep(capture, SweepSettings(mode="spatial"))
    (cx, cy), (rx, ry) = SLOPES
    own, line = FOOTPRINT_PX**2, STRIPE**2
    expected = own * cy * gy - gx * (line + own * cy**2) / cx, own * rx * gx - gy * (line + own * rx**2) / ry
    for got, true, bias in zip((decoded.column, decoded.row), (column, row), expected, strict=True):
        assert np.median((got - true)[INNER]) == pytest.approx(bias, rel=0.05, abs=1e-3)
    corrected = correct_ink(CALIBRATION, decoded, capture)
    assert rms(errors(corrected, column, row)) < 0.15 * rms(errors(decoded, column, row))


def test_per_curve_most_of_the_bias_goes_though_it_points_the_other_way():
    capture, column, row = inked(edges)
    decoded = decode_sweep(capture, SweepSettings(mode="spatial"))
    assert decoded.stripe_px == pytest.approx(
        (np.hypot(FOOTPRINT_PX, STRIPE / 1.35), np.hypot(FOOTPRINT_PX, STRIPE / 1.42)), rel=0.05
    )
    before, after = (errors(c, column, row) for c in (decoded, correct_ink(CALIBRATION, decoded, capture)))
    assert 0.05 < rms(before) < 0.3
    # A stripe is as wide as an edge is sharp, so the gradient changes under it: the first order is not all.
    assert 0.2 * rms(before) < rms(after) < 0.6 * rms(before)
    wrong = correct_ink(CALIBRATION, replace(decoded, stripe_px=None), capture)
    assert rms(errors(wrong, column, row)) > rms(before)


def test_a_gray_code_without_its_gate_is_corrected_too():
    capture, column, row = inked(edges, PatternKind.GRAY_CODE)
    gated, kept = (decode_gray(capture, GrayCodeSettings(ink_slope_max=limit)) for limit in (0.15, None))
    assert (kept.reason == Reason.OK).mean() > (gated.reason == Reason.OK).mean() + 0.2
    before, after = (errors(c, column, row) for c in (kept, correct_ink(CALIBRATION, kept, capture)))
    # Between borders three or four pixels apart coordinates are interpolated, corrected or not.
    assert 0.0 < rms(after) < 0.35 * rms(before)


@pytest.mark.parametrize("noise", [1.0, 2.0, 4.0])
@pytest.mark.parametrize("mode", ["temporal", "spatial"])
def test_noise_never_makes_the_corrected_worse(noise, mode):
    capture, column, row = inked(edges, noise=noise, seed=5, dtype=np.uint8)
    decoded = decode_sweep(capture, SweepSettings(mode=mode))
    before, after = (np.abs(errors(c, column, row)) for c in (decoded, correct_ink(CALIBRATION, decoded, capture)))
    assert len(before) > 1500
    assert rms(after) < rms(before)
    assert np.percentile(after, 95) < np.percentile(before, 95)
    assert 0.0 < np.percentile(after, 99.9) < 1.05 * np.percentile(before, 99.9)


@pytest.mark.parametrize("noise", [0.5, 2.0])
def test_blank_paper_stays_as_it_is(noise):
    capture, column, row = inked(lambda x, y: np.full_like(x, 0.9), noise=noise, seed=8, dtype=np.uint8)
    decoded = decode_sweep(capture)
    corrected = correct_ink(CALIBRATION, decoded, capture)
    assert rms(errors(corrected, column, row)) < 1.1 * rms(errors(decoded, column, row))
    # Trusting every gradient would change more: that is what the guard is for.
    bold = correct_ink(CALIBRATION, decoded, capture, InkSettings(noise_guard=0.0))
    change, bold_change = (rms((c.column - decoded.column)[INNER]) for c in (corrected, bold))
    assert 0.0 < change < 0.7 * bold_change


def test_only_coordinates_change():
    capture, _, _ = inked(edges, noise=3.0, dtype=np.uint8)
    decoded = decode_sweep(capture)
    lost = np.random.default_rng(1).random(decoded.column.shape) < 0.3
    holed = replace(
        decoded,
        column=np.where(lost, np.float32(np.nan), decoded.column),
        row=np.where(lost, np.float32(np.nan), decoded.row),
        reason=np.where(lost, np.uint8(Reason.WEAK), decoded.reason),
    )
    corrected = correct_ink(CALIBRATION, holed, capture)
    np.testing.assert_array_equal(corrected.reason, holed.reason)
    for after, before in ((corrected.column, holed.column), (corrected.row, holed.row)):
        np.testing.assert_array_equal(np.isnan(after), np.isnan(before))
        assert after.dtype == before.dtype


def test_beside_a_jump_the_slope_is_the_surface_s_own():
    """Ink ends where the surface does: a slope across the jump would move pixels by tens."""
    capture, column, row = inked(edges)
    far = np.arange(SIZE[0]) >= 30
    jumped = Correspondence(column + 40 * far, row, np.zeros(column.shape, np.uint8))
    corrected = correct_ink(CALIBRATION, jumped, capture)
    longest = InkSettings().shift_max * FOOTPRINT_PX * 1.5
    assert 0.1 < np.abs(corrected.column - jumped.column).max() < longest


def pictures(seed, shape=(24, 30)):
    rng = np.random.default_rng(seed)
    white = gaussian_filter(rng.uniform(20, 220, shape), 1.0) + 30
    return white, gaussian_filter(rng.uniform(2, 12, shape), 1.0)


@given(st.integers(0, 1000), st.floats(0.2, 3.0), st.floats(0.0, 30.0))
@settings(max_examples=15, deadline=None)
def test_the_shift_turns_with_the_picture_and_ignores_ambient_light(seed, sigma, ambient):
    white, black = pictures(seed)
    shift = footprint_shift(white, black, sigma)
    np.testing.assert_allclose(footprint_shift(white.T, black.T, sigma).transpose(1, 0, 2)[..., ::-1], shift, atol=1e-9)
    mirrored = footprint_shift(white[:, ::-1], black[:, ::-1], sigma)[:, ::-1]
    np.testing.assert_allclose(mirrored * (-1, 1), shift, atol=1e-9)
    np.testing.assert_allclose(footprint_shift(white + ambient, black + ambient, sigma), shift, atol=1e-9)


@given(st.integers(0, 1000), st.floats(0.2, 1.0))
@settings(max_examples=15, deadline=None)
def test_the_shift_grows_with_the_footprint_s_area_up_to_its_limit(seed, sigma):
    white, black = pictures(seed)
    free = InkSettings(shift_max=1e9)
    np.testing.assert_allclose(
        footprint_shift(white, black, 2 * sigma, free), 4 * footprint_shift(white, black, sigma, free)
    )
    held = footprint_shift(white, black, sigma, InkSettings(shift_max=0.05))
    lengths = np.hypot(*np.moveaxis(held, -1, 0))
    assert lengths.max() == pytest.approx(0.05 * sigma)


def test_noise_is_measured_beside_ink_at_each_brightness():
    rng = np.random.default_rng(4)
    clean = 180 * seen(edges(*fine_grid()))
    picture = np.tile(clean, (3, 3))
    sigma = 1.0 + picture / 90
    variance = noise_variance(picture + sigma * rng.standard_normal(picture.shape), picture)
    dark, light = picture < 30, picture > 170
    assert np.sqrt(np.median(variance[dark])) == pytest.approx(np.median(sigma[dark]), rel=0.15)
    assert np.sqrt(np.median(variance[light])) == pytest.approx(np.median(sigma[light]), rel=0.15)
    assert noise_variance(np.full((9, 9), 50.0), np.full((9, 9), 60.0)) == pytest.approx(np.full((9, 9), 1 / 6))


def test_a_calibration_without_a_spread_is_refused_with_a_remedy():
    capture, column, row = inked(edges)
    decoded = Correspondence(column, row, np.zeros(column.shape, np.uint8))
    with pytest.raises(StepError, match="states no `camera_psf_px`; calibrate again"):
        correct_ink(bench(), decoded, capture)
    with pytest.raises(InputError, match=r"`correspondence` must have the capture's shape \(44, 56\), got \(10, 10\)"):
        correct_ink(CALIBRATION, Correspondence(column[:10, :10], row[:10, :10], decoded.reason[:10, :10]), capture)


@pytest.mark.parametrize("sigma", [0.0, -1.0, np.nan, np.inf])
def test_a_footprint_has_a_size(sigma):
    with pytest.raises(InputError, match=r"`sigma_px` must be finite and positive \[px\]"):
        footprint_shift(*pictures(0), sigma)


def test_white_and_black_are_of_one_shape():
    white, black = pictures(0)
    with pytest.raises(InputError, match=r"`black` must have white's shape \(24, 30\), got \(23, 30\)"):
        footprint_shift(white, black[1:], 0.8)


@pytest.mark.parametrize("widths", [(1.0,), (1.0, -0.1), (np.nan, 1.0)])
def test_a_stripe_has_two_widths(widths):
    with pytest.raises(InputError, match=r"`stripe_px` must be two finite widths"):
        Correspondence(np.zeros((2, 2)), np.zeros((2, 2)), np.zeros((2, 2), np.uint8), widths)


@pytest.mark.parametrize(
    "wrong",
    [
        {"slope_radius_px": 1}, {"slope_radius_px": 16}, {"noise_guard": -0.1}, {"noise_guard": np.nan},
        {"shift_max": 0.0}, {"shift_max": np.inf},
    ],
)  # fmt: skip
def test_settings_out_of_range_are_refused_by_name(wrong):
    with pytest.raises(InputError, match=f"`{next(iter(wrong))}` must"):
        InkSettings(**wrong)

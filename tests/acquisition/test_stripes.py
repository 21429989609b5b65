import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from deskew.acquisition.grey import grey_levels
from deskew.acquisition.peaks import fit_gaussian
from deskew.acquisition.stripes import SweepSettings, decode_sweep
from deskew.acquisition.sweep_tracks import cells_of, sum_cells
from deskew.errors import InputError, StepError
from deskew.types import Capture, PatternKind, Reason
from tests.acquisition.stripe_scenes import StripeFrames, stripe_capture


def bound_px(amplitude, width, noise):
    """Cramer-Rao bound of a peak's position under additive noise, rounding included [samples]."""
    return np.sqrt(noise**2 + 1 / 12) / amplitude * np.sqrt(2 * width / np.sqrt(np.pi))


@given(st.floats(-0.49, 0.49), st.floats(5, 5000), st.floats(0.6, 2.2))
@settings(deadline=None)
def test_a_noise_free_gaussian_is_fitted_exactly(shift, amplitude, width):
    samples = amplitude * np.exp(-0.5 * ((np.arange(9) - 4 - shift) / width) ** 2)
    fitted = fit_gaussian(samples, 0, 8, 4)
    np.testing.assert_allclose(fitted, (4 + shift, amplitude, width), rtol=2e-4, atol=2e-4)


@pytest.mark.parametrize("samples", [[9, 9, 9, 9, 9, 9, 9], [9, 7, 5, 6, 5, 7, 9]])
def test_a_profile_without_a_peak_has_no_amplitude(samples):
    assert fit_gaussian(np.array(samples, float), 0, 6, 3)[1] == 0.0


@pytest.mark.parametrize("width", [0.9, 1.2, 1.6])
def test_temporal_peaks_on_uniform_paper_reach_the_cramer_rao_bound_without_bias(width):
    capture, column, row = stripe_capture((160, 120), amplitude=120.0, width=width, noise=2.5, seed=3)
    decoded = decode_sweep(capture)
    assert (decoded.reason == Reason.OK).all()
    bound = bound_px(120.0, width, 2.5)
    for error, truth in ((decoded.column - column, column), (decoded.row - row, row)):
        assert 0.9 < error.std() / bound < 1.1
        assert abs(error.mean()) < 4 * bound / np.sqrt(error.size)
        # Nor is there a bias that depends on where between two samples the peak lies.
        phase = np.floor((truth % 1.0) * 10).astype(int)
        by_phase = np.array([error[phase == i].mean() for i in range(10)])
        assert np.abs(by_phase).max() < 0.15 * bound


def test_integer_peaks_are_whole_frames_and_err_by_rounding():
    capture, column, _ = stripe_capture(noise=0.5)
    decoded = decode_sweep(capture, SweepSettings(peak="integer"))
    np.testing.assert_array_equal(decoded.column, np.round(decoded.column))
    assert 0.9 < (decoded.column - column).std() / np.sqrt(1 / 12) < 1.1


def test_spatial_and_temporal_readings_agree_within_their_noise():
    capture, column, row = stripe_capture((160, 120), (120, 90), noise=1.5, seed=5)
    temporal, spatial = decode_sweep(capture), decode_sweep(capture, SweepSettings(mode="spatial"))
    both = (temporal.reason == Reason.OK) & (spatial.reason == Reason.OK)
    assert both.mean() > 0.93  # the spatial reading cannot see past its outermost curves
    for a, b, truth in ((temporal.column, spatial.column, column), (temporal.row, spatial.row, row)):
        difference = (a - b)[both]
        assert 0 < difference.std() < 3 * bound_px(120.0, 1.2, 1.5)
        assert abs(difference.mean()) < 0.005
        assert 0 < np.abs(b - truth)[both].max() < 0.15


def test_the_spatial_reading_does_not_assume_that_curves_keep_their_order():
    capture, column, _ = stripe_capture((96, 64), (80, 56))
    frames = capture.columns
    mirrored = replace(frames, where=frames.where[:, ::-1].copy())
    decoded = decode_sweep(replace_columns(capture, mirrored), SweepSettings(mode="spatial"))
    ok = decoded.reason == Reason.OK
    assert ok.mean() > 0.85
    assert np.abs(decoded.column - column[:, ::-1])[ok].max() < 0.2


@pytest.mark.parametrize("mode", ["temporal", "spatial"])
def test_each_sweep_is_read_once_and_in_order(mode):
    capture, _, _ = stripe_capture()
    decode_sweep(capture, SweepSettings(mode=mode))
    assert capture.columns.drawn == list(range(80))
    assert capture.rows.drawn == list(range(56))


def peak_bytes(n_columns):
    capture, _, _ = stripe_capture((160, 120), (n_columns, 40), noise=0.5)
    decode_sweep(capture)  # compile outside the measurement
    tracemalloc.start()
    try:
        decode_sweep(capture)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_temporal_memory_does_not_grow_with_the_length_of_the_sweep():
    short, long = peak_bytes(60), peak_bytes(360)
    frame = 160 * 120
    assert 7 * frame < short  # the ring alone
    assert long - short < 10 * frame  # of 300 frames more


@given(st.integers(0, 60))
@settings(max_examples=10, deadline=None)
def test_even_ambient_light_changes_nothing(ambient):
    capture, _, _ = stripe_capture((32, 24), (40, 32), level=14.0, contrast=120.0, amplitude=100.0)
    lifted, _, _ = stripe_capture((32, 24), (40, 32), level=14.0 + ambient, contrast=120.0, amplitude=100.0)
    np.testing.assert_array_equal(decode_sweep(capture).column, decode_sweep(lifted).column)


def test_colour_decodes_as_grey_and_16_bits_as_8():
    grey, _, _ = stripe_capture()
    deep, column, _ = stripe_capture(dtype=np.uint16, amplitude=12000, level=1200, contrast=20000, noise=100)
    colour = Capture(
        np.dstack([grey.white] * 3), np.dstack([grey.black] * 3), grey.projector_size, grey.pattern,
        Mapped(grey.columns, lambda f: np.dstack([f] * 3)), Mapped(grey.rows, lambda f: np.dstack([f] * 3)),
    )  # fmt: skip
    np.testing.assert_array_equal(decode_sweep(colour).column, decode_sweep(grey).column)
    assert 0.9 < (decode_sweep(deep).column - column).std() / bound_px(120.0, 1.2, 1.0) < 1.1


def test_luminance_is_the_same_for_rgb_and_bgr_and_keeps_clipping_in_any_channel():
    image = np.random.default_rng(0).integers(0, 255, (5, 7, 3)).astype(np.uint8)
    np.testing.assert_array_equal(grey_levels(image, "a"), grey_levels(image[..., ::-1], "a"))
    image[2, 3] = (255, 0, 0)
    assert grey_levels(image, "a")[2, 3] == 255


class Mapped:
    def __init__(self, frames, change):
        self.frames, self.change = frames, change

    def __len__(self):
        return len(self.frames)

    def __iter__(self):
        return map(self.change, self.frames)


def replace_columns(capture, columns):
    return Capture(capture.white, capture.black, capture.projector_size, capture.pattern, columns, capture.rows)


PATCHES = {
    Reason.SHADOW: np.s_[4:20, 8:40],
    Reason.SATURATED: np.s_[4:20, 52:84],
    Reason.WEAK: np.s_[28:44, 8:40],
    Reason.TWO_PEAKS: np.s_[28:44, 52:84],
}


def faulty_capture():
    """Uniform paper with one patch of each fault."""
    shape = (64, 96)
    amplitude, contrast = np.full(shape, 120.0), np.full(shape, 200.0)
    amplitude[PATCHES[Reason.SHADOW]], contrast[PATCHES[Reason.SHADOW]] = 0.0, 0.5
    amplitude[PATCHES[Reason.SATURATED]] = 330.0
    amplitude[PATCHES[Reason.WEAK]] = 0.4
    capture, column, row = stripe_capture(amplitude=amplitude, contrast=contrast)
    ghost = np.full(shape, np.nan)
    ghost[PATCHES[Reason.TWO_PEAKS]] = (column[PATCHES[Reason.TWO_PEAKS]] + 20) % 70
    columns = replace(capture.columns, ghost_where=ghost, ghost_amplitude=90.0)
    return replace_columns(capture, columns), column, row


def outside(patches, shape, margin=4):
    clear = np.ones(shape, bool)
    for rows, columns in patches:
        clear[
            max(0, rows.start - margin) : rows.stop + margin, max(0, columns.start - margin) : columns.stop + margin
        ] = 0
    clear[:3], clear[-3:], clear[:, :3], clear[:, -3:] = False, False, False, False
    return clear


def test_each_fault_gets_its_reason_and_the_rest_decodes():
    capture, column, _ = faulty_capture()
    decoded = decode_sweep(capture)
    for reason, patch in PATCHES.items():
        assert (decoded.reason[patch] == reason).mean() > 0.99, reason
    clear = outside(PATCHES.values(), column.shape, margin=0)
    assert (decoded.reason[clear] == Reason.OK).all()
    assert np.abs(decoded.column - column)[clear].max() < 0.1
    bad = decoded.reason != Reason.OK
    assert np.isnan(decoded.column[bad]).all()
    assert np.isnan(decoded.row[bad]).all()


def test_each_fault_gets_its_reason_in_the_spatial_reading():
    capture, column, _ = faulty_capture()
    decoded = decode_sweep(capture, SweepSettings(mode="spatial"))
    for reason in (Reason.SHADOW, Reason.SATURATED, Reason.WEAK):
        inside = decoded.reason[PATCHES[reason]][5:-5, 5:-5]  # a curve's fit sees a few pixels beyond a patch's border
        assert (inside == reason).mean() > 0.9, reason
    # It compares what one frame shows: the ghost makes its own frames ambiguous, wherever their true curve runs.
    rivals = outside([], column.shape) & (column > 62) & (column < 68)
    rivals[:31], rivals[41:] = False, False
    assert (decoded.reason[rivals] == Reason.TWO_PEAKS).mean() > 0.9
    clear = outside([p for r, p in PATCHES.items() if r != Reason.TWO_PEAKS], column.shape)
    clear[24:48, 48:] = False
    assert (decoded.reason[clear] == Reason.OK).mean() > 0.99
    wrong = np.abs(decoded.column - column) > 0.2
    assert wrong[outside([p for r, p in PATCHES.items() if r != Reason.TWO_PEAKS], column.shape)].mean() < 0.003


def test_a_blend_of_two_surfaces_is_too_wide_and_a_glitch_too_narrow():
    width = np.full((64, 96), 1.2)
    width[4:20, 8:40] = 3.2
    width[28:44, 8:40] = 0.2
    capture, _, _ = stripe_capture(width=width)
    reason = decode_sweep(capture).reason
    assert (reason[4:20, 8:40] == Reason.TWO_PEAKS).mean() > 0.95
    assert (reason[28:44, 8:40] == Reason.WEAK).mean() > 0.95


def test_a_stripe_on_the_border_of_the_projector_is_no_peak():
    capture, _, _ = stripe_capture()
    where = capture.columns.where.copy()
    where[:, :40] = np.array([-0.6, 79.6])[np.arange(64) % 2][:, None]
    decoded = decode_sweep(replace_columns(capture, replace(capture.columns, where=where)))
    assert (decoded.reason[:, :40] == Reason.WEAK).all()
    assert (decoded.reason[:, 40:] == Reason.OK).all()


def inked_capture(amplitude, noise):
    """Paper, and from the ninth column on ink of the given amplitude; white - black as the stripes add up to."""
    amplitudes = np.full((120, 160), amplitude)
    amplitudes[:, :8] = 40.0
    contrast = amplitudes * 1.2 * np.sqrt(2 * np.pi)
    return stripe_capture((160, 120), (200, 150), amplitude=amplitudes, contrast=contrast, noise=noise, seed=7)


@pytest.mark.parametrize("mode", ["temporal", "spatial"])
def test_ink_too_dark_for_one_pixel_is_read_where_its_neighbours_light_shows_the_stripe(mode):
    noise = 1.8
    amplitude = 4.2 * noise / np.sqrt(1.2 * np.sqrt(np.pi))  # a signal-to-noise ratio of 4.2 before rounding
    capture, column, row = inked_capture(amplitude, noise)
    ink = np.s_[4:-4, 12:-4]
    alone = decode_sweep(capture, SweepSettings(mode=mode, guided_snr=4.0)).reason[ink] == Reason.OK
    decoded = decode_sweep(capture, SweepSettings(mode=mode))
    ok = decoded.reason[ink] == Reason.OK
    assert 0.1 < alone.mean() < 0.75
    assert 0.93 < ok.mean() < 1.0
    bound = bound_px(amplitude, 1.2, noise)
    for found, truth in ((decoded.column, column), (decoded.row, row)):
        error = (found - truth)[ink][ok]
        # Wild peaks, anywhere in the sweep, would make this ten times the bound.
        assert 0.9 < error.std() / bound < 1.1
        assert np.abs(error).max() < 3.0
        assert abs(error.mean()) < 0.1 * bound


@pytest.mark.parametrize("mode", ["temporal", "spatial"])
def test_four_pixels_together_see_no_stripe_in_noise(mode):
    capture, _, _ = inked_capture(0.0, 1.8)
    assert (decode_sweep(capture, SweepSettings(mode=mode)).reason[:, 12:] == Reason.OK).mean() < 0.005


@pytest.mark.parametrize("shape", [(13, 18), (16, 12)])
@pytest.mark.parametrize("across", [False, True])
def test_cells_cover_the_image_and_their_sums_are_those_of_their_pixels(shape, across):
    frame = np.random.default_rng(2).integers(0, 256, shape).astype(np.uint8)
    cells = cells_of(shape, across=across)
    places = cells.first[:, None] + cells.step * np.arange(cells.size)
    assert set(places.ravel()) == set(range(frame.size))
    total = np.zeros(len(cells.first), np.uint16)
    sum_cells(frame, cells, total)
    np.testing.assert_array_equal(total, frame.ravel()[places].sum(axis=1))


def test_an_image_narrower_than_a_cell_is_refused():
    with pytest.raises(InputError, match="`white` must be at least 4 px wide and high"):
        decode_sweep(stripe_capture((12, 3), (16, 30))[0])


@pytest.mark.parametrize("noise", [0.0, 1.0, 3.0])
def test_noise_alone_is_hardly_ever_taken_for_a_stripe(noise):
    amplitude = np.zeros((64, 96))
    amplitude[:, :8] = 120.0
    capture, _, _ = stripe_capture(amplitude=amplitude, noise=noise, level=30.0)
    reason = decode_sweep(capture).reason
    assert (reason[:, 8:] == Reason.WEAK).mean() > 0.995
    assert (reason[:, :8] == Reason.OK).mean() > 0.995


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda f: f[:-1], r"`columns\[0\]` must have white's shape \(64, 96\), got \(63, 96\)"),
        (lambda f: f.astype(np.uint16), r"`columns\[0\]` must have white's type uint8, got uint16"),
        (lambda f: f.astype(float), r"`columns\[0\]` must have white's type uint8, got float64"),
        (lambda f: f[..., None], r"`columns\[0\]` must be \(height, width\[, 3\]\)"),
    ],
)
def test_a_frame_unlike_the_white_one_is_refused(change, message):
    capture, _, _ = stripe_capture()
    with pytest.raises(InputError, match=message):
        decode_sweep(replace_columns(capture, Mapped(capture.columns, change)))


def test_a_sweep_that_ends_early_is_refused():
    capture, _, _ = stripe_capture()

    class Short(StripeFrames):
        def __iter__(self):
            yield from list(super().__iter__())[:60]

    short = Short(**{name: getattr(capture.columns, name) for name in StripeFrames.__dataclass_fields__})
    with pytest.raises(InputError, match="`columns` must yield its 80 frames, got 60"):
        decode_sweep(replace_columns(capture, short))


def test_a_sweep_shorter_than_a_window_is_refused():
    capture, _, _ = stripe_capture((16, 12), (6, 40))
    with pytest.raises(InputError, match="`columns` must hold at least 7 frames"):
        decode_sweep(capture)


def test_another_pattern_is_refused():
    capture, _, _ = stripe_capture((16, 12), (16, 16))
    frames = replace(capture.columns, n_frames=8)
    gray = Capture(capture.white, capture.black, (16, 16), PatternKind.GRAY_CODE, frames, frames)
    with pytest.raises(InputError, match="`pattern` must be line_sweep"):
        decode_sweep(gray)


def test_a_dark_scene_is_a_failed_step_with_a_remedy():
    capture, _, _ = stripe_capture(amplitude=0.0, contrast=0.0)
    with pytest.raises(StepError, match=r"found no stripe in any pixel \(\{'SHADOW': 6\d+.*: check that"):
        decode_sweep(capture)


@pytest.mark.parametrize(
    "wrong",
    [
        {"mode": "both"}, {"guided_snr": 0.0}, {"guided_snr": 4.1},
        {"peak": "parabola"}, {"half_width": 1}, {"half_width": 16}, {"half_width": 2.5},
        {"min_snr": 0.0}, {"shadow_snr": -1.0}, {"second_peak_ratio": 0.0}, {"second_peak_ratio": 1.1},
        {"width_ratio": 1.0}, {"saturated_level": 0}, {"max_gap_px": 0.0},
    ],
)  # fmt: skip
def test_settings_out_of_range_are_refused_by_name(wrong):
    with pytest.raises(InputError, match=f"`{next(iter(wrong))}` must"):
        SweepSettings(**wrong)

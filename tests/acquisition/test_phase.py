"""Fringes: the phase against its bound, harmonics, ink, and periods that must never be mistaken."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from deskew.acquisition import GrayCodeSettings, PhaseSettings, SweepSettings, decode, decode_phase
from deskew.acquisition.fringes import FringeImage, read_fringe
from deskew.acquisition.phase import unwrap_by_code, unwrap_by_periods
from deskew.errors import InputError
from deskew.types import Capture, Fringe, PatternKind, Reason, n_frames
from tests.acquisition.phase_scenes import CODED, LIGHT, PROJECTOR, SEVERAL, phase_capture, tilted, wave

PHASES = [PatternKind.GRAY_PHASE, PatternKind.MULTI_PHASE]


def bound_px(fringe: Fringe, noise: float, modulation: float) -> float:
    """Cramer-Rao bound of a place from N even steps: ``P / (2 pi) sqrt(2 / N) noise / modulation``."""
    return fringe.period_px / (2 * np.pi) * np.sqrt(2 / fringe.n_steps) * noise / modulation


@pytest.mark.parametrize("pattern", PHASES)
def test_a_plane_is_decoded_to_the_bound_of_its_noise(pattern):
    column, row = tilted()
    capture = phase_capture(column, row, pattern, noise=2.0, seed=1)
    decoded = decode_phase(capture)
    ok = decoded.reason == Reason.OK
    assert ok.mean() > 0.999
    expected = bound_px(capture.fringes[-1], np.hypot(2.0, 12**-0.5), LIGHT / 2)
    for got, true in ((decoded.column, column), (decoded.row, row)):
        error = (got - true)[ok]
        assert abs(error.mean()) < 0.002
        assert 0.97 < error.std() / expected < 1.03
        assert np.abs(error).max() < 6 * expected
    assert np.array_equal(np.isfinite(decoded.column), ok)


@pytest.mark.parametrize("n_steps", [4, 5, 6, 9, 12])
def test_the_noise_of_a_place_is_known_from_the_frames_also_beside_a_gamma(n_steps):
    column, _ = tilted()
    fringe, rng = Fringe(16.0, n_steps), np.random.default_rng(n_steps)
    frames = [10 + LIGHT * light + rng.normal(0, 2.0, column.shape) for light in wave(column, fringe, 1.5)]
    image = read_fringe(iter(frames), fringe, np.full(column.shape, LIGHT))
    assert np.median(image.place_sigma) == pytest.approx(
        bound_px(fringe, 2.0, float(np.median(image.modulation))), rel=0.06
    )


@pytest.mark.parametrize("n_steps", [4, 5, 6, 7, 8])
def test_n_steps_cancel_the_harmonics_up_to_n_minus_2(n_steps):
    """Harmonic k biases the phase exactly if k + 1 or k - 1 is a multiple of N."""
    place = np.linspace(0.0, 32.0, 400, endpoint=False).reshape(20, 20)
    fringe = Fringe(16.0, n_steps)
    for k in range(2, 2 * n_steps + 2):
        angle = [2 * np.pi * (place / 16.0 - n / n_steps) for n in range(n_steps)]
        frames = [(100 + 50 * np.cos(a) + 5 * np.cos(k * a)) for a in angle]
        image = read_fringe(iter(frames), fringe, np.full(place.shape, 100.0))
        error = np.abs((image.place - place + 8.0) % 16.0 - 8.0).max()
        biased = (k + 1) % n_steps == 0 or (k - 1) % n_steps == 0
        assert (error > 0.2) if biased else (error < 1e-4), k  # 16 / (2 pi) * 5 / 50 = 0.25


@pytest.mark.parametrize("gamma", [0.7, 1.4, 2.2])
def test_the_bias_of_a_gamma_falls_with_every_step(gamma):
    """Harmonic k of light ((1 + cos) / 2)^g is (g - k + 1) / (g + k) of the one before; four steps leave a_5 - a_3."""
    column, row = tilted()
    errors = []
    for n_steps in (4, 5, 6, 8):
        capture = phase_capture(column, row, PatternKind.GRAY_PHASE, gamma=gamma, fringes=(Fringe(16.0, n_steps),))
        errors.append(np.nanstd(decode_phase(capture).column - column))
    harmonic = np.cumprod([1.0] + [(gamma - k + 1) / (gamma + k) for k in range(2, 6)])
    expected = abs(harmonic[4] - harmonic[2]) * 16 / (2 * np.pi) / np.sqrt(2)
    assert errors[0] == pytest.approx(np.hypot(expected, errors[-1]), rel=0.1)  # eight steps leave rounding alone
    assert errors[0] > errors[1] > 0.9 * errors[2]
    assert errors[2] < 0.4 * errors[0]


def test_on_a_ramp_of_albedo_the_phase_is_biased_by_the_formula_of_ink():
    """Gaussian spread s, albedo e^(g x): the footprint's phase is that of the place s^2 g further on, exactly."""
    sigma, ramp, slope = 0.8, 0.06, 1.4
    u = np.linspace(-8, 8, 4001)
    weight = np.exp(-0.5 * (u / sigma) ** 2 + ramp * u)
    place = np.linspace(20.0, 60.0, 300).reshape(15, 20)
    light = [
        np.stack([(weight * wave(p + slope * u, CODED[0])[n]).sum() / weight.sum() for p in place.ravel()])
        for n in range(CODED[0].n_steps)
    ]
    frames = [100 * frame.reshape(place.shape) for frame in light]
    image = read_fringe(iter(frames), CODED[0], np.full(place.shape, 100.0))
    shift = (image.place - place + 8.0) % 16.0 - 8.0
    np.testing.assert_allclose(shift, slope * sigma**2 * ramp, rtol=1e-4)


def fringe_at(place, fringe, sigma):
    """A fringe image of exactly these places and this noise."""
    size = np.ones_like(place)
    noise = sigma * size * (2 * np.pi / fringe.period_px) / np.sqrt(2 / fringe.n_steps)
    return FringeImage(fringe, np.mod(place, fringe.period_px), size, noise, size, 0.0, 0.0)


def code_of(place, half):
    """Number of the half period, and its Gray code's bits, most significant first."""
    number = np.floor((place + 0.5) / half).astype(int)
    return number, [((number ^ (number >> 1)) >> bit) & 1 for bit in reversed(range(5))]


def index_of(bits):
    binary = np.logical_xor.accumulate(np.array(bits, dtype=bool), axis=0)
    return np.tensordot(1 << np.arange(4, -1, -1), binary, axes=1)


def test_a_bit_that_is_wrong_at_its_own_border_costs_nothing():
    """The classic error of one period near a fringe's wrap: with half periods it cannot happen."""
    half, fringe = 8, CODED[0]
    borders = np.arange(1, 32) * half - 0.5
    place = (borders[:, None] + np.linspace(-1.9, 1.9, 39)).ravel()[None]  # a quarter of a half period on either side
    number, _ = code_of(place, half)
    beside = np.where((place + 0.5) % half > half / 2, number + 1, number - 1)
    for wrong in (number, beside):  # whichever side of the border the bits say
        coordinate, reason = unwrap_by_code(fringe_at(place, fringe, 0.0), wrong, np.zeros((5, *place.shape), bool))
        assert (reason == Reason.OK).all()
        np.testing.assert_allclose(coordinate, place, atol=1e-9)


@settings(max_examples=300, deadline=None)
@given(place=st.floats(0.0, 255.0), bit=st.integers(0, 4), error=st.floats(-1.5, 1.5))
def test_a_faint_bit_that_is_read_wrong_anywhere_never_costs_a_period(place, bit, error):
    at = np.array([[place]])
    _, bits = code_of(at, 8)
    bits[bit] = 1 - bits[bit]
    faint = np.zeros((5, 1, 1), bool)
    faint[bit] = True
    coordinate, reason = unwrap_by_code(fringe_at(at + error, CODED[0], 0.3), index_of(bits), faint)
    assert reason[0, 0] != Reason.OK or abs(coordinate[0, 0] - place - error) < 1e-6


@pytest.mark.parametrize("pattern", PHASES)
@pytest.mark.parametrize("albedo", [1.0, 0.15, 0.07, 0.04])
def test_no_pixel_is_a_period_off_however_dark(pattern, albedo):
    """Noise as strong as 2 grey levels on 7 to 180 of light: what cannot be told is weak, not wrong."""
    column, row = tilted()
    capture = phase_capture(column, row, pattern, noise=2.0, albedo=albedo, seed=5)
    decoded = decode_phase(capture)
    ok = decoded.reason == Reason.OK
    assert ok.mean() > (0.95 if albedo > 0.1 else -1.0)
    assert np.abs((decoded.column - column)[ok]).max(initial=0.0) < 8.0  # half a period
    assert np.abs((decoded.row - row)[ok]).max(initial=0.0) < 8.0
    assert set(np.unique(decoded.reason[~ok])) <= {Reason.SHADOW, Reason.WEAK, Reason.TWO_PEAKS}


def test_a_longer_fringe_lost_in_noise_is_weak_and_a_contradiction_two_peaks():
    place = np.full((4, 4), 100.3)
    longer, shorter = Fringe(272.0, 4), Fringe(16.0, 8)
    for sigma, off, expected in ((1.0, 0.0, Reason.OK), (2.0, 0.0, Reason.WEAK), (1.0, 7.0, Reason.TWO_PEAKS)):
        images = [fringe_at(place + off, longer, sigma), fringe_at(place, shorter, 0.05)]
        coordinate, reason = unwrap_by_periods(images, 256, 5.0)
        assert (reason == expected).all()
        assert expected != Reason.OK or np.allclose(coordinate, place)


@pytest.mark.parametrize("pattern", PHASES)
def test_each_pixel_says_why_it_has_no_coordinate(pattern):
    column, row = tilted()
    albedo = np.ones(column.shape)
    albedo[5:25, 10:30] = 0.0
    albedo[30:40, 10:30] = 1.6  # brighter than the camera can take
    capture = phase_capture(column, row, pattern, noise=1.0, albedo=albedo, seed=2)
    # Two places at once: half of the light is that of 8.2 px further on.
    other = phase_capture(column + 8.2, row, pattern, noise=1.0, seed=3)
    for frame, mixed in zip(capture.columns, other.columns, strict=True):
        frame[60:70, 10:30] = (frame[60:70, 10:30].astype(int) + mixed[60:70, 10:30]) // 2
    decoded = decode_phase(capture)
    assert (decoded.reason[5:25, 10:30] == Reason.SHADOW).mean() > 0.99  # white - black itself is noisy
    assert not (decoded.reason[5:25, 10:30] == Reason.OK).any()
    assert (decoded.reason[30:40, 10:30] == Reason.SATURATED).all()
    assert not (decoded.reason[60:70, 10:30] == Reason.OK).any()
    assert (decoded.reason[75:, 40:] == Reason.OK).mean() > 0.999


@pytest.mark.parametrize(
    "name", ["shadow_snr", "min_snr", "bit_snr", "unwrap_snr", "contrast_ratio", "saturated_level"]
)
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_settings_out_of_range_are_refused(name, value):
    with pytest.raises(InputError, match=f"`{name}` must"):
        PhaseSettings(**{name: value})


def test_one_door_decodes_every_pattern_and_refuses_another_decoder_s_settings():
    column, row = tilted()
    capture = phase_capture(column, row, PatternKind.MULTI_PHASE)
    np.testing.assert_array_equal(decode(capture).column, decode_phase(capture).column)
    strict = decode(capture, PhaseSettings(min_snr=1e5))
    assert (strict.reason == Reason.WEAK).all()
    for wrong in (SweepSettings(), GrayCodeSettings()):
        with pytest.raises(InputError, match="`settings` must be PhaseSettings for a multi_phase, got "):
            decode(capture, wrong)


def test_a_gray_code_holds_no_fringes():
    image = np.zeros((8, 8), np.uint8)
    capture = Capture(image, image, (4, 4), PatternKind.GRAY_CODE, [image] * 4, [image] * 4)
    with pytest.raises(InputError, match="`capture` must hold fringes, got gray_code"):
        decode_phase(capture)


@pytest.mark.parametrize(
    ("pattern", "fringes", "message"),
    [
        (PatternKind.GRAY_PHASE, (), "be one of an even period"),
        (PatternKind.GRAY_PHASE, SEVERAL, "be one of an even period"),
        (PatternKind.GRAY_PHASE, (Fringe(15.0, 4),), "be one of an even period"),
        (PatternKind.MULTI_PHASE, CODED, "be two or more of falling periods"),
        (PatternKind.MULTI_PHASE, SEVERAL[::-1], "be two or more of falling periods"),
        (PatternKind.MULTI_PHASE, SEVERAL[1:], "begin with a period of at least the projector's 256"),
        (PatternKind.LINE_SWEEP, CODED, "be none for a line_sweep"),
    ],
)
def test_a_capture_refuses_fringes_that_do_not_tell_every_line(pattern, fringes, message):
    image = np.zeros((8, 8), np.uint8)
    with pytest.raises(InputError, match=f"`fringes` must {message}"):
        Capture(image, image, PROJECTOR, pattern, [image] * 9, [image] * 9, fringes=fringes)


@pytest.mark.parametrize("pattern", PHASES)
def test_a_capture_counts_the_frames_of_its_fringes(pattern):
    fringes = CODED if pattern is PatternKind.GRAY_PHASE else SEVERAL
    wanted = n_frames(pattern, 256, fringes)
    assert wanted == (16 if pattern is PatternKind.MULTI_PHASE else 2 * 5 + 6)
    image = np.zeros((8, 8), np.uint8)
    with pytest.raises(InputError, match=f"`columns` must hold {wanted} frames for a {pattern} of 256, got 9"):
        Capture(image, image, PROJECTOR, pattern, [image] * 9, [image] * 9, fringes=fringes)


@pytest.mark.parametrize(
    ("period", "steps", "name"), [(3.0, 4, "period_px"), (16.0, 3, "n_steps"), (16.0, 4.5, "n_steps")]
)
def test_a_fringe_refuses_what_is_no_sine(period, steps, name):
    with pytest.raises(InputError, match=f"`{name}` must"):
        Fringe(period, steps)

from __future__ import annotations

import tracemalloc
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

import data_synth as ds
from data_synth.noise import deviations, expose, quantile_table
from data_synth.optics import PROFILE_STEPS, blurred, frame_window, line_profile, margin_px, psf_taps
from deskew.errors import InputError
from deskew.types import Floats

N = 40_000


def exposures(grey: float, frames: int, *, key: int = 3, scale: float = 1.0) -> Floats:
    """Frames of an even grey level: (frames, N)."""
    mean = np.full(N, grey, dtype=np.float32)
    sigma = deviations(mean, *ds.RigConfig(noise_scale=scale).noise_variance)
    images = np.empty((frames, N), dtype=np.uint8)
    for frame in range(frames):
        expose(mean, sigma, quantile_table(), key, frame, images[frame])
    return images.astype(float)


@pytest.mark.parametrize("scale", [1.0, 2.0, 3.0])
@pytest.mark.parametrize("grey", [20.0, 100.5, 200.25])
def test_noise_has_the_stated_variance_and_no_bias(grey: float, scale: float) -> None:
    images = exposures(grey, 25, scale=scale)
    wanted = scale**2 * (0.8**2 + 0.017 * grey)
    # Rounding adds a twelfth.
    assert images.var() == pytest.approx(wanted + 1 / 12, rel=0.02)
    assert images.mean() == pytest.approx(grey, abs=0.01 * scale + 0.005)
    assert np.abs(images - grey).max() < 4.5 * np.sqrt(wanted) + 0.5


def test_white_noise_is_about_two_grey_levels_at_white() -> None:
    assert exposures(200.0, 4).std() == pytest.approx(2.0, abs=0.1)


def test_noise_is_white_in_space_and_time() -> None:
    images = exposures(100.0, 25) - 100.0
    scale = images.var()
    for lag in (1, 2, 15, 16, 17, 640):
        assert abs((images[:, lag:] * images[:, :-lag]).mean() / scale) < 0.005
    for lag in (1, 2, 7):
        assert abs((images[lag:] * images[:-lag]).mean() / scale) < 0.005
    other = exposures(100.0, 25, key=4) - 100.0
    assert abs((images * other).mean() / scale) < 0.005


def test_noise_is_normal() -> None:
    standard = (exposures(128.0, 25) - 128.0).ravel()
    standard /= standard.std()
    assert abs((standard**3).mean()) < 0.02
    assert (standard**4).mean() == pytest.approx(3.0, abs=0.06)


def test_photographs_have_the_noise_of_the_model() -> None:
    rig = ds.default_rig(noise_scale=1.5)
    first, second = (ds.photograph(rig, ds.flat_sheet(), ds.Checkerboard(), seed) for seed in (1, 2))
    for a, b in ((first.white, second.white), (first.rows[350], second.rows[350])):  # type: ignore[index]
        level, difference = (a.astype(float) + b) / 2, a.astype(float) - b
        for low, high in ((6, 12), (18, 26), (25, 60), (150, 170)):
            inside = (level > low) & (level < high)
            if inside.sum() < 2000:
                continue
            wanted = 1.5**2 * (0.64 + 0.017 * level[inside].mean()) + 1 / 12
            assert difference[inside].var() / 2 == pytest.approx(wanted, rel=0.12)


def test_another_draw_is_the_same_scene_with_other_noise_of_the_same_strength() -> None:
    config = ds.RigConfig()
    rigs = [replace(ds.default_rig(), config=replace(config, noise_draw=draw)) for draw in (0, 7, 8)]
    # One generator each, as a trial has it: what it draws later must not depend on the draw of the noise.
    generators = [np.random.default_rng(5) for _ in rigs]
    captures = [
        ds.photograph(rig, ds.flat_sheet(), ds.Checkerboard(), rng) for rig, rng in zip(rigs, generators, strict=True)
    ]
    assert len({int(rng.integers(1 << 60)) for rng in generators}) == 1
    plain = ds.photograph(ds.default_rig(), ds.flat_sheet(), ds.Checkerboard(), np.random.default_rng(5))
    assert np.array_equal(captures[0].white, plain.white)
    for image, variance in (("black", 0.64 + 0.017 * captures[0].black.mean()), ("white", None)):
        images = [getattr(capture, image).astype(float) for capture in captures]
        differences = [(images[i] - images[j]).var() / 2 for i, j in ((0, 1), (1, 2), (2, 0))]
        assert max(differences) < 1.02 * min(differences)
        assert variance is None or differences[0] == pytest.approx(variance + 1 / 12, rel=0.05)


def test_silence_leaves_rounding_alone() -> None:
    assert np.unique(exposures(99.4, 3, scale=0.0)).tolist() == [99.0]
    assert np.unique(exposures(300.0, 1, scale=0.0)).tolist() == [255.0]
    assert np.unique(exposures(-5.0, 1, scale=0.0)).tolist() == [0.0]


def test_a_sweep_is_never_held_whole() -> None:
    capture = ds.photograph(ds.default_rig(), ds.flat_sheet(), ds.Blank(), 0)
    next(iter(capture.columns))
    tracemalloc.start()
    for _ in islice(capture.columns, 400):
        pass
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # 400 frames are 123 MB; one frame with the sorted samples is far less.
    assert 0.3e6 < peak < 60e6


def test_lines_add_up_to_the_whole_frame() -> None:
    for sigma in (0.3, 0.6, 1.5):
        profile = line_profile(sigma)
        distance = np.arange(len(profile)) / PROFILE_STEPS
        coordinates = np.array([-1.0, -0.5, 0.2, 3.7, 12.0, 18.9, 19.5, 21.0])
        lines = np.abs(coordinates[:, None] - np.arange(20)[None])
        total = np.interp(lines, distance, profile, right=0.0).sum(axis=1)
        assert np.allclose(total, frame_window(coordinates, 20, sigma), atol=2e-4)
        # Variance of the blurred unit box.
        assert 2 * np.trapezoid(profile * distance**2, distance) == pytest.approx(sigma**2 + 1 / 12, rel=2e-3)


@pytest.mark.parametrize("width", [1, 3, 7])
def test_a_wide_stripe_is_the_sum_of_its_lines(width: int) -> None:
    line, stripe = line_profile(0.6), line_profile(0.6, width)
    distance = np.arange(len(stripe)) / PROFILE_STEPS
    neighbours = np.arange(width) - width // 2
    total = sum(
        np.interp(np.abs(distance - k), np.arange(len(line)) / PROFILE_STEPS, line, right=0) for k in neighbours
    )
    assert np.allclose(stripe, total, atol=2e-4)


@pytest.mark.parametrize("width", [0, 2, 17])
def test_a_stripe_has_a_middle_line(width: int) -> None:
    with pytest.raises(InputError, match="`stripe_width_px` must be an odd whole number"):
        replace(ds.RigConfig(), stripe_width_px=width)


def test_the_point_spread_keeps_light_and_place() -> None:
    taps = psf_taps(0.75)
    assert taps.sum() == pytest.approx(1.0, abs=1e-6)
    assert np.array_equal(taps, taps[::-1])
    margin = margin_px(0.75)
    samples = np.zeros((2 * (20 + 2 * margin), 2 * (30 + 2 * margin)), dtype=np.float32)
    # Light in the four sub-samples of pixel (12, 7) alone.
    samples[2 * (7 + margin) : 2 * (8 + margin), 2 * (12 + margin) : 2 * (13 + margin)] = 0.25
    image = blurred(samples, taps)
    assert image.shape == (20, 30)
    rows, columns = np.mgrid[:20, :30]
    assert image.sum() == pytest.approx(0.25, abs=1e-6)
    assert (image * columns).sum() / image.sum() == pytest.approx(12.0, abs=1e-5)
    assert (image * rows).sum() / image.sum() == pytest.approx(7.0, abs=1e-5)
    assert np.unravel_index(image.argmax(), image.shape) == (7, 12)


def test_blur_of_an_even_scene_changes_nothing_up_to_the_border() -> None:
    config = replace(ds.RigConfig(), camera_psf_sigma_px=1.1)
    margin = margin_px(config.camera_psf_sigma_px)
    samples = np.full((2 * (8 + 2 * margin), 2 * (9 + 2 * margin)), 3.5, dtype=np.float32)
    assert np.allclose(blurred(samples, psf_taps(1.1)), 3.5, atol=1e-5)

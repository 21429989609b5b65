"""What noise alone makes of a figure: closed forms, simulated readings, and the rig itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ndtr

import data_synth
from data_synth import RigConfig
from deskew import acquisition, pipeline, projection
from deskew.acquisition import Sphere, SweepSettings
from deskew.acquisition.peaks import fit_gaussian
from deskew.types import Calibration
from experiments.studies.bounds import (
    corner_sigma_px,
    root_mean_square,
    sight_noise,
    sphere_covariance,
    stripe_sigma,
    trimmed_range,
)

# Even noise of one grey level, rounding included.
EVEN = replace(RigConfig(), shot_noise_grey=0.0, read_noise_grey=np.sqrt(1 - 1 / 12))


def test_even_noise_gives_the_closed_form() -> None:
    amplitude, width = np.array([20.0, 80.0, 80.0]), np.array([0.7, 0.7, 1.4])
    expected = np.sqrt(2 * width / np.sqrt(np.pi)) / amplitude
    np.testing.assert_allclose(stripe_sigma(amplitude, np.full(3, 9.0), width, EVEN), expected, rtol=1e-3)


def test_noise_that_grows_with_light_costs_more() -> None:
    one = np.ones(1)
    dark, bright = (stripe_sigma(80 * one, level * one, one, RigConfig()) for level in (5.0, 100.0))
    assert 1.0 < float((bright / dark)[0]) < 2.0
    noisy = stripe_sigma(80 * one, 5.0 * one, one, RigConfig(noise_scale=2.0))
    assert 1.8 < float((noisy / dark)[0]) < 2.0


def test_a_simulated_reading_reaches_the_bound_and_does_not_pass_it() -> None:
    rng = np.random.default_rng(8)
    frames, amplitude, width = np.arange(13.0), 60.0, 0.95
    errors = []
    for _ in range(3000):
        place = 6.0 + rng.uniform(-0.5, 0.5)
        profile = amplitude * np.exp(-0.5 * ((frames - place) / width) ** 2) + rng.normal(0, 1, 13)
        errors.append(fit_gaussian(profile, 0, 12, int(np.argmax(profile)))[0] - place)
    bound = float(stripe_sigma(np.array([amplitude]), np.zeros(1), np.array([width]), EVEN)[0])
    # 3000 readings know their deviation to 1.3 %.
    assert 0.96 < np.std(errors) / bound < 1.12


def test_depth_noise_of_the_rig_is_what_the_bound_says() -> None:
    rig = data_synth.default_rig()
    known = Calibration(rig.camera, rig.projector, {})
    capture, truth = data_synth.render(rig, data_synth.plane(tilt_deg=6.0, azimuth_deg=70.0), data_synth.Blank(), 77)
    depth = acquisition.depth_map(known, pipeline.decode(capture, settings=SweepSettings(mode="temporal")))
    noise = sight_noise(rig, truth, data_synth.Blank(), rig.camera)
    normal, offset = acquisition.fit_plane(truth.sheet.vertices[::90, ::90].reshape(-1, 3))
    eye, pixels = projection.centre(depth.camera), projection.pixel_grid(depth.camera.size)
    rays = projection.rays(depth.camera, pixels)
    true_z = (offset - eye @ normal) / (rays @ normal)
    error = (depth.z - true_z) * np.linalg.norm(rays, axis=-1) / noise.point
    inner = error[100:-100, 100:-100]
    assert 0.97 < 1.4826 * float(np.median(np.abs(inner))) < 1.15
    # Interpolating between raw pixels gains noise: two thirds of it are left on average.
    assert root_mean_square(noise.point) / root_mean_square(noise.averaged) == pytest.approx(2 / 3, abs=0.12)
    # By hand, at the middle: 0.33 mm a projector pixel across a ray that descends at 24 degrees from upright, and the
    # angle under which the two rays meet.
    contrast = float(np.median((capture.white.astype(float) - capture.black)[220:260, 300:340]))
    width = np.sqrt(0.6**2 + 1 / 12 + (0.475 * np.cos(np.radians(24)) / 0.33) ** 2 * (0.75**2 + 1 / 16))
    stripe = stripe_sigma(np.array([contrast / (np.sqrt(2 * np.pi) * width)]), np.array([10.0]), width, rig.config)
    toward = [projection.centre(device) - [0, 0, 15.0] for device in (rig.camera, rig.projector)]
    across = np.linalg.norm(np.cross(*toward)) / np.prod([np.linalg.norm(way) for way in toward])
    assert noise.averaged[220:260, 300:340].mean() == pytest.approx(float(stripe[0]) * 0.33 / across, rel=0.08)


def test_the_range_of_even_noise_is_that_of_its_quantiles() -> None:
    reach = trimmed_range(np.full(1000, 0.02), 0.003)
    assert reach == pytest.approx(2 * 0.02 * 2.96774, rel=1e-4)
    mixed = np.concatenate([np.full(500, 0.02), np.full(500, 0.1), [np.nan]])
    rng = np.random.default_rng(0)
    draws = np.abs(rng.normal(0, 1, (400, 1000)) * mixed[:-1]).ravel()
    assert trimmed_range(mixed, 0.003) == pytest.approx(2 * np.quantile(draws, 0.997), rel=0.02)


def test_a_ball_seen_all_around_is_known_as_well_as_its_mean() -> None:
    away = np.random.default_rng(2).normal(size=(20_000, 3))
    points = 30.0 * away / np.linalg.norm(away, axis=1, keepdims=True)
    covariance = sphere_covariance(points, np.full(len(points), 0.1), Sphere(np.zeros(3), 30.0))
    np.testing.assert_allclose(np.diag(covariance), 0.01 / 20_000 * np.array([3, 3, 3, 1]), rtol=0.03)


def test_a_corners_bound_is_the_information_of_its_edges() -> None:
    contrast, blur = 100.0, np.hypot(EVEN.camera_psf_sigma_px, 0.25)
    x = np.arange(-20, 21) + 0.3
    slope = contrast * (ndtr((x + 0.005) / blur) - ndtr((x - 0.005) / blur)) / 0.01
    expected = 1 / np.sqrt(27.0 * (slope**2).sum())
    assert corner_sigma_px(contrast, 10.0, 27.0, EVEN) == pytest.approx(expected, rel=1e-3)

"""A projector at fault is found by every pattern's own frames, and a healthy one is never accused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import data_synth as ds
from deskew import acquisition
from deskew.acquisition.projectorcheck import gamma_of, join_checks
from deskew.types import PatternKind, ProjectorCheck
from tests.acquisition.phase_scenes import phase_capture, tilted

GRAY, FRINGES = (
    [PatternKind.GRAY_CODE, PatternKind.GRAY_PHASE],
    [PatternKind.GRAY_PHASE, PatternKind.MULTI_PHASE],
)


def smaller(device, factor=4):
    """The same view by a device of fewer pixels."""
    K = device.K.copy()
    K[:2, 2] = (K[:2, 2] + 0.5) / factor - 0.5
    K[[0, 0, 1], [0, 1, 1]] /= factor
    return replace(device, size=(device.size[0] // factor, device.size[1] // factor), K=K)


@pytest.fixture(scope="module")
def crumpled():
    return ds.crumpled(np.random.default_rng(41), slope_p90_deg=20.0)


def check(pattern, *, seed=0, page=None, sheet=None, change=None, **config):
    """What the frames of a rendered capture say; `change` is a camera's curve."""
    rig = ds.default_rig()
    rig = ds.Rig(smaller(rig.camera), smaller(rig.projector), replace(rig.config, **config))
    capture = ds.photograph(rig, sheet or ds.flat_sheet(), page or ds.Checkerboard(), 900 + seed, pattern)
    if change is not None:
        capture = replace(
            capture,
            white=change(capture.white),
            black=change(capture.black),
            columns=[change(frame) for frame in capture.columns],
            rows=[change(frame) for frame in capture.rows],
        )
    return acquisition.decode(capture).projector


@pytest.mark.parametrize("pattern", list(PatternKind))
@pytest.mark.parametrize("noise_scale", [1.0, 2.0])
def test_a_healthy_projector_is_never_accused(pattern, noise_scale, crumpled):
    for seed, page, surface in ((1, ds.Checkerboard(), crumpled), (2, ds.Blank(), None)):
        found = check(pattern, seed=seed, page=page, sheet=surface, noise_scale=noise_scale)
        assert found.faults == ()
        assert 0.0 <= found.stray < 0.02
        if pattern in FRINGES:
            assert 0.97 < found.gamma < 1.03


@pytest.mark.parametrize(
    "config",
    [
        {"ambient": 0.3},
        {"projector_blur_sigma_px": 1.2},
        {"camera_psf_sigma_px": 1.3},
        {"exposure_grey": 330.0},
        {"projector_contrast": 20.0},
    ],
    ids=lambda config: next(iter(config)),
)
@pytest.mark.parametrize("pattern", [PatternKind.GRAY_PHASE])
def test_neither_a_bright_room_nor_blur_nor_clipping_is_taken_for_a_fault(pattern, config):
    assert check(pattern, seed=3, **config).faults == ()


@pytest.mark.parametrize("pattern", FRINGES)
@pytest.mark.parametrize(("driver", "gamma"), [(1.0, 2.2), (2.0, 1.1)])
def test_a_projector_s_gamma_is_measured_and_said(pattern, driver, gamma):
    found = check(pattern, seed=4, driver_gamma=driver)
    assert found.gamma == pytest.approx(gamma, rel=0.03)
    assert len(found.faults) == 2  # columns and rows
    assert f"to the power {found.gamma:.2f}" in " ".join(found.faults)
    assert found.stray < 0.02


@pytest.mark.parametrize("blur", [0.0, 1.0, 2.5])
@pytest.mark.parametrize("gamma", [0.6, 1.0, 1.3, 2.2])
def test_the_gamma_of_blurred_fringes_is_that_of_the_projector(gamma, blur):
    """Quadrature of the light's harmonics, each dimmed by the blur's Gaussian."""
    angle = np.linspace(0, 2 * np.pi, 4096, endpoint=False)
    light = ((1 + np.cos(angle)) / 2) ** gamma
    first, second = (2 * (light * np.cos(k * angle)).mean() for k in (1, 2))
    passed = np.exp(-0.5 * (2 * np.pi / 16 * blur) ** 2)
    assert gamma_of(second * passed**4 / (first * passed), 2 * first * passed) == pytest.approx(gamma, rel=1e-3)


@pytest.mark.parametrize("pattern", list(PatternKind))
def test_frames_taken_while_the_projector_switches_are_found(pattern):
    late = 0.15
    found = check(pattern, seed=5, late_share_max=late)
    assert any("out of step" in fault for fault in found.faults)
    assert 0.02 < found.stray < late


@pytest.mark.parametrize("name", ["columns", "rows"])
@pytest.mark.parametrize("frame", [3, 13])
@pytest.mark.parametrize("pattern", [PatternKind.GRAY_CODE, *FRINGES])
def test_one_frame_in_another_s_place_is_found(pattern, name, frame):
    column, row = tilted()
    capture = phase_capture(column, row, pattern, noise=1.0) if pattern in FRINGES else gray_capture(column, row)
    frames = list(getattr(capture, name))
    assert acquisition.decode(capture).projector.faults == ()
    frames[frame] = frames[frame - 1]
    found = acquisition.decode(replace(capture, **{name: frames})).projector
    assert len(found.faults) >= 1
    assert all(f"of the {name}" in fault for fault in found.faults)
    assert found.stray > 0.1


def gray_capture(column, row):
    """A Gray code without blur: each pixel looks at one projector pixel."""
    rng = np.random.default_rng(8)

    def shot(light):
        grey = 12 + 180 * light + rng.normal(0, 1, column.shape)
        return np.clip(np.rint(grey), 0, 255).astype(np.uint8)

    axes = []
    for coordinate in (column, row):
        number = np.floor(coordinate + 0.5).astype(int)
        code = number ^ (number >> 1)
        planes = [((code >> bit) & 1).astype(float) for bit in range(7, -1, -1)]
        axes.append([shot(light) for plane in planes for light in (plane, 1 - plane)])
    ones = np.ones(column.shape)
    template = phase_capture(column, row, PatternKind.MULTI_PHASE)
    return replace(
        template,
        white=shot(ones),
        black=shot(0 * ones),
        pattern=PatternKind.GRAY_CODE,
        columns=axes[0],
        rows=axes[1],
        fringes=(),
    )


def test_lines_shown_twice_are_found_and_one_of_them_is_named():
    found = check(PatternKind.LINE_SWEEP, seed=6, page=ds.Blank(), repeated_share=0.01)
    assert all("out of step" in fault and "near line" in fault for fault in found.faults)
    assert len(found.faults) >= 1
    assert 0.02 < found.stray < 0.2  # of 0.1, the root of the share


def test_a_camera_s_own_curve_shows_in_the_lines_of_a_sweep_and_in_the_fringes():
    def curved(image):
        return np.rint(255 * (image / 255.0) ** (1 / 2.2)).astype(np.uint8)

    sweep = check(PatternKind.LINE_SWEEP, seed=7, page=ds.Blank(), change=curved)
    assert any("times as bright as the white frame" in fault for fault in sweep.faults)
    fringes = check(PatternKind.MULTI_PHASE, seed=7, page=ds.Blank(), change=curved)
    assert 0.3 < fringes.gamma < 0.7
    assert any("no sines" in fault for fault in fringes.faults)


def test_too_few_bright_pixels_are_no_judgement():
    column, row = tilted((30, 25))
    for pattern in FRINGES:
        assert acquisition.decode(phase_capture(column, row, pattern)).projector == ProjectorCheck()
    assert acquisition.decode(gray_capture(column, row)).projector == ProjectorCheck()


def test_joined_checks_keep_every_fault_and_the_worst_figures():
    joined = join_checks(ProjectorCheck(("a",), 1.1, 0.01), ProjectorCheck(("b", "c"), 0.8, None), ProjectorCheck())
    assert joined == ProjectorCheck(("a", "b", "c"), 0.8, 0.01)

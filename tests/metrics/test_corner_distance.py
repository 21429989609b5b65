"""Corner figures: closed forms, and what each alignment shows or hides."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from deskew import projection
from deskew.errors import InputError, StepError
from deskew.metrics import corner_distance
from deskew.types import Floats, Pinhole

# One pixel is exactly half a millimetre on the bed.
CAMERA = Pinhole(
    size=(640, 480),
    K=np.array([[1600.0, 0.0, 320.0], [0.0, 1600.0, 240.0], [0.0, 0.0, 1.0]]),
    distortion=np.zeros(5),
    R=np.diag([1.0, -1.0, -1.0]),
    t=np.array([0.0, 0.0, 800.0]),
)


def corners() -> Floats:
    return np.stack(np.meshgrid(np.linspace(60, 580, 20), np.linspace(45, 435, 15)), axis=-1).reshape(-1, 2)


def test_identical_corners_are_at_distance_zero() -> None:
    figures = corner_distance(corners(), corners(), CAMERA)
    assert all(abs(v) < 1e-9 for k, v in figures.items() if k not in ("corners_expected",))
    assert figures["corners_expected"] == 300.0
    assert set(figures) == {
        *(f"corner_{s}_{u}" for s in ("mean", "rms", "max") for u in ("px", "mm")),
        "corner_rigid_mean_mm",
        "corner_rigid_max_mm",
        "corners_missing",
        "corners_expected",
    }


def test_alternating_displacement_gives_its_own_length() -> None:
    """Signs that no affine map can follow: every corner stays .4 px off, but for what the fit takes up."""
    rng = np.random.default_rng(0)
    signs = rng.permutation(np.repeat([-1.0, 1.0], 150))
    figures = corner_distance(corners() + 0.4 * signs[:, None] * [1.0, 0.0], corners(), CAMERA)
    # Three of 300 degrees of freedom go into the fit of x.
    assert figures["corner_rms_px"] == pytest.approx(0.4 * np.sqrt(297 / 300), rel=0.01)
    assert figures["corner_rms_mm"] == pytest.approx(0.5 * figures["corner_rms_px"], rel=1e-6)
    assert figures["corner_mean_mm"] == pytest.approx(0.5 * figures["corner_mean_px"], rel=1e-6)
    assert figures["corner_rigid_mean_mm"] == pytest.approx(0.2, rel=0.02)


def test_one_displaced_corner_is_the_maximum() -> None:
    moved = corners()
    moved[137] += [3.0, -4.0]
    figures = corner_distance(moved, corners(), CAMERA)
    assert figures["corner_max_px"] == pytest.approx(5.0, rel=0.02)
    assert figures["corner_rigid_max_mm"] == pytest.approx(2.5, rel=0.02)
    assert figures["corner_mean_px"] < 0.1


def test_wrong_scale_shows_in_the_rigid_figures_alone() -> None:
    middle = corners().mean(axis=0)
    figures = corner_distance(middle + 1.01 * (corners() - middle), corners(), CAMERA)
    assert figures["corner_max_px"] < 1e-9
    assert figures["corner_max_mm"] < 1e-9
    want = 0.01 * 0.5 * np.linalg.norm(corners() - middle, axis=1)
    assert figures["corner_rigid_mean_mm"] == pytest.approx(want.mean(), rel=1e-6)
    assert figures["corner_rigid_max_mm"] == pytest.approx(want.max(), rel=1e-6)


def test_mirrored_result_is_an_error() -> None:
    with pytest.raises(StepError, match="Corner distance: the restored page is mirrored"):
        corner_distance(corners() * [-1, 1] + [640, 0], corners(), CAMERA)


@settings(deadline=None)
@given(st.floats(-0.5, 0.5), st.floats(-60, 60), st.floats(-60, 60))
def test_turned_and_shifted_page_is_as_good(angle: float, dx: float, dy: float) -> None:
    moved = corners() + np.random.default_rng(1).normal(0, 0.3, (300, 2))
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    before = corner_distance(moved, corners(), CAMERA)
    after = corner_distance((moved - [320, 240]) @ turn.T + [320 + dx, 240 + dy], corners(), CAMERA)
    for name, value in before.items():
        assert after[name] == pytest.approx(value, rel=1e-6, abs=1e-9)


def test_tilted_camera_measures_millimetres_on_the_bed() -> None:
    """Corners laid out on the bed itself, one of them 1 mm off: 1 mm wherever it lies in the picture."""
    tilt = 0.3
    R = np.array([[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]]) @ np.diag(
        [1.0, -1, -1]
    )
    camera = Pinhole((640, 480), CAMERA.K, np.zeros(5), R, -R @ np.array([0.0, -240.0, 760.0]))
    bed = np.stack(np.meshgrid(np.linspace(-130, 130, 20), np.linspace(95, -95, 15)), axis=-1).reshape(-1, 2)
    for k in (0, 299):
        moved = bed.copy()
        moved[k] += [0.6, 0.8]
        pixels = [projection.project(camera, np.column_stack([p, np.zeros(300)])) for p in (moved, bed)]
        assert corner_distance(*pixels, camera)["corner_rigid_max_mm"] == pytest.approx(1.0, rel=0.05)


def test_lost_corners_are_counted_and_left_out() -> None:
    restored, control = corners(), corners()
    restored[[3, 77]] = np.nan
    control[[77, 120, 121]] = np.nan
    restored[5] += 1.0
    figures = corner_distance(restored, control, CAMERA)
    assert (figures["corners_missing"], figures["corners_expected"]) == (4.0, 300.0)
    assert figures["corner_max_px"] == pytest.approx(np.sqrt(2), rel=0.03)


def test_too_few_corners_are_a_failed_step_and_not_nan() -> None:
    restored = np.full((300, 2), np.nan)
    restored[:5] = corners()[:5]
    with pytest.raises(StepError, match="5 of 300 corners found in both images, at least 6 needed"):
        corner_distance(restored, corners(), CAMERA)


def test_distorted_camera_or_misshapen_corners_are_refused() -> None:
    lens = Pinhole(CAMERA.size, CAMERA.K, np.array([0.1, 0, 0, 0, 0]), CAMERA.R, CAMERA.t)
    with pytest.raises(InputError, match="`camera` must be ideal"):
        corner_distance(corners(), corners(), lens)
    with pytest.raises(InputError, match="`control` must have the restored corners' shape"):
        corner_distance(corners(), corners()[1:], CAMERA)

"""Depth figures: closed forms in the world, and pixels that were left out are told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from deskew.errors import InputError, StepError
from deskew.metrics import depth_error
from deskew.projection import pixel_grid, rays
from deskew.types import DepthMap, Floats, Pinhole, Reason

# Looking down from 800 mm, as over a desk.
CAMERA = Pinhole(
    (40, 30), np.diag([100.0, 100.0, 1.0]), np.zeros(5), np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 800.0])
)
RAYS = rays(CAMERA, pixel_grid(CAMERA.size))
SECANTS = np.linalg.norm(RAYS, axis=-1)


def depth_map(z: Floats, camera: Pinhole = CAMERA) -> DepthMap:
    return DepthMap(z, np.where(np.isfinite(z), 0, Reason.WEAK).astype(np.uint8), camera)


def bed(camera: Pinhole = CAMERA) -> Floats:
    """World points of the bed Z = 0 at every pixel of the true camera."""
    return np.array([0.0, 0.0, 800.0]) + 800.0 * rays(camera, pixel_grid(camera.size))


def test_known_deviation_along_the_line_of_sight_gives_known_figures() -> None:
    along = np.linspace(-1, 1.2, 1200).reshape(30, 40)
    figures = depth_error(depth_map(800.0 + along / SECANTS), bed())
    assert figures["depth_raw_rms_mm"] == pytest.approx(np.sqrt((along**2).mean()), rel=1e-9)
    assert figures["depth_raw_p95_mm"] == pytest.approx(np.percentile(np.abs(along), 95), rel=1e-9)
    assert figures["depth_raw_max_mm"] == pytest.approx(1.2)
    assert figures["depth_raw_bias_mm"] == pytest.approx(0.1)
    assert figures["depth_coverage"] == 1.0


def test_desk_does_not_count_and_missing_page_pixels_lower_the_coverage() -> None:
    truth = bed()
    truth[:, 30:] = np.nan  # desk
    z = 800.0 + 1.0 / SECANTS
    z[:, 20:25] = np.nan  # page without depth
    z[:, 30:] = 900.0  # wild depth on the desk
    figures = depth_error(depth_map(z), truth, prefix="depth")
    expected = {"depth_rms_mm": 1.0, "depth_p95_mm": 1.0, "depth_max_mm": 1.0, "depth_bias_mm": 1.0}
    assert figures == pytest.approx(expected | {"depth_coverage": 25 / 30})


def test_a_camera_that_is_longer_and_farther_away_sees_the_same_page() -> None:
    """What a calibration cannot tell apart, and the page does not feel, is no error; a moved page is one."""
    grown = replace(CAMERA, K=np.diag([101.0, 101.0, 1.0]), t=np.array([0.0, 0.0, 808.0]))
    figures = depth_error(depth_map(np.full((30, 40), 808.0), grown), bed())
    assert figures["depth_raw_max_mm"] < 1e-9
    moved = depth_error(depth_map(np.full((30, 40), 808.5), grown), bed())
    assert moved["depth_raw_bias_mm"] == pytest.approx(
        0.5 * np.linalg.norm(rays(grown, pixel_grid(CAMERA.size)), axis=-1).mean()
    )


def test_nothing_measured_is_a_failed_step_and_bad_truth_is_refused() -> None:
    z = np.full((30, 40), 800.0)
    with pytest.raises(StepError, match="none of the page's 1200 pixels has depth"):
        depth_error(depth_map(z * np.nan), bed())
    with pytest.raises(InputError, match="`true_points` must have shape"):
        depth_error(depth_map(z), bed()[1:])
    with pytest.raises(InputError, match="`true_points` must be finite somewhere"):
        depth_error(depth_map(z), bed() * np.nan)

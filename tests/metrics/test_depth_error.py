"""Depth figures: closed forms, and pixels that were left out are told."""

from __future__ import annotations

import numpy as np
import pytest

from deskew.errors import InputError, StepError
from deskew.metrics import depth_error
from deskew.types import DepthMap, Floats, Pinhole, Reason

CAMERA = Pinhole((40, 30), np.diag([100.0, 100.0, 1.0]), np.zeros(5), np.eye(3), np.zeros(3))


def depth_map(z: Floats) -> DepthMap:
    return DepthMap(z, np.where(np.isfinite(z), 0, Reason.WEAK).astype(np.uint8), CAMERA)


def test_known_deviation_gives_known_figures() -> None:
    truth = np.full((30, 40), 800.0)
    z = truth + np.linspace(-1, 1, 1200).reshape(30, 40)
    figures = depth_error(depth_map(z), truth)
    assert figures["depth_raw_rms_mm"] == pytest.approx(1 / np.sqrt(3), rel=0.002)
    assert figures["depth_raw_p95_mm"] == pytest.approx(0.95, rel=0.002)
    assert figures["depth_raw_max_mm"] == pytest.approx(1.0)
    assert figures["depth_coverage"] == 1.0


def test_desk_does_not_count_and_missing_page_pixels_lower_the_coverage() -> None:
    truth = np.full((30, 40), 800.0)
    truth[:, 30:] = np.nan  # desk
    z = np.full((30, 40), 801.0)
    z[:, 20:25] = np.nan  # page without depth
    z[:, 30:] = 900.0  # wild depth on the desk
    figures = depth_error(depth_map(z), truth, prefix="depth")
    assert figures == pytest.approx(
        {"depth_rms_mm": 1.0, "depth_p95_mm": 1.0, "depth_max_mm": 1.0, "depth_coverage": 25 / 30}
    )


def test_nothing_measured_is_a_failed_step_and_bad_truth_is_refused() -> None:
    truth = np.full((30, 40), 800.0)
    with pytest.raises(StepError, match="none of the page's 1200 pixels has depth"):
        depth_error(depth_map(truth * np.nan), truth)
    with pytest.raises(InputError, match="`true_z` must have the depth map's shape"):
        depth_error(depth_map(truth), truth[1:])
    with pytest.raises(InputError, match="`true_z` must be finite somewhere"):
        depth_error(depth_map(truth), truth * np.nan)

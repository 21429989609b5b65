"""Deliberately wrong calibrations: what a figure does not see of them, it does not vouch for."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import cv2
import numpy as np

from deskew import projection
from deskew.types import Calibration, Floats, Pinhole

_PERCENT = 1.0
_YAW_DEG = 0.1


def longer_baseline(calibration: Calibration, percent: float = _PERCENT) -> Calibration:
    """Move the projector away from the camera, so that the distance of their centres grows by so much."""
    camera = projection.centre(calibration.camera)
    eye = camera + (1 + percent / 100) * (projection.centre(calibration.projector) - camera)
    return replace(calibration, projector=_seen_from(calibration.projector, calibration.projector.R, eye))


def longer_focal_length(calibration: Calibration, percent: float = _PERCENT) -> Calibration:
    """Make both focal lengths of the camera longer; its pose, its principal point and the projector stay."""
    K = calibration.camera.K.copy()
    K[:2, :2] *= 1 + percent / 100
    return replace(calibration, camera=replace(calibration.camera, K=K))


def turned_projector(calibration: Calibration, yaw_deg: float = _YAW_DEG) -> Calibration:
    """Turn the projector about the upright axis through its own centre."""
    projector = calibration.projector
    yaw, _ = cv2.Rodrigues(np.array([0.0, np.radians(yaw_deg), 0.0]))
    return replace(calibration, projector=_seen_from(projector, yaw @ projector.R, projection.centre(projector)))


def _seen_from(device: Pinhole, R: Floats, eye: Floats) -> Pinhole:
    return replace(device, R=R, t=-R @ eye)


FAULTS: Mapping[str, Callable[[Calibration], Calibration]] = {
    "none": lambda calibration: calibration,
    "baseline": longer_baseline,
    "focal": longer_focal_length,
    "yaw": turned_projector,
}
"""By name; "none" is the estimated calibration itself, the others are 1 % or 0.1 degrees off."""

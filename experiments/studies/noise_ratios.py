"""Each accuracy figure as a multiple of what noise alone would make of it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from data_synth import BallPlate, Checkerboard, Rig
from deskew import projection
from deskew.acquisition import DISCARDED_SHARE, Sphere, fit_plane
from deskew.types import Calibration, Floats
from experiments.studies.bounds import (
    SightNoise,
    corner_sigma_px,
    root_mean_square,
    sight_noise,
    sphere_covariance,
    trimmed_range,
)
from experiments.studies.targets import Measured, Target, on_ball


def noise_ratios(
    rig: Rig, target: Target, found: Measured, calibration: Calibration, shown: Mapping[str, float]
) -> dict[str, float]:
    """Return each figure over what noise alone makes of it.

    Parameters
    ----------
    rig : Rig
        The true bench.
    target, found, calibration : Target, Measured, Calibration
        What was scanned, and through which calibration.
    shown : mapping
        The target's figures.

    Returns
    -------
    dict
        `bound_depth_mm`, the root mean square of depth that noise alone makes on this target, and `*_ratio`.
    """
    noise = sight_noise(rig, target.truth, target.page, calibration.camera)
    true_points = found.true_points
    bound = root_mean_square(noise.point)
    ratios = {"bound_depth_mm": bound, "depth_rms_ratio": shown["depth_raw_rms_mm"] / bound}
    sights = true_points - projection.centre(rig.camera)
    sights = sights / np.linalg.norm(sights, axis=-1, keepdims=True)
    if target.body is not None:
        return ratios | _ball_ratios(target.body, true_points, sights, noise, shown)
    normal, _ = fit_plane(true_points[np.isfinite(true_points[..., 0])])
    across = noise.point * np.abs(sights @ normal)
    ratios["plane_rms_ratio"] = shown["plane_rms_mm"] / root_mean_square(across)
    ratios["flatness_ratio"] = shown["flatness_mm"] / trimmed_range(across, DISCARDED_SHARE)
    if isinstance(target.page, Checkerboard):
        ratios["length_error_ratio"] = shown["length_error_mm"] / _length_bound(rig, target, target.page)
    return ratios


def _ball_ratios(
    body: BallPlate, true_points: Floats, sights: Floats, noise: SightNoise, shown: Mapping[str, float]
) -> dict[str, float]:
    forms, covariances = [], []
    for ball, centre in enumerate(body.centres):
        probed = on_ball(body, true_points, ball) & np.isfinite(noise.point)
        points = true_points[probed]
        facing = np.abs((sights[probed] * (points - centre)).sum(axis=1)) / body.radius_mm
        forms.append(trimmed_range(noise.point[probed] * facing, DISCARDED_SHARE))
        sphere = Sphere(centre, body.radius_mm)
        covariances.append(sphere_covariance(points, noise.averaged[probed] * facing, sphere))
    along = (body.centres[1] - body.centres[0]) / body.spacing_mm
    spacing_variance = sum(float(along @ covariance[:3, :3] @ along) for covariance in covariances)
    size_sigma = 2 * max(float(np.sqrt(covariance[3, 3])) for covariance in covariances)
    return {
        "probing_form_ratio": shown["probing_form_mm"] / max(forms),
        "probing_size_ratio": abs(shown["probing_size_mm"]) / size_sigma,
        "sphere_spacing_ratio": abs(shown["sphere_spacing_error_mm"]) / np.sqrt(spacing_variance),
    }


def _length_bound(rig: Rig, target: Target, page: Checkerboard) -> float:
    """Return the deviation of a length between two corners that are both found as well as one frame allows [mm]."""
    ink, paper = np.percentile(target.capture.white, [25.0, 75.0])
    mm_px = float(np.linalg.norm(projection.centre(rig.camera)) / rig.camera.K[0, 0])
    corner = corner_sigma_px(float(paper - ink), float(ink), page.square_mm / mm_px, rig.config)
    return float(np.sqrt(2.0)) * corner * mm_px

"""The test bodies of the accuracy experiment, scanned, and what they say of a calibration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

import data_synth
from data_synth import BallPlate, Checkerboard, Page, Truth
from deskew import acquisition, metrics, pipeline, restoration
from deskew.acquisition import DepthSettings
from deskew.recipes import Recipe
from deskew.types import Calibration, Capture, Correspondence, DepthMap, Floats
from experiments.studies.bench import Bench
from experiments.studies.views import seen_corners

PROBED_DEG = 50.0
"""How far down from its top a ball is probed: 5 degrees short of where it meets the plate."""

LENGTH_MIN_MM = 290.0
"""Lengths that a person would hold out to check a scanner."""

_RADIUS_PX = 6


@dataclass(frozen=True, slots=True)
class Target:
    """One body, photographed and decoded.

    Attributes
    ----------
    page : Page
        What is printed on it.
    body : BallPlate or None
        Its balls; None for a plane.
    capture, truth : Capture, Truth
        The photographs, and what they show; only figures see the latter.
    correspondence : Correspondence
        The capture, decoded.
    """

    page: Page
    body: BallPlate | None
    capture: Capture
    truth: Truth
    correspondence: Correspondence


@dataclass(frozen=True, slots=True)
class Measured:
    """A target's depth map under some calibration.

    Attributes
    ----------
    depth : DepthMap
        On the undistorted grid.
    true_points : (H, W, 3) array
        What the same pixels show in truth [mm]; NaN beside the target.
    """

    depth: DepthMap
    true_points: Floats


def photographed(
    bench: Bench, body: BallPlate | data_synth.TrueSheet, page: Page, rng: np.random.Generator, scan: Recipe
) -> Target:
    """Photograph a body and decode what was seen."""
    balls = body if isinstance(body, BallPlate) else None
    sheet = body.sheet if isinstance(body, BallPlate) else body
    capture, truth = data_synth.render(bench.rig, sheet, page, rng)
    correspondence = pipeline.decode(capture, settings=pipeline.decoder_for(scan, capture.pattern))
    if scan.ink:
        correspondence = acquisition.correct_ink(bench.calibration, correspondence, capture)
    return Target(page, balls, capture, truth, correspondence)


def measured(
    target: Target,
    calibration: Calibration,
    gates: DepthSettings | None = None,
    true_points: Floats | None = None,
) -> Measured:
    """Triangulate a target; `true_points` are those of an earlier look through the same camera, if there was one."""
    depth = acquisition.depth_map(calibration, target.correspondence, gates)
    if true_points is None:
        true_points = target.truth.points_at(restoration.undistortion_map(calibration.camera).astype(np.float64))
    return Measured(depth, true_points)


def figures(target: Target, found: Measured, calibration: Calibration) -> dict[str, float]:
    """Return every figure that a target has, by metric."""
    shown = metrics.depth_error(found.depth, found.true_points)
    if target.body is not None:
        return shown | _ball_figures(target.body, found)
    # Only the plane itself is fitted: desk beside it is none of it.
    points = acquisition.depth_points(found.depth, np.isfinite(found.true_points[..., 0]))
    deviation = acquisition.plane_deviation(points)
    shown |= {
        "plane_mean_abs_mm": deviation.mean_abs_mm,
        "plane_rms_mm": deviation.rms_mm,
        "plane_max_mm": deviation.max_mm,
        "flatness_mm": acquisition.flatness_mm(points),
    }
    if isinstance(target.page, Checkerboard):
        errors = _length_errors(target, target.page, found.depth, calibration)
        shown |= {
            "length_error_mm": float(np.sqrt((errors**2).mean())),
            "length_error_max_mm": float(np.abs(errors).max()),
            "lengths": len(errors),
        }
    return shown


def on_ball(body: BallPlate, true_points: Floats, ball: int) -> npt.NDArray[np.bool_]:
    """Mark the pixels that show the probed part of a ball, (H, W)."""
    return np.asarray(body.polar_deg(true_points)[ball] <= PROBED_DEG)


def _ball_figures(body: BallPlate, found: Measured) -> dict[str, float]:
    probings = [
        acquisition.probe_sphere(
            acquisition.depth_points(found.depth, on_ball(body, found.true_points, ball)), body.radius_mm
        )
        for ball in range(len(body.centres))
    ]
    first, second = (probing.sphere for probing in probings)
    return {
        "probing_form_mm": max(probing.form_mm for probing in probings),
        "probing_size_mm": max((probing.size_mm for probing in probings), key=abs),
        "sphere_spacing_error_mm": acquisition.spacing_error_mm(first, second, body.spacing_mm),
        "probed_points": sum(probing.n for probing in probings),
    }


def _length_errors(target: Target, page: Checkerboard, depth: DepthMap, calibration: Calibration) -> Floats:
    """Errors of the longest distances between printed corners [mm]."""
    corners = page.corners.reshape(-1, 2)
    seeds = seen_corners(target.truth, corners, calibration.camera, depth.camera)
    image = restoration.undistorted_view(target.capture.white, calibration.camera)
    found = acquisition.scanned_points(depth, acquisition.refine_saddle(image, seeds), _RADIUS_PX)
    return acquisition.length_errors(found, corners, LENGTH_MIN_MM)

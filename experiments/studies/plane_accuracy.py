"""Section 2.5 and beyond: how exact a scan is, on planes as in the paper and on balls as metrology asks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

import data_synth
from data_synth import Blank, Checkerboard, Page
from deskew import projection
from deskew.acquisition import DepthSettings
from deskew.errors import StepError
from deskew.types import Calibration
from experiments.reporting import Layout
from experiments.settings import Config
from experiments.studies.accuracy_layout import LAYOUT
from experiments.studies.bench import Bench, calibrated_bench
from experiments.studies.depth_picture import depth_error_picture
from experiments.studies.faults import FAULTS
from experiments.studies.methods import require_methods
from experiments.studies.noise_ratios import noise_ratios
from experiments.studies.recipes import configured
from experiments.studies.study import Study
from experiments.studies.targets import Measured, Target, figures, measured, photographed
from experiments.studies.trial_sheets import refuse_sheets, severity
from experiments.trials import Outcome, Recorder, TrialKey

_PAGES: Mapping[str, Page] = {
    "white": Blank(),
    "checkered": Checkerboard(),
    "sphere": Blank(),
    "sphere/checkered": Checkerboard(),
}
# Culling and working volume refuse much of what a wrong calibration makes. Opened, a figure has to see it by itself.
_OPEN = DepthSettings(epipolar_tolerance_px=20.0, z_min_mm=-60.0)
# Which target shows which of the figures that are asked of a wrong calibration.
_FAULT_FIGURES = {
    "white": ("plane_mean_abs_mm", "plane_rms_mm", "flatness_mm", "depth_raw_rms_mm", "depth_raw_bias_mm"),
    "checkered": ("length_error_mm",),
    "sphere": ("probing_form_mm", "probing_size_mm", "sphere_spacing_error_mm"),
}
_PICTURED = 3
# What a fault does hardly depends on the pose: three tell how hardly.
_FAULTED = 3


@dataclass(frozen=True, slots=True)
class _Seen:
    """A target through the estimated calibration, with its figures."""

    target: Target
    found: Measured
    shown: Mapping[str, float]


class PlaneAccuracy(Study):
    """Planes and balls in several poses through the estimated calibration; a trial is one pose of each.

    Conditions
    ----------
    `white`
        A blank plane, as in the paper: no ink, so it flatters.
    `checkered`
        The same plane with the page of experiment I on it; its corners give lengths that no calibration has seen.
    `sphere`, `sphere/checkered`
        Two balls let into a plate, blank and printed.
    `fault/none`, `fault/baseline`, `fault/focal`, `fault/yaw`
        The figures of the blank plane, the checkered plane's lengths and the blank balls, from the same photographs
        but through a calibration that is deliberately wrong: see :mod:`experiments.studies.faults`. In the first three
        poses.
    """

    layout: ClassVar[Layout] = LAYOUT

    def plan(self, config: Config) -> list[TrialKey]:
        """Plan one trial a pose."""
        require_methods(config)
        refuse_sheets(config, "this experiment scans planes")
        return Study.plan(self, config)

    def prepare(self, config: Config) -> Bench:
        """Calibrate once for all trials."""
        return calibrated_bench(config, configured(config.scan).mode)

    def run(self, config: Config, shared: Any, key: TrialKey) -> Outcome:
        """Scan the bodies in one pose each, then look at them again through wrong calibrations."""
        bench: Bench = shared
        record, rng = Recorder(key), key.generator()
        # The first lies flat; the others lean to all sides.
        tilt = 0.0 if key.trial == 0 else float(rng.uniform(2.0, 15.0))
        azimuth = float(rng.uniform(0.0, 360.0))
        plane = data_synth.plane(tilt_deg=tilt, azimuth_deg=azimuth)
        plate = data_synth.ball_plate(tilt_deg=tilt / 3.0, azimuth_deg=azimuth)
        seen: dict[str, _Seen] = {}
        for condition, page in _PAGES.items():
            body = plate if condition.startswith("sphere") else plane
            with record.attempt(condition):
                with record.stage("scan", condition):
                    target = photographed(bench, body, page, rng, configured(config.scan))
                seen[condition] = _measure(record, condition, bench, target)
                record.add(condition, "-", {"tilt_deg": tilt / 3.0 if body is plate else tilt} | bench.residuals())
        for name, wrong in FAULTS.items() if key.trial < _FAULTED else ():
            with record.attempt(f"fault/{name}"), record.stage("faults"):
                _look_through(record, f"fault/{name}", bench, wrong(bench.calibration), seen)
        return record.outcome()


def _measure(record: Recorder, condition: str, bench: Bench, target: Target) -> _Seen:
    """Record the figures of one target, their ratios to what noise makes, and its depth error as a picture."""
    with record.stage("depth", condition):
        found = measured(target, bench.calibration)
    sheet = target.truth.sheet
    shown = figures(target, found, bench.calibration)
    record.add(condition, "-", shown)
    record.add(condition, "-", severity(sheet))
    with record.stage("bounds", condition):
        record.add(condition, "-", noise_ratios(bench.rig, target, found, bench.calibration, shown))
    if record.key.trial < _PICTURED:
        name = condition.replace("/", "_")
        record.picture(f"{name}_{record.key.trial}", depth_error_picture(found.depth, found.true_points))
    return _Seen(target, found, shown)


def _look_through(
    record: Recorder, condition: str, bench: Bench, calibration: Calibration, seen: Mapping[str, _Seen]
) -> None:
    """Record what each figure says of a calibration, what culling keeps under it, and how far it is off."""
    for name, wanted in _FAULT_FIGURES.items():
        if name not in seen:
            raise StepError(f"{condition} needs the scan of `{name}`, which failed.")
        shown = seen[name].shown
        if calibration is not bench.calibration:
            found = _measured_again(seen[name], bench, calibration, _OPEN)
            shown = figures(seen[name].target, found, calibration)
        record.add(condition, "-", {metric: shown[metric] for metric in wanted})
    gated = _measured_again(seen["white"], bench, calibration, None)
    page = np.isfinite(gated.true_points[..., 0])
    record.add(condition, "-", {"depth_coverage": float(np.isfinite(gated.depth.z[page]).mean())})
    record.add(condition, "-", _calibration_error(bench, calibration))


def _measured_again(here: _Seen, bench: Bench, calibration: Calibration, gates: DepthSettings | None) -> Measured:
    """Triangulate anew; through the same camera the same pixels show the same points."""
    same = calibration.camera is bench.calibration.camera
    return measured(here.target, calibration, gates, here.found.true_points if same else None)


def _calibration_error(bench: Bench, calibration: Calibration) -> dict[str, float]:
    """Where the camera is thought to stand along its own axis, and how long its focal length, minus the truth.

    The two go together: a camera thought farther away with a longer lens sees the same. Its own z follows, points of
    the world hardly do; that is why depth is judged in the world.
    """
    true, found = bench.rig.camera, calibration.camera
    moved = projection.centre(found) - projection.centre(true)
    return {
        "calib_camera_centre_error_mm": float(moved @ true.R[2]),
        "calib_camera_focal_error_px": float(found.K[0, 0] - true.K[0, 0]),
    }

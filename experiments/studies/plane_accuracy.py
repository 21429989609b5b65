"""Section 2.5: how far the points of a scanned plane lie from the plane fitted to them."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

import data_synth
from data_synth import Blank, Checkerboard, Page
from deskew import acquisition, metrics, pipeline, restoration
from deskew.acquisition import SweepSettings
from deskew.errors import require
from experiments.reporting import Column, Layout, Plot
from experiments.settings import Config, ScanSettings
from experiments.studies.bench import Bench, calibrated_bench
from experiments.studies.methods import require_methods
from experiments.studies.scanned import scanned_points
from experiments.studies.study import Study
from experiments.studies.views import seen_corners
from experiments.trials import Outcome, Recorder, TrialKey

_PAPER = {"white": "0.31", "checkered": "0.31"}

# Lengths that a person would hold out to check a scanner.
_LENGTH_MIN_MM = 290.0
_RADIUS_PX = 6


class PlaneAccuracy(Study):
    """Planes at several orientations through the estimated calibration; a trial is one orientation.

    Conditions
    ----------
    `white`
        A blank plane, as in the paper: no ink, so it flatters.
    `checkered`
        The same plane with the page of experiment I on it; its corners give lengths that no calibration has seen.
    """

    layout: ClassVar[Layout] = Layout(
        "Accuracy of the reconstruction (section 2.5)",
        "Deviation of the scanned points from their best-fit plane, over planes at several orientations. The paper "
        "gives the mean deviation, which is nearly blind to a wrong calibration: the error of held-out lengths stands "
        "beside it.",
        (
            Column("plane_mean_abs_mm", "mean deviation [mm]", 3, _PAPER, headline=True),
            Column("plane_rms_mm", "RMS [mm]", 3, headline=True),
            Column("plane_max_mm", "max [mm]", 3, headline=True),
            Column("length_error_mm", "error of 300 mm, RMS [mm]", 3, headline=True, rms=True),
            Column("depth_raw_rms_mm", "depth RMS [mm]", 3, headline=True),
            Column("depth_raw_p95_mm", "depth p95 [mm]", 3),
            Column("depth_coverage", "coverage", 4, headline=True),
            Column("tilt_deg", "tilt [deg]", 1),
            Column("calib_camera_rms_px", "camera RMS [px]", 3),
            Column("calib_projector_rms_px", "projector RMS [px]", 3),
        ),
        (Plot("plane_mean_abs_mm", "plane_mean_abs_mm", "mean deviation from the best-fit plane [mm]", 0.31),),
    )

    def plan(self, config: Config) -> list[TrialKey]:
        """Plan one trial an orientation."""
        require_methods(config)
        require(not config.sheet.paths, "sheet.paths", "be left out: this experiment scans planes", config.sheet.paths)
        return Study.plan(self, config)

    def prepare(self, config: Config) -> Bench:
        """Calibrate once for all trials."""
        return calibrated_bench(config)

    def run(self, config: Config, shared: Any, key: TrialKey) -> Outcome:
        """Scan one plane, blank and checkered."""
        bench: Bench = shared
        record, rng = Recorder(key), key.generator()
        # The first lies flat; the others lean to all sides.
        tilt = 0.0 if key.trial == 0 else float(rng.uniform(2.0, 15.0))
        azimuth = float(rng.uniform(0.0, 360.0))
        for condition, page in (("white", Blank()), ("checkered", Checkerboard())):
            with record.attempt(condition):
                _measure(record, condition, bench, page, (tilt, azimuth), rng, config.scan)
        return record.outcome()


def _measure(
    record: Recorder,
    condition: str,
    bench: Bench,
    page: Page,
    lean_deg: tuple[float, float],
    rng: np.random.Generator,
    settings: ScanSettings,
) -> None:
    camera = bench.calibration.camera
    sheet = data_synth.plane(page.page_size_mm, tilt_deg=lean_deg[0], azimuth_deg=lean_deg[1])
    with record.stage("scan", condition):
        capture, truth = data_synth.render(bench.rig, sheet, page, rng)
        correspondence = pipeline.decode(capture, SweepSettings(mode=settings.mode))
        if settings.ink:
            correspondence = acquisition.correct_ink(bench.calibration, correspondence, capture)
    with record.stage("depth", condition):
        depth = acquisition.depth_map(bench.calibration, correspondence)
    # Only the plane itself is fitted: desk beside it is none of it.
    true_points = truth.points_at(restoration.undistortion_map(camera).astype(np.float64))
    deviation = acquisition.plane_deviation(acquisition.depth_points(depth, np.isfinite(true_points[..., 0])))
    record.add(condition, "-", metrics.depth_error(depth, true_points))
    shape = {"tilt_deg": lean_deg[0], "slope_p90_deg": sheet.slope_p90_deg, "relief_mm": sheet.relief_mm}
    record.add(condition, "-", bench.residuals() | shape)
    record.add(
        condition,
        "-",
        {
            "plane_mean_abs_mm": deviation.mean_abs_mm,
            "plane_rms_mm": deviation.rms_mm,
            "plane_max_mm": deviation.max_mm,
        },
    )
    if isinstance(page, Checkerboard):
        corners = page.corners.reshape(-1, 2)
        seeds = seen_corners(truth, corners, camera, depth.camera)
        image = restoration.undistorted_view(capture.white, camera)
        found = scanned_points(depth, acquisition.refine_saddle(image, seeds), _RADIUS_PX)
        errors = acquisition.length_errors(found, corners, _LENGTH_MIN_MM)
        record.add(condition, "-", {"length_error_mm": float(np.sqrt((errors**2).mean()))})

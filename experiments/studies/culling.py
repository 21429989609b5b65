"""Section 2.3: what culling by epipolar constraints takes of the outliers and of the rest, and what is left to do."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

import data_synth
from data_synth import Checkerboard, Truth
from deskew import acquisition, metrics, pipeline, projection, restoration
from deskew.acquisition import DepthSettings, SweepSettings
from deskew.types import Calibration, Correspondence, Floats, PatternKind, Pinhole, Reason
from experiments.reporting import Layout
from experiments.settings import Config, CullingSettings
from experiments.studies.bench import Bench, calibrated_bench, configured_rig
from experiments.studies.culling_layout import FULL_COLOUR_MM, LAYOUT, PICTURED_GATES, PICTURED_NOISE
from experiments.studies.depth_picture import depth_error_picture
from experiments.studies.methods import require_methods
from experiments.studies.recipes import configured
from experiments.studies.study import Study
from experiments.studies.trial_sheets import require_sheets, severity, sheet_inputs, trial_sheet
from experiments.trials import Outcome, Recorder, TrialKey

Mask = npt.NDArray[np.bool_]

# Whatever sample is the brightest, pixel by pixel: all is left to the gates that follow.
_UNGUARDED = SweepSettings(min_snr=1e-3, guided_snr=1e-3, shadow_snr=1e-3, second_peak_ratio=1.0, width_ratio=1e6)
_GATES = DepthSettings()
_OPEN: dict[str, Any] = {"z_min_mm": -1e9, "z_max_mm": 1e9, "neighbour_mm": 1e9, "support": 0.0, "jump_mm": 1e9}
_CHOICES: Mapping[str, DepthSettings] = {
    "no_gate": DepthSettings(epipolar_tolerance_px=1e9, **_OPEN),
    "epipolar": DepthSettings(**_OPEN),
    "others": replace(_GATES, epipolar_tolerance_px=1e9),
    "all": _GATES,
}
_PICTURED = 2


class Culling(Study):
    """Crumpled checkerboards photographed at several noise levels, decoded with and without guards, and culled.

    A trial is one page at every noise. All are looked at through one calibration, made at `rig.noise_scale`.

    Conditions
    ----------
    `page`
        How bent the pages are, and what counts as an outlier.
    `READING/culled/noise=N/tolerance=T`
        READING is `guarded`, the sweeps read as `scan.*` says (by default as the paper does), with what this project
        asks of a peak; or `unguarded`, the brightest frame of each pixel. N is the noise of the page's frames, T how
        far a point may lie from its epipolar line [projector px].
    `READING/gated/noise=N/no_gate`, `.../epipolar`, `.../others`, `.../all`
        The depth map after no gate, after epipolar culling alone, after the other gates alone, and after all.
    """

    layout: ClassVar[Layout] = LAYOUT

    def plan(self, config: Config) -> list[TrialKey]:
        """Plan one trial a page."""
        require_methods(config)
        require_sheets(config)
        return Study.plan(self, config)

    def inputs(self, config: Config) -> dict[str, Path]:
        """Name the given sheets."""
        return sheet_inputs(config)

    def prepare(self, config: Config) -> Bench:
        """Calibrate once for all trials and all noise."""
        return calibrated_bench(config, configured(config.scan).mode)

    def run(self, config: Config, shared: Any, key: TrialKey) -> Outcome:
        """Photograph one page at every noise, read it both ways, and cull."""
        bench: Bench = shared
        record, rng = Recorder(key), key.generator()
        sheet, draw = trial_sheet(config, key, rng), int(rng.integers(1 << 62))
        record.add("page", "-", severity(sheet) | {"outlier_limit_mm": config.culling.outlier_mm})
        seen: _Seen | None = None
        guarded = pipeline.decoder_for(configured(config.scan), PatternKind.LINE_SWEEP)
        for noise in config.culling.noise_scales:
            rig = configured_rig(replace(config.rig, noise_scale=noise))
            for reading, settings in (("guarded", guarded), ("unguarded", _UNGUARDED)):
                # The same frames for both: a sweep is rendered while it is read.
                capture, truth = data_synth.render(rig, sheet, Checkerboard(), np.random.default_rng(draw))
                with record.stage("decode"):
                    decoded = pipeline.decode(capture, settings)
                with record.stage("cull"):
                    # The truth is the page's own, whatever the noise.
                    seen = seen or _Seen.of(truth, bench.calibration.camera)
                    page = _Page(record, f"{reading}/{{}}/noise={noise:g}", bench.calibration, decoded, seen)
                    page.measure_culling(config.culling)
                    page.measure_depth(pictured=reading == "unguarded" and noise == PICTURED_NOISE)
        return record.outcome()


@dataclass(frozen=True, slots=True)
class _Seen:
    """The true points that pixels show, (H, W, 3) [mm], NaN off the page: of raw pixels and of the undistorted grid."""

    raw: Floats
    undistorted: Floats

    @classmethod
    def of(cls, truth: Truth, camera: Pinhole) -> _Seen:
        undistorted = truth.points_at(restoration.undistortion_map(camera).astype(np.float64))
        return cls(truth.points_at(projection.pixel_grid(camera.size)), undistorted)


@dataclass(frozen=True, slots=True)
class _Page:
    """One page at one noise in one reading, and its truth; `place` is the condition with a gap for what is measured."""

    record: Recorder
    place: str
    calibration: Calibration
    decoded: Correspondence
    true: _Seen

    def measure_culling(self, own: CullingSettings) -> None:
        """Count the outliers, and what culling at each tolerance takes of them and of the rest."""
        camera, points = self.calibration.camera, self.true.raw
        page = np.isfinite(points[..., 0])
        seen = page & (self.decoded.reason == Reason.OK)
        true_z = points @ camera.R[2] + camera.t[2]
        off = np.abs(acquisition.triangulate(self.calibration, self.decoded) - true_z)
        outlier = ~(off[seen] <= own.outlier_mm)  # a ray that meets none is one
        distance = np.abs(acquisition.epipolar_distance(self.calibration, self.decoded)[seen])
        decoded = {"decoded_percent": 100.0 * seen.sum() / page.sum()}
        for tolerance in own.tolerances_px:
            figures = decoded | culling_figures(outlier, ~(distance <= tolerance))
            self.record.add(f"{self.place.format('culled')}/tolerance={tolerance:g}", "-", figures)

    def measure_depth(self, *, pictured: bool) -> None:
        """Measure the depth map after each choice of gates."""
        trial, points = self.record.key.trial, self.true.undistorted
        for name, gates in _CHOICES.items():
            condition = f"{self.place.format('gated')}/{name}"
            with self.record.attempt(condition):
                depth = acquisition.depth_map(self.calibration, self.decoded, gates)
                self.record.add(condition, "-", metrics.depth_error(depth, points))
                if pictured and name in PICTURED_GATES and trial < _PICTURED:
                    self.record.picture(f"page_{trial}_{name}", depth_error_picture(depth, points, FULL_COLOUR_MM))


def culling_figures(outlier: Mask, culled: Mask) -> dict[str, float]:
    """Compare what was culled with what should have been.

    Parameters
    ----------
    outlier, culled : (N,) bool arrays
        The decoded pixels.

    Returns
    -------
    dict
        `outliers_percent` and `culled_percent` of all; `recall_percent`, the share of the outliers that was culled, if
        there are any; `precision_percent`, the share of the culled that are outliers, if any was; and
        `good_lost_percent`, the share of the others that was culled too.
    """
    both = float((outlier & culled).sum())
    figures = {
        "outliers_percent": 100.0 * float(outlier.mean()),
        "culled_percent": 100.0 * float(culled.mean()),
        "good_lost_percent": 100.0 * float(culled[~outlier].mean()),
    }
    if outlier.any():
        figures["recall_percent"] = 100.0 * both / float(outlier.sum())
    if culled.any():
        figures["precision_percent"] = 100.0 * both / float(culled.sum())
    return figures

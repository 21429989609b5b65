"""How each property of the rig tells on the accuracy: one is changed at a time, and the rig calibrated anew."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import Any, ClassVar

import data_synth
from data_synth import Blank, Checkerboard
from experiments.reporting import Column, Layout, Plot
from experiments.settings import Config
from experiments.studies.accuracy_layout import FIGURES
from experiments.studies.bench import calibrated_bench
from experiments.studies.methods import require_methods
from experiments.studies.noise_ratios import noise_ratios
from experiments.studies.recipes import configured
from experiments.studies.study import Study
from experiments.studies.targets import figures, measured, photographed
from experiments.studies.trial_sheets import refuse_sheets, severity
from experiments.trials import Outcome, Recorder, TrialKey, trial_keys

_DEFAULT = "default"
# Every pose leans alike, so that what differs between two lines is the rig.
_TILT_DEG = 8.0


class Ablations(Study):
    """Blank plane, printed plane and blank balls on changed rigs; a trial is one pose on one rig.

    Conditions
    ----------
    `default`
        The rig as `rig.*` gives it.
    `KEY=VALUE`
        The same with `rig.KEY` changed to one of the values of `ablations.KEY`.
    """

    layout: ClassVar[Layout] = Layout(
        "Ablations of the rig",
        "One property of the rig is changed at a time, both devices are calibrated anew, and a blank plane, a printed "
        "plane and two blank balls are scanned in leaning poses; n counts poses, each with a calibration of its own. "
        "Depth and coverage are the blank plane's unless they say printed: where noise leaves ink without depth, the "
        "printed figure improves and its coverage falls. The last columns say what noise alone would make of depth.",
        (
            *(replace(column, headline=True) for column in FIGURES),
            Column("depth_printed_rms_mm", "printed, depth RMS [mm]", 3, headline=True),
            Column("depth_printed_coverage", "printed, coverage", 4, headline=True),
            Column("bound_depth_mm", "depth RMS by noise alone [mm]", 3, headline=True),
            Column("depth_rms_ratio", "depth RMS / bound", 2, headline=True),
            Column("slope_p90_deg", "p90 slope [deg]", 1, headline=True),
            Column("relief_mm", "relief [mm]", 1, headline=True),
            Column("calib_camera_rms_px", "camera RMS [px]", 3),
            Column("calib_projector_rms_px", "projector RMS [px]", 3),
        ),
        (Plot("depth_raw_rms_mm", "depth_raw_rms_mm", "depth error of a blank plane, RMS [mm]"),),
    )

    def plan(self, config: Config) -> list[TrialKey]:
        """Plan each pose on the default rig and on every changed one; at `smoke` on one changed rig a key."""
        require_methods(config)
        refuse_sheets(config, "this experiment scans planes")
        return [key for condition in (_DEFAULT, *_changes(config)) for key in trial_keys(config, condition)]

    def run(self, config: Config, shared: Any, key: TrialKey) -> Outcome:
        """Calibrate the rig of this condition and scan one pose."""
        record, rng = Recorder(key), key.generator()
        azimuth, how = float(rng.uniform(0.0, 360.0)), configured(config.scan)
        with record.attempt(key.condition):
            changes = _changes(config).get(key.condition, {})
            with record.stage("calibrate"):
                bench = calibrated_bench(replace(config, rig=replace(config.rig, **changes)), how.mode, key.trial)
            plane = data_synth.plane(tilt_deg=_TILT_DEG, azimuth_deg=azimuth)
            balls = data_synth.ball_plate(tilt_deg=_TILT_DEG / 3, azimuth_deg=azimuth)
            shown: dict[str, float] = {}
            for body, page in ((balls, Blank()), (plane, Checkerboard()), (plane, Blank())):
                with record.stage("scan"):
                    target = photographed(bench, body, page, rng, how)
                found = measured(target, bench.calibration)
                # The blank plane comes last: its depth is the one that keeps the name.
                shown |= figures(target, found, bench.calibration)
                if page == Checkerboard():
                    shown["depth_printed_rms_mm"] = shown["depth_raw_rms_mm"]
                    shown["depth_printed_coverage"] = shown["depth_coverage"]
            ratios = noise_ratios(bench.rig, target, found, bench.calibration, shown)
            wanted = {column.metric for column in self.layout.columns}
            every = shown | ratios | severity(plane) | bench.residuals()
            record.add(key.condition, "-", {name: value for name, value in every.items() if name in wanted})
        return record.outcome()


def _changes(config: Config) -> dict[str, dict[str, Any]]:
    """Return what each condition changes of `rig`."""
    lists: dict[str, list[Any]] = asdict(config.ablations)
    n_values = 1 if config.budget.name == "smoke" else None
    return {f"{name}={value:g}": {name: value} for name, values in lists.items() for value in values[:n_values]}

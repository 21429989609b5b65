"""How restored pages take it when one thing is changed: severity, noise, filter, mesh, rest lengths, calibration."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import data_synth
from data_synth import Checkerboard, Truth
from deskew import pipeline
from deskew.errors import require
from deskew.recipes import recipe_for
from deskew.types import Calibration, Capture
from experiments.reporting import Layout
from experiments.settings import Config, ScanSettings
from experiments.studies.bench import Bench, calibrated_bench
from experiments.studies.checkered import CheckeredPage
from experiments.studies.faults import longer_baseline, longer_focal_length, turned_projector
from experiments.studies.page_scans import PageScans, Shape
from experiments.studies.recipes import calibration_mode
from experiments.studies.sensitivity_layout import LAYOUT
from experiments.studies.study import Study
from experiments.studies.trial_sheets import require_sheets, severity, sheet_inputs, trial_sheet
from experiments.studies.views import DETECTORS
from experiments.trials import Outcome, Recorder, TrialKey, trial_keys

# Rest lengths of each method that the study can switch.
_RESTS = {"spring": "section", "paper_euler": "chord", "paper_rk4": "chord"}
_FAULTS: Mapping[str, Callable[[Calibration, float], Calibration]] = {
    "projector_yaw_deg": turned_projector,
    "baseline_percent": longer_baseline,
    "focal_percent": longer_focal_length,
}
_SLOPE, _NOISE, _MESH = "slope_p90_deg", "noise_scale", "mesh"


class Sensitivity(Study):
    """Experiment I's pages with one thing changed at a time; page i is the same sheet in the same noise everywhere.

    Conditions
    ----------
    `control`, `unrestored`
        As in `corner_distance`; also `unrestored/slope_p90_deg=S` and `unrestored/noise_scale=N`.
    `restored`
        By each method as it is, on the rig as `rig.*` and the sheet as `sheet.*` give it.
    `restored/slope_p90_deg=S`
        The same folds, bent more or less.
    `restored/noise_scale=N`
        On a rig of other noise, calibrated in that noise.
    `restored/denoise=true`, `restored/denoise=false`, and the same with `/noise_scale=N`
        The method with the depth filter that it does not have, or without its own.
    `restored/mesh=N`
        N x N vertices.
    `restored/rest=section`, `restored/rest=chord`, and the same with `/mesh=N`
        The method with the other rest lengths.
    `restored/projector_yaw_deg=D`, `restored/baseline_percent=P`, `restored/focal_percent=P`
        Scanned with a calibration that is wrong by so much, see :mod:`experiments.studies.faults`.
    """

    layout: ClassVar[Layout] = LAYOUT

    def plan(self, config: Config) -> list[TrialKey]:
        """Plan one trial a page, and one a page and changed capture; at `smoke` one slope and one noise."""
        known = set(config.methods) <= _RESTS.keys()
        require(known, "method", f"be some of {', '.join(_RESTS)} in this experiment", config.methods)
        require(config.scan == ScanSettings(), "scan", "be left out: this experiment switches it", "a setting")
        require(config.page.kind == "checkerboard", "page.kind", "be checkerboard, for its corners", config.page.kind)
        require_sheets(config)
        sheet, changed = config.sheet, config.sensitivity
        drawn = not sheet.paths and (sheet.kind == "mirror" or sheet.drawn)
        require(drawn or not changed.slope_p90_deg, f"sensitivity.{_SLOPE}", "be [] for sheets that are given", "some")
        square = config.mesh.rows == config.mesh.columns
        require(square or not changed.mesh, "sensitivity.mesh", "be [] unless mesh.rows equals mesh.columns", "some")
        _require_other(config)
        keys = trial_keys(config)
        for condition in _captures(config):
            keys += trial_keys(config, condition)
        return keys

    def inputs(self, config: Config) -> dict[str, Path]:
        """Name the given sheets."""
        return sheet_inputs(config)

    def prepare(self, config: Config) -> dict[float, Bench]:
        """Calibrate once in each noise."""
        wanted = [config.rig.noise_scale, *(value for name, value in _captures(config).values() if name == _NOISE)]
        mode = calibration_mode(config)
        return {
            noise: calibrated_bench(replace(config, rig=replace(config.rig, noise_scale=noise)), mode)
            for noise in wanted
        }

    def run(self, config: Config, shared: Any, key: TrialKey) -> Outcome:
        """Photograph one page and restore it in every way that its captures serve."""
        name, value = _captures(config).get(key.condition, ("", 0.0))
        bench: Bench = shared[value if name == _NOISE else config.rig.noise_scale]
        record, rng, page = Recorder(key), key.generator(), Checkerboard()
        if name == _SLOPE:
            config = replace(config, sheet=replace(config.sheet, slope_p90_deg=value))
        with record.stage("render"):
            sheet = trial_sheet(config, key, rng)
            flat = data_synth.render(bench.rig, data_synth.flat_sheet(page.page_size_mm), page, rng)
            capture, truth = data_synth.render(bench.rig, sheet, page, rng)
        trial = _Trial(config, record, truth, flat)
        scans = PageScans(record, capture, bench.calibration)
        checked = trial.checked(bench.calibration)
        suffix = f"/{name}={value:g}" if name else ""
        checked.measure_unrestored(capture, f"unrestored{suffix}")
        record.add(f"unrestored{suffix}", "-", {_NOISE: value} if name == _NOISE else severity(sheet))
        trial.restore(scans, checked, suffix)
        if name != _SLOPE:
            trial.restore(scans, checked, suffix, switch="denoise")
        if not name:
            checked.measure_control(*flat)
            record.add("unrestored", "-", bench.residuals() | trial.unchanged())
            trial.restore(scans, checked, switch="rest")
            trial.restore_meshes(scans, checked)
            trial.restore_wrongly(scans, bench.calibration)
        return record.outcome()


class _Trial:
    """One page: its restorations, and what is measured on them."""

    def __init__(self, config: Config, record: Recorder, truth: Truth, flat: tuple[Capture, Truth]) -> None:
        self.config, self.record, self.truth, self.flat = config, record, truth, flat
        self.shape: Shape = (config.mesh.rows, config.mesh.columns)

    def checked(self, calibration: Calibration) -> CheckeredPage:
        """Return what measures the page as a calibration sees it, with the paper's detector."""
        page = CheckeredPage(self.record, Checkerboard(), self.truth, calibration.camera, {"": DETECTORS[""]})
        page.find_control(*self.flat)
        return page

    def unchanged(self) -> dict[str, float]:
        """Return where the page as it is stands among the changed ones."""
        return {_NOISE: self.config.rig.noise_scale, _MESH: self.shape[0]} | dict.fromkeys(_FAULTS, 0.0)

    def restore_meshes(self, scans: PageScans, checked: CheckeredPage) -> None:
        """Restore by other meshes, with each method's own and with the other rest lengths."""
        for side in self.config.sensitivity.mesh:
            suffix = f"/{_MESH}={side}"
            self.record.add(f"unrestored{suffix}", "-", {_MESH: side})
            for switch in ("", "rest"):
                self.restore(scans, checked, suffix, (side, side), switch)

    def restore_wrongly(self, scans: PageScans, calibration: Calibration) -> None:
        """Restore by wrong calibrations."""
        for name, wrong in _FAULTS.items():
            for value in getattr(self.config.sensitivity, name):
                suffix, faulty = f"/{name}={value:g}", wrong(calibration, value)
                self.record.add(f"unrestored{suffix}", "-", {name: value})
                self.restore(scans.through(faulty), self.checked(faulty), suffix)

    def restore(
        self,
        scans: PageScans,
        checked: CheckeredPage,
        suffix: str = "",
        shape: Shape | None = None,
        switch: str = "",
    ) -> None:
        """Restore by each method, as it is or with its filter or its rest lengths switched, and measure."""
        for method in self.config.methods:
            recipe, rest, condition = recipe_for(method), _RESTS[method], "restored"
            if switch == "denoise":
                recipe = replace(recipe, denoise=not recipe.denoise)
                condition += f"/denoise={str(recipe.denoise).lower()}"
            if switch == "rest":
                rest = "chord" if rest == "section" else "section"
                condition += f"/rest={rest}"
            condition += suffix
            try:
                scan = scans.by(recipe, shape or self.shape)
                with self.record.stage("restore"):
                    restored = pipeline.restore(scan, method=method, rest=rest)
            except Exception as error:
                checked.fail(condition, method, error)
                continue
            self.record.add(condition, method, checked.depth_figures(scan.depth, prefix="depth"))
            checked.measure_restored(condition, method, scan, restored)


def _captures(config: Config) -> dict[str, tuple[str, float]]:
    """Return what each condition that needs captures of its own changes, and to what; one of each at `smoke`."""
    n_values = 1 if config.budget.name == "smoke" else None
    lists = {name: getattr(config.sensitivity, name)[:n_values] for name in (_SLOPE, _NOISE)}
    return {f"{name}={value:g}": (name, value) for name, values in lists.items() for value in values}


def _require_other(config: Config) -> None:
    """Refuse a value that the page has anyway: it would stand in the table twice."""
    plain = {_SLOPE: config.sheet.slope_p90_deg, _NOISE: config.rig.noise_scale, _MESH: config.mesh.rows}
    for name, value in (plain | dict.fromkeys(_FAULTS, 0.0)).items():
        listed = getattr(config.sensitivity, name)
        require(value not in listed, f"sensitivity.{name}", f"leave out {value:g}, which is the page as it is", listed)

"""Where the accuracy comes from: every step between the paper's method and the best one, switched singly."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import data_synth
from data_synth import Checkerboard
from deskew import flattening, restoration
from deskew.errors import StepError, require
from deskew.recipes import BEST, PAPER, Recipe
from deskew.types import WHITE, Restoration, Scan, Status
from experiments.reporting import Layout
from experiments.settings import Config, ScanSettings
from experiments.studies.attribution_layout import LAYOUT, variants
from experiments.studies.bench import Bench, calibrated_bench
from experiments.studies.checkered import CheckeredPage
from experiments.studies.page_scans import PageScans
from experiments.studies.study import Study
from experiments.studies.trial_sheets import require_sheets, severity, sheet_inputs, trial_sheet
from experiments.trials import Outcome, Recorder, TrialKey

_STARTS, _END = ("paper_euler", "paper_rk4"), "spring"


class Attribution(Study):
    """Experiment I's pages by the paper's method, by the best one and by all that lies a step from either.

    The steps, in the order of the chain: `decoding` (a line sweep read per pixel instead of per frame), `ink` (what ink
    does to the decoded coordinates taken out), `filter` (of the depth map), `rests` (rest lengths along the surface
    instead of chords), `solver` (rest found by statics instead of dynamics), `texture` (between vertices it follows the
    surface instead of being stretched evenly). Both methods have the same mesh and the same calibration. `method` names
    the two ends.

    Conditions
    ----------
    `control`, `unrestored`
        As in `corner_distance`.
    `paper`, `best`
        The two ends.
    `alone/STEP`
        The paper's method with this step.
    `without/STEP`
        The best one without it.
    `path/K_STEP`
        The paper's method with the first K steps, of which this is the last; the last of all is `best`.
    `.../saddle`
        The same measured with saddle corners instead of the paper's Kitchen-Rosenfeld corners: a step of the
        measurement, not of the method.
    """

    layout: ClassVar[Layout] = LAYOUT

    def plan(self, config: Config) -> list[TrialKey]:
        """Plan one trial a sheet."""
        ends = config.methods
        fits = len(ends) == 2 and ends[0] in _STARTS and ends[1] == _END
        require(fits, "method", f"be [{' or '.join(_STARTS)}, {_END}], the two ends", ends)
        require(config.scan == ScanSettings(), "scan", "be left out: this experiment switches it", "a setting")
        require(config.page.kind == "checkerboard", "page.kind", "be checkerboard, for its corners", config.page.kind)
        require_sheets(config)
        return Study.plan(self, config)

    def inputs(self, config: Config) -> dict[str, Path]:
        """Name the given sheets."""
        return sheet_inputs(config)

    def prepare(self, config: Config) -> Bench:
        """Calibrate once for all trials, and alike for all variants."""
        return calibrated_bench(config, BEST.mode)

    def run(self, config: Config, shared: Any, key: TrialKey) -> Outcome:
        """Photograph one sheet flat and crumpled, and restore it by every variant."""
        bench: Bench = shared
        record, rng, page = Recorder(key), key.generator(), Checkerboard()
        with record.stage("render"):
            sheet = trial_sheet(config, key, rng)
            flat, flat_truth = data_synth.render(bench.rig, data_synth.flat_sheet(page.page_size_mm), page, rng)
            capture, truth = data_synth.render(bench.rig, sheet, page, rng)
        checked = CheckeredPage(record, page, truth, bench.calibration.camera)
        checked.measure_control(flat, flat_truth)
        checked.measure_unrestored(capture)
        record.add("unrestored", "-", bench.residuals() | severity(sheet))
        scans = PageScans(record, capture, bench.calibration)
        for switched, conditions in variants().items():
            try:
                scan = scans.by(_recipe(switched), (config.mesh.rows, config.mesh.columns))
                with record.stage("restore"):
                    restored = _restored(scan, switched, config.methods)
            except Exception as error:
                for condition in conditions:
                    checked.fail(condition, "-", error)
                continue
            depth = checked.depth_figures(scan.depth, prefix="depth")
            for condition in conditions:
                record.add(condition, "-", depth)
                checked.measure_restored(condition, "-", scan, restored)
        return record.outcome()


def _recipe(switched: Set[str]) -> Recipe:
    """Return how the page is scanned with some steps switched on."""
    mode = BEST.mode if "decoding" in switched else PAPER.mode
    return Recipe(mode, ink="ink" in switched, denoise="filter" in switched)


def _restored(scan: Scan, switched: Set[str], ends: Sequence[str]) -> Restoration:
    """Flatten a scan and texture it with some steps switched on."""
    method = ends["solver" in switched]
    flattened = flattening.flatten(scan.sheet, method=method, rest="section" if "rests" in switched else "chord")
    if flattened.status is Status.DIVERGED:
        raise StepError(f"Flattening diverged: {flattened.remedy}")
    between = None
    if "texture" in switched and scan.sheet.surface is not None:
        between = flattening.flat_surface(scan.sheet.surface, flattened.vertices, scan.sheet.refinement)
    flattened = replace(flattened, surface=between)
    return restoration.restore_textures(scan, flattened, [WHITE]).restoration(WHITE)

"""Experiment I (section 4.1): the corners of restored pages against those of the flat control."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import data_synth
from data_synth import Checkerboard
from deskew import acquisition, pipeline, restoration
from deskew.errors import require
from deskew.plugins import Kind
from deskew.recipes import Recipe
from deskew.types import Array, Capture, Scan
from experiments.reporting import Column, FigurePage, Layout, Numbers, Plot, Tails, Versus
from experiments.settings import Config
from experiments.studies.bench import Bench, calibrated_bench
from experiments.studies.checkered import PAPER_MM, PAPER_PX, CheckeredPage
from experiments.studies.methods import dewarped_by, kind_of, method_of, require_methods
from experiments.studies.model_view import model_view
from experiments.studies.recipes import calibration_mode, methods_by_recipe
from experiments.studies.study import Study
from experiments.studies.trial_sheets import require_sheets, severity, sheet_inputs, trial_sheet
from experiments.trials import Outcome, Recorder, TrialKey

# The reports are committed: as many pages as the paper shows, or every crumple that is shipped.
_N_SHOWN = {"mirror": 5, "physical": data_synth.N_CRUMPLES}


class CornerDistance(Study):
    """Crumpled checkerboards, scanned, flattened and restored: by the best method, and by the paper's.

    A method comes with its way to scan (`deskew.recipes.recipe_for`): the paper's as in the paper, all others with the
    ink corrected and the depth map filtered. What `scan.*` sets holds for all methods. One that sees the picture alone
    has no rigid figures but `corner_similar_*`, after a rotation, a translation and a scale, and dense ones, likewise
    `dense_similar_*`, only with a backward map.

    Conditions
    ----------
    `control`
        The flat page: detected corners against their true places, which is the detector's own error.
    `unrestored`
        The crumpled page as the camera sees it, against the control; here too its sheet and calibration, and the scan
        if all methods share one.
    `restored`
        The restored page against the control, a row of figures for each method, with its scan if each has its own.
    `control/saddle`, `unrestored/saddle`, `restored/saddle`
        The same pictures measured with saddle corners instead of the paper's Kitchen-Rosenfeld corners.
    """

    layout: ClassVar[Layout] = Layout(
        "Experiment I: pixel distance (section 4.1, figure 3)",
        "Distance between the corners of the restored image and those of the control image, after an affine alignment "
        "as in the paper; rigid and dense figures, which no wrong scale can flatter, beside it. "
        "The paper gives its result in words, within half a pixel and within 0.25 mm: `within the paper's` is the "
        "share of pages whose mean keeps both. `paper_*` are the paper's method as a whole, its scan included; "
        "`spring` has the same mesh and springs, rest lengths along the corrected and filtered surface, and a static "
        "solution.",
        (
            Column("corner_mean_px", "mean [px]", 3, {"restored": f"< {PAPER_PX}"}, headline=True),
            Column("corner_max_px", "max [px]", 3, headline=True),
            Column("corner_mean_mm", "mean [mm]", 3, {"restored": f"< {PAPER_MM}"}, headline=True),
            Column("corner_max_mm", "max [mm]", 3),
            Column("meets_paper", "within the paper's", headline=True, share=True),
            Column("corner_rigid_mean_mm", "rigid mean [mm]", 3, headline=True),
            Column("corner_rigid_max_mm", "rigid max [mm]", 3),
            Column("corner_similar_mean_mm", "similar mean [mm]", 3),
            Column("corner_similar_max_mm", "similar max [mm]", 3),
            Column("dense_mean_mm", "dense mean [mm]", 3, headline=True),
            Column("dense_similar_mean_mm", "dense similar mean [mm]", 3),
            Column("page_coverage", "coverage", 4, headline=True),
            Column("detector_rms_px", "detector RMS [px]", 3, headline=True),
            Column("picture_to_map_rms_mm", "picture to map [mm]", 3),
            Column("corners_missing", "missing", 0, headline=True),
            Column("corners_expected", "expected", 0),
            Column("at_rest", "at rest", headline=True, share=True),
            Column("folded_quads", "folded quads", 0),
            Column("slope_p90_deg", "p90 slope [deg]", 1, headline=True),
            Column("relief_mm", "relief [mm]", 1, headline=True),
            Column("depth_raw_rms_mm", "depth RMS [mm]", 3),
            Column("depth_rms_mm", "filtered depth RMS [mm]", 3),
            Column("depth_coverage", "depth coverage", 4),
            Column("mesh_filled_fraction", "mesh filled", 4),
            Column("mesh_cut_quads", "quads cut", 0),
        ),
        tails=(
            Tails(
                "Pages within the paper's figures",
                "The paper says of its pages that corners lie within half a pixel and within 0.25 mm of the control's. "
                "Here a page counts as within if the mean over its corners keeps both limits; the quantiles say what "
                "half of the pages, nine in ten and nineteen in twenty keep below, with 95 % intervals by order "
                "statistics, open where so few pages set no bound. `max` is the worst corner of a page.",
                ("restored",),
                ("corner_mean_px", "corner_mean_mm", "corner_max_px", "corner_rigid_mean_mm", "dense_mean_mm"),
                "meets_paper",
            ),
        ),
        versus=Versus(
            "Each method against the paper's by explicit Euler, its scan included.",
            "paper_euler",
            ("restored", "restored/saddle"),
            ("corner_mean_px", "corner_max_px", "corner_rigid_mean_mm", "dense_mean_mm"),
        ),
        plots=(
            Plot("corner_mean_px", "corner_mean_px", "mean corner distance, affine-aligned [px]", PAPER_PX),
            Plot("corner_mean_mm", "corner_mean_mm", "mean corner distance, affine-aligned [mm]", PAPER_MM),
            Plot("dense_mean_mm", "dense_mean_mm", "mean distance of all restored pixels, rigidly aligned [mm]"),
        ),
        pages=(
            FigurePage(
                "figure_3",
                "Experiment I: crumpled pages, restored, and their control (the paper's figure 3)",
                "Row I: the crumpled pages as the camera sees them. Row II: the recovered 3D models, heights three "
                "times too large. Row III: the restored pages, their shading left in. Row IV: the control, the page "
                "photographed flat, and how far the corners of the pictures above are from the control's in the mean, "
                "after an affine alignment, in the image and on the page.",
                (
                    ("captured", "page_{column}_crumpled"),
                    ("3D model", "page_{column}_model"),
                    ("restored", "page_{column}_restored_{method}"),
                ),
                control=("control", "page_{column}_control"),
                numbers=Numbers(
                    (("unrestored", "unrestored"), ("restored", "restored")),
                    ("slope_p90_deg", "relief_mm", "corner_mean_px", "corner_mean_mm"),
                ),
            ),
        ),
    )

    def plan(self, config: Config) -> list[TrialKey]:
        """Plan one trial a sheet."""
        require_methods(config)
        require(config.page.kind == "checkerboard", "page.kind", "be checkerboard, for its corners", config.page.kind)
        require_sheets(config)
        return Study.plan(self, config)

    def inputs(self, config: Config) -> dict[str, Path]:
        """Name the given sheets."""
        return sheet_inputs(config)

    def prepare(self, config: Config) -> Bench:
        """Calibrate once for all trials."""
        return calibrated_bench(config, calibration_mode(config))

    def run(self, config: Config, shared: Any, key: TrialKey) -> Outcome:
        """Photograph one sheet flat and crumpled, scan it, restore it by each method, measure."""
        bench: Bench = shared
        record, rng, page = Recorder(key), key.generator(), Checkerboard()
        with record.stage("render"):
            sheet = trial_sheet(config, key, rng)
            flat, flat_truth = data_synth.render(bench.rig, data_synth.flat_sheet(page.page_size_mm), page, rng)
            capture, truth = data_synth.render(bench.rig, sheet, page, rng)
        checked = CheckeredPage(record, page, truth, bench.calibration.camera)
        trial = _Trial(record, bench, checked, pictured=key.trial < _N_SHOWN[config.sheet.kind])
        checked.measure_control(flat, flat_truth)
        trial.picture("control", restoration.undistorted_view(flat.white, bench.calibration.camera))
        trial.picture("crumpled", checked.measure_unrestored(capture))
        record.add("unrestored", "-", bench.residuals() | severity(sheet))
        recipes = methods_by_recipe(config)
        for method in config.methods:
            if kind_of(config, method) is Kind.DEWARPER:
                trial.dewarped(config, capture, method, shown=method == config.methods[0])
        for recipe, methods in recipes.items():
            # What all methods share stands by itself; else each method has its own scan's figures.
            shared_by = ["-"] if len(recipes) == 1 else methods
            scan = trial.scanned(config, capture, recipe, methods, shared_by)
            if scan is None:
                continue
            for method in methods:
                trial.restored(config, scan, method, shown=method == config.methods[0])
        return record.outcome()


class _Trial:
    """One sheet's scans, restorations and pictures."""

    def __init__(self, record: Recorder, bench: Bench, checked: CheckeredPage, *, pictured: bool) -> None:
        self.record, self.bench, self.checked, self.pictured = record, bench, checked, pictured

    def scanned(
        self, config: Config, capture: Capture, recipe: Recipe, methods: list[str], named: list[str]
    ) -> Scan | None:
        """Scan the page for some methods, record the scan's figures as `named`; None if it failed, and they with it."""
        shape, calibration = (config.mesh.rows, config.mesh.columns), self.bench.calibration
        try:
            # The sweeps are rendered while they are decoded: this stage holds both.
            with self.record.stage("scan"):
                scan = pipeline.scan_by(replace(recipe, denoise=False), capture, calibration, shape=shape)
            raw = scan.depth
            if recipe.denoise:
                with self.record.stage("denoise"):
                    scan = pipeline.span(capture, calibration, acquisition.denoise_depth(raw), shape=shape)
        except Exception as error:
            for method in methods:
                self.checked.fail("restored", method, error)
            return None
        cut = 0.0 if scan.sheet.cut is None else float(scan.sheet.cut.sum())
        figures = self.checked.depth_figures(raw)
        if scan.depth is not raw:
            figures |= self.checked.depth_figures(scan.depth, prefix="depth")
        figures |= {"mesh_filled_fraction": scan.filled_fraction, "mesh_cut_quads": cut}
        for name in named:
            self.record.add("unrestored" if name == "-" else "restored", name, figures)
        if config.methods[0] in methods:
            seen = scan.sheet.vertices if scan.sheet.surface is None else scan.sheet.surface
            self.picture("model", model_view(seen))
        return scan

    def dewarped(self, config: Config, capture: Capture, method: str, *, shown: bool) -> None:
        """Let a method flatten the picture alone and measure the result."""
        try:
            with self.record.stage("restore", "restored", method):
                found = dewarped_by(config, method, capture.white)
        except Exception as error:
            self.checked.fail("restored", method, error)
            return
        image = self.checked.measure_dewarped("restored", method, found)
        if shown and image is not None:
            self.picture(f"restored_{method}", image)

    def restored(self, config: Config, scan: Scan, method: str, *, shown: bool) -> None:
        """Restore by one method and measure the result."""
        try:
            with self.record.stage("restore", "restored", method):
                restored = pipeline.restore(scan, method=method_of(config, method))
        except Exception as error:
            self.checked.fail("restored", method, error)
            return
        self.checked.measure_restored("restored", method, scan, restored)
        if shown:
            self.picture(f"restored_{method}", restored.image)

    def picture(self, name: str, image: Array) -> None:
        """Keep a picture of the pages that are shown."""
        if self.pictured:
            self.record.picture(f"page_{self.record.key.trial}_{name}", image)

"""Experiment II (section 4.2): what a reading machine misses on crumpled, restored and flat pages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

import data_synth
from data_synth import Lettered, Light, Text, Truth
from deskew import metrics, pipeline, projection, restoration
from deskew.errors import require
from deskew.metrics import OcrEngine, OcrSettings
from deskew.plugins import Kind
from deskew.recipes import Recipe
from deskew.restoration import UNSHADED
from deskew.types import WHITE, Array, Flattened, Floats, Restoration, Scan, Sheet, Status
from experiments.reporting import Layout
from experiments.settings import Config
from experiments.studies.bench import Bench, calibrated_bench
from experiments.studies.flattened import flattening_figures
from experiments.studies.methods import dewarped_by, kind_of, method_of, require_methods
from experiments.studies.model_view import model_view
from experiments.studies.ocr_layout import LAYOUT
from experiments.studies.page_reader import PageReader, shading_percent
from experiments.studies.photographs import documents, measure_document
from experiments.studies.recipes import calibration_mode, methods_by_recipe
from experiments.studies.study import Study
from experiments.studies.trial_sheets import require_sheets, severity, sheet_inputs, trial_sheet
from experiments.trials import Outcome, Recorder, TrialKey, reason_of, trial_keys

# A tent of light, as documents are photographed in; the projector's own light is hard and comes from one side.
SOFT = Light("soft", even=200.0)
# Capitals of 21 px leave the page full and a capital's height of paper round it.
_CAPITAL_MM, _MARGIN_MM = 10.0, 18.0
_SWEEP, _REAL = "slope=", "real"
_N_SHOWN = 5
# What else is read of a page, by the suffix of its figures.
_UNDER = {"_projector": WHITE, "_unshaded": UNSHADED}


@dataclass(frozen=True, slots=True)
class _Shared:
    """What the trials share."""

    bench: Bench
    engine: OcrEngine


class OcrMisses(Study):
    """Pages of 176 letters under soft light, read flat, crumpled and restored, with the true text known.

    Conditions
    ----------
    `control`
        The flat page: the reading machine's own floor.
    `unrestored`
        The crumpled page as the camera sees it; here too its sheet and the calibration.
    `restored`
        The restored page, a row of figures for each method. Somebody's restorer or dewarper is given the page under the
        soft light, and what it returns is read; no other light is.
    `ideal`
        The crumpled page warped back by its true shape: the misses that no scan and no flattening can help.
    `unrestored/slope=S`, `restored/slope=S`, `ideal/slope=S`
        The same at a further severity of `ocr.severities`; trial i has trial i's words and folds, bent more or less.
    `null/shifted`, `null/shuffled`
        What the metrics read of the truth itself, spoilt: the control's picture one pixel aside, the true letters in
        random order.
    `real/flat`, `real/crumpleseasy`, `real/crumpleshard`, ...
        Photographs of real documents, a trial a document; nobody knows their shape, so nothing is restored.

    Metrics
    -------
    `misses` and its parts are of the picture as it is. `..._normalised` are of the same picture divided by its local
    white, `..._projector` of the page under the projector's hard light instead of the soft one, and `..._unshaded` of
    that with its shading removed by the scanned shape and the calibrated projector. Image metrics are of the soft light
    and of the control's cut, against the control; further severities have no control and none of them.
    """

    layout: ClassVar[Layout] = LAYOUT

    def plan(self, config: Config) -> list[TrialKey]:
        """Plan a trial a page, one a page and further severity, and one a real document."""
        require_methods(config)
        require(config.page.kind == "lettered", "page.kind", "be lettered in this experiment", config.page.kind)
        require_sheets(config)
        sheet, severities = config.sheet, config.ocr.severities
        drawn = not sheet.paths and (sheet.kind == "mirror" or sheet.drawn)
        require(drawn or not severities, "ocr.severities", "be left out for sheets that are not drawn", severities)
        known = config.sheet.slope_p90_deg not in severities
        require(known, "ocr.severities", "leave out sheet.slope_p90_deg, which is read anyway", severities)
        _engine(config)
        keys = trial_keys(config)
        for slope in severities:
            keys += trial_keys(config, f"{_SWEEP}{slope:g}")
        real = [] if config.ocr.real_path is None else documents(Path(config.ocr.real_path))
        return keys + [TrialKey(config.experiment, _REAL, "-", i, config.seed) for i in range(len(real))]

    def inputs(self, config: Config) -> dict[str, Path]:
        """Name the given sheets and the photographs."""
        real = {} if config.ocr.real_path is None else {"ocr.real_path": Path(config.ocr.real_path)}
        return sheet_inputs(config) | real

    def about(self, config: Config) -> dict[str, Any]:
        """State the reading machine, and whether there were photographs."""
        return {"ocr": _engine(config).about() | {"real_pages": "absent" if config.ocr.real_path is None else "read"}}

    def prepare(self, config: Config) -> _Shared:
        """Calibrate once for all trials."""
        return _Shared(calibrated_bench(config, calibration_mode(config)), _engine(config))

    def run(self, config: Config, shared: Any, key: TrialKey) -> Outcome:
        """Photograph one page flat and crumpled, scan it, restore it by each method, read every picture."""
        if key.condition == _REAL:
            record = Recorder(key)
            measure_document(record, shared.engine, documents(Path(str(config.ocr.real_path)))[key.trial])
            return record.outcome()
        if key.condition.startswith(_SWEEP):
            slope = float(key.condition.removeprefix(_SWEEP))
            config = replace(config, sheet=replace(config.sheet, slope_p90_deg=slope))
        trial = _Trial(config, shared, key)
        trial.scan()
        if not trial.at:
            trial.measure_control()
        trial.measure_unrestored()
        if config.ocr.restore:
            trial.measure_ideal()
        for recipe in trial.scans:
            for method in methods_by_recipe(config)[recipe]:
                trial.measure_restored(recipe, method)
        for method in config.methods if config.ocr.restore else ():
            if kind_of(config, method) is Kind.DEWARPER:
                trial.measure_dewarped(method)
        return trial.record.outcome()


class _Trial:
    """One crumpled page, its pictures, and what is read of them. Further severities read soft light alone."""

    def __init__(self, config: Config, shared: _Shared, key: TrialKey) -> None:
        self.config, self.bench, self.record, self.rng = config, shared.bench, Recorder(key), key.generator()
        self.at = f"/{key.condition}" if key.condition.startswith(_SWEEP) else ""
        self.camera = self.bench.calibration.camera
        with self.record.stage("render"):
            words = data_synth.page_words(self.rng, Text(config.page.text))
            self.page = Lettered(words, capital_mm=_CAPITAL_MM, margin_mm=_MARGIN_MM)
            self.sheet = trial_sheet(config, key, self.rng)
            self.capture, self.truth = data_synth.render(
                self.bench.rig, self.sheet, self.page, self.rng, lights=(SOFT,)
            )
        self.reader = PageReader(shared.engine, self.page, restoration.view_camera(self.camera))
        self.scans: dict[Recipe, Scan] = {}
        self.control: Array | None = None  # as cut for the reader
        self.pixels: Floats = restoration.undistortion_map(self.camera).astype(np.float64)

    def scan(self) -> None:
        """Scan the page by each recipe that the methods ask for; what fails is a failed row of those methods."""
        shape = self.config.mesh.rows, self.config.mesh.columns
        for recipe, methods in methods_by_recipe(self.config).items() if self.config.ocr.restore else ():
            try:
                with self.record.stage("scan"):
                    found = pipeline.scan_by(recipe, self.capture, self.bench.calibration, shape=shape)
                self.scans[recipe] = pipeline.with_shading_removed(found, self.capture, self.bench.calibration, recipe)
            except Exception as error:
                for method in methods:
                    self.record.fail(f"restored{self.at}", method, reason_of(error))

    def measure_unrestored(self) -> None:
        """Read the crumpled page as it lies."""
        images = {WHITE: self.capture.white, **self.capture.textures}
        scan = next(iter(self.scans.values()), None)
        if scan is not None:
            images[UNSHADED] = scan.images[UNSHADED]
            seen = scan.sheet.vertices if scan.sheet.surface is None else scan.sheet.surface
            self._picture("model", model_view(seen))
        figures = self._read_as_it_lies(f"unrestored{self.at}", images, self.truth) | severity(self.sheet)
        self.record.add(f"unrestored{self.at}", "-", figures | ({} if self.at else self.bench.residuals()))
        self._picture("crumpled", restoration.undistorted_view(self.capture.textures[SOFT.name], self.camera))

    def measure_control(self) -> None:
        """Photograph the page flat and read it; its shape is known without a scan."""
        with self.record.stage("render"):
            flat, truth = data_synth.render(
                self.bench.rig, data_synth.flat_sheet(), self.page, self.rng, lights=(SOFT,)
            )
        bed = projection.onto_bed(self.reader.view, projection.pixel_grid(self.camera.size))
        bed = np.concatenate([bed, np.zeros((*bed.shape[:2], 1))], axis=-1)
        unshaded = restoration.remove_shading(
            flat.white, flat.black, self.camera, self.bench.calibration.projector, bed
        )
        images = {WHITE: flat.white, UNSHADED: unshaded, **flat.textures}
        self.record.add("control", "-", self._read_as_it_lies("control", images, truth))
        seen = restoration.undistorted_view(flat.textures[SOFT.name], self.camera)
        self._picture("control", seen)
        self.control = self.reader.cut(seen)
        self.record.add("control", "-", metrics.line_straightness(self.control))
        beside = metrics.shifted(self.control, 1)
        self.record.add("null/shifted", "-", metrics.image_figures(beside, self.control))
        self.record.add("null/shuffled", "-", self.reader.shuffled_misses(self.rng))

    def measure_ideal(self) -> None:
        """Restore the page by its true shape: what is missed there is the light's and the machine's own."""
        width, height = self.page.page_size_mm
        flat = self.sheet.flat * (1.0, -1.0) + (-width / 2, height / 2)
        flattened = Flattened(np.concatenate([flat, np.zeros((*flat.shape[:2], 1))], axis=-1), Status.AT_REST)
        condition, sheet = f"ideal{self.at}", Sheet(self.sheet.vertices)
        with self.record.attempt(condition):
            restored = restoration.texture_quads(self.capture.textures[SOFT.name], self.camera, sheet, flattened)
            uv = self.truth.page_at(restored.backward_map.astype(np.float64))
            figures = metrics.dense_error(restored, uv, self.page.page_size_mm)
            self.record.add(condition, "-", figures | self._read(condition, "-", {SOFT.name: restored.image}, uv))

    def measure_restored(self, recipe: Recipe, method: str) -> None:
        """Restore by one method, read the result and measure where its paper lies."""
        condition, scan = f"restored{self.at}", self.scans[recipe]
        with self.record.attempt(condition, method):
            with self.record.stage("restore", condition, method):
                restored, images = self._restored(scan, method)
            uv = self.truth.page_at(restored.backward_map.astype(np.float64))
            figures = metrics.dense_error(restored, uv, self.page.page_size_mm)
            if restored.flattened is not None:
                figures |= flattening_figures(scan.sheet, restored.flattened)
            filtered = {"prefix": "depth"} if recipe.denoise else {}
            figures |= metrics.depth_error(scan.depth, self.truth.points_at(self.pixels), **filtered)
            self.record.add(condition, method, figures | self._read(condition, method, images, uv))
            self._shown(method, images[SOFT.name])

    def _restored(self, scan: Scan, method: str) -> tuple[Restoration, Mapping[str, Array]]:
        """Restore by one method; return the pictures by light too, of a restorer the one that it was given."""
        if kind_of(self.config, method) is Kind.RESTORER:
            soft = replace(scan, images={WHITE: self.capture.textures[SOFT.name]})
            whole = pipeline.restore(soft, method=method_of(self.config, method))
            return whole, {SOFT.name: whole.image}
        lights = (WHITE, SOFT.name, UNSHADED)
        restored = pipeline.restore_lights(scan, method=method_of(self.config, method), lights=lights)
        return restored.restoration(WHITE), restored.images

    def measure_dewarped(self, method: str) -> None:
        """Let a method flatten the picture alone; read it where the flat page lies."""
        condition = f"restored{self.at}"
        with self.record.attempt(condition, method):
            with self.record.stage("restore", condition, method):
                found = dewarped_by(self.config, method, self.capture.textures[SOFT.name])
            uv, figures = None, {}
            if found.backward_map is not None:
                uv = self.truth.page_at(found.backward_map.astype(np.float64))
                figures = metrics.similar_dense_error(found, uv, self.page.page_size_mm)
            image = self.reader.placed(found.image, uv)
            self.record.add(condition, method, figures | self._read(condition, method, {SOFT.name: image}, None))
            self._shown(method, image)

    def _shown(self, method: str, image: Array) -> None:
        if method == self.config.methods[0]:
            self._picture(f"restored_{method}", image)

    def _read_as_it_lies(self, condition: str, images: Mapping[str, Array], truth: Truth) -> dict[str, float]:
        """Read raw images of a page, undistorted and no more."""
        uv = truth.page_at(self.pixels)
        views = {light: restoration.undistorted_view(image, self.camera) for light, image in images.items()}
        return self._read(condition, "-", views, uv)

    def _read(self, condition: str, method: str, views: Mapping[str, Array], uv: Floats | None) -> dict[str, float]:
        """Return the figures of a page's pictures by light, with the true page coordinates of their pixels if known."""
        soft, blank = views[SOFT.name], None if uv is None else self.reader.blank(uv)
        with self.record.stage("ocr", condition, method):
            figures = self.reader.misses(soft)
        figures |= self.reader.normalised_misses(soft)
        if blank is not None:
            figures["shading_percent"] = shading_percent(soft, blank)
        for suffix, light in _UNDER.items():
            if light in views and blank is not None and not self.at:
                figures |= self.reader.misses(views[light], suffix)
                figures[f"shading{suffix}_percent"] = shading_percent(views[light], blank)
        if self.control is not None:
            with self.record.stage("image_metrics", condition, method):
                figures |= metrics.image_figures(self.reader.cut(soft), self.control)
        return figures

    def _picture(self, name: str, image: Array) -> None:
        # As many pages as the paper did; the reports are committed.
        if self.record.key.trial < _N_SHOWN and not self.at:
            self.record.picture(f"page_{self.record.key.trial}_{name}", image)


def _engine(config: Config) -> OcrEngine:
    return metrics.ocr_engine(config.ocr.engine, OcrSettings(psm=config.ocr.psm))

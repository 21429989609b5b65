"""Experiment III (section 4.3): a page of two materials, one of which changed size, restored at several stiffnesses."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

import data_synth
from data_synth import Case, Leaf, Truth, TwoMaterials, VellumPage
from deskew import metrics, pipeline, restoration
from deskew.errors import require
from deskew.io import StiffnessMap, read_image
from deskew.plugins import Kind
from deskew.projection import pixel_grid
from deskew.recipes import recipe_for
from deskew.restoration import Registration
from deskew.types import Array, Capture, Flattened, Floats, Restoration, Scan
from experiments.reporting import Layout
from experiments.settings import Config
from experiments.studies.bench import Bench, calibrated_bench
from experiments.studies.flattened import flattening_figures
from experiments.studies.methods import method_of, require_methods
from experiments.studies.model_view import model_view
from experiments.studies.recipes import calibration_mode, configured
from experiments.studies.registered import map_error
from experiments.studies.stiffness_layout import LAYOUT, by_dynamics, freely_scaled, restored
from experiments.studies.study import Study
from experiments.studies.trial_sheets import severity
from experiments.studies.two_material_sheets import case_keys, two_materials
from experiments.trials import Outcome, Recorder, TrialKey

Mask = npt.NDArray[np.bool_]

LEAF, SLEEVE = 1, 0
"""Labels of the map of materials."""

_PHOTOGRAPH = "kontron"
_SCALE = 2.0  # restored pixels of the photograph for each of the scan's
_DIFFERENCE_GAIN, _DESK_GREY = 2.0, 200.0


class Stiffness(Study):
    """A vellum leaf in a paper sleeve, scanned in PAL, photographed at 1996 x 1450, restored with many stiffnesses.

    The first method takes every ratio, any further one that of the right material alone, as a check. All restore the
    same scan, made as the first one's recipe says, and take rest lengths along its surface.

    Conditions
    ----------
    `unrestored/A`, `unrestored/B`, `unrestored/N`
        The page of a case: the vellum shrank, the sleeve grew, nothing changed its size; its scan, its materials, and
        the photograph registered to the scan.
    `restored/A/vellum_over_paper=0.01`, ...
        The page restored with the vellum a hundredth as stiff as the paper.
    `restored/A/free_scale`, ...
        Restored with the right material the stiffer one (in case N the vellum) and a free scale for the soft one.
    `dynamics/A/vellum_over_paper=0.01`, ...
        Restored with the right material the stiffer one by the methods after the first.
    `difference/A`, ...
        The photograph restored at both ends of the ratios, one subtracted from the other.
    """

    layout: ClassVar[Layout] = LAYOUT

    def plan(self, config: Config) -> list[TrialKey]:
        """Plan one trial a case and sheet."""
        require_methods(config, (Kind.FLATTENER,))
        require(config.page.kind == "vellum", "page.kind", "be vellum in this experiment", config.page.kind)
        if config.stiffness.materials != "texture":
            _read_leaf(config)
        return case_keys(config)

    def inputs(self, config: Config) -> dict[str, Path]:
        """Name the given sheets and the given map of the materials."""
        files = {f"sheet.paths[{i}]": Path(path) for i, path in enumerate(config.sheet.paths)}
        materials = config.stiffness.materials
        return files if materials == "texture" else files | {"stiffness.materials": Path(materials)}

    def prepare(self, config: Config) -> Bench:
        """Calibrate once for all trials."""
        return calibrated_bench(config, calibration_mode(config), camera=data_synth.manuscript_rig().camera)

    def run(self, config: Config, shared: Any, key: TrialKey) -> Outcome:
        """Photograph one sheet of one case, scan it, restore it with every ratio, measure."""
        bench: Bench = shared
        record, rng = Recorder(key), key.generator()
        with record.stage("sheet"):
            two = two_materials(config, key, rng)
        with record.stage("render"):
            page, light = VellumPage(int(rng.integers(1 << 31)), two.leaf), data_synth.kontron_light(rng)
            capture, truth = data_synth.render(bench.rig, two.sheet, page, rng, lights=(light,))
        with record.stage("scan"):
            recipe = configured(config.scan, recipe_for(config.methods[0]))
            scan = pipeline.scan_by(recipe, capture, bench.calibration, shape=(config.mesh.rows, config.mesh.columns))
            scan = pipeline.with_shading_removed(scan, capture, bench.calibration)
            leaf = _leaf(config, scan, capture, bench)
        trial = _Trial(config, record, two, truth, scan, leaf)
        trial.measure_page(capture)
        trial.restore_all()
        with record.attempt(f"difference/{two.case}"):
            trial.measure_difference(trial.registered())
        return record.outcome()


def _leaf(config: Config, scan: Scan, capture: Capture, bench: Bench) -> Mask:
    """Tell which raw pixels show the vellum, without any truth."""
    if config.stiffness.materials == "texture":
        return pipeline.find_leaf(scan, capture, bench.calibration)
    return _read_leaf(config)


def _read_leaf(config: Config) -> Mask:
    path = Path(config.stiffness.materials)
    picture = read_image(path, data_synth.PAL_SIZE)
    leaf: Mask = (picture if picture.ndim == 2 else picture.max(axis=-1)) > 0
    both = bool(leaf.any() and not leaf.all())
    require(both, "stiffness.materials", "show where the vellum is, and the rest black", str(path))
    return leaf


@dataclass(frozen=True, slots=True)
class _Trial:
    """One page and what is measured on it."""

    config: Config
    record: Recorder
    two: TwoMaterials
    truth: Truth
    scan: Scan
    leaf: Mask
    flattened: dict[float, Flattened] = field(default_factory=dict)

    @property
    def case(self) -> Case:
        """What happened to the page."""
        return self.two.case

    def measure_page(self, capture: Capture) -> None:
        """Measure the page as it lies: its shape, how it was scanned, how well the vellum was told from the paper."""
        camera = self.scan.camera
        figures = severity(self.two.sheet) | {"shrink_true": -self.two.change_percent}
        points = self.truth.points_at(restoration.undistortion_map(camera).astype(np.float64))
        figures |= metrics.depth_error(self.scan.depth, points, prefix="depth")
        figures |= material_figures(self.leaf, self.truth.page_at(pixel_grid(camera.size)), self.two.leaf)
        self.record.add(f"unrestored/{self.case}", "-", figures)
        self._picture("captured", restoration.undistorted_view(capture.white, camera))
        sheet = self.scan.sheet
        self._picture("model", model_view(sheet.vertices if sheet.surface is None else sheet.surface))

    def restore_all(self) -> None:
        """Restore with every ratio, then with what is right and what is beyond the paper; compare."""
        first, *others = self.config.methods
        ratios = self.config.stiffness.vellum_over_paper
        right, wrong = (min(ratios), max(ratios)) if self.case is Case.A else (max(ratios), min(ratios))
        errors = {ratio: self._restored(restored(self.case, ratio), first, ratio) for ratio in ratios}
        self._add_gains(restored(self.case, right), first, errors[right], errors[wrong], errors.get(1.0))
        for method in others:
            self._restored(by_dynamics(self.case, right), method, right)
        if first == "spring":
            place = freely_scaled(self.case)
            beyond = self._restored(place, first, right, free=True)
            self._add_gains(place, first, beyond, errors[wrong], errors.get(1.0))

    def _restored(self, condition: str, method: str, ratio: float, *, free: bool = False) -> dict[str, float]:
        """Restore and measure with one ratio; return the figures, none if that failed."""
        constants = {LEAF: min(ratio, 1.0), SLEEVE: min(1.0 / ratio, 1.0)}
        with self.record.attempt(condition, method):
            scan = pipeline.with_stiffness(self.scan, StiffnessMap(self.leaf.astype(np.uint8), constants))
            function = method_of(self.config, method)
            chords = isinstance(function, str) and function.startswith("paper_")
            settings: dict[str, Any] = {"rest": "section"} if chords else {}
            settings |= {"free_scale": True} if free else {}
            with self.record.stage("restore", condition, method):
                found = pipeline.restore(scan, method=function, **settings)
            flattened = found.flattened
            assert flattened is not None
            figures = self._errors(found) | flattening_figures(scan.sheet, flattened)
            figures["max_z_mm"] = float(np.abs(flattened.vertices[..., 2]).max())
            if free:
                estimated = flattened.counters["shrink_estimated"]
                off = abs(estimated + self.two.change_percent)
                figures |= {"shrink_estimated": estimated, "shrink_error": off}
            else:
                self.record.add(condition, method, {"vellum_over_paper": ratio})
                self.flattened.setdefault(ratio, flattened)
            self.record.add(condition, method, figures)
            return figures
        return {}

    def _errors(self, found: Restoration) -> dict[str, float]:
        uv = self.truth.page_at(found.backward_map.astype(np.float64))
        vellum = np.asarray(self.two.leaf.holds(uv[..., 0], uv[..., 1]), dtype=np.bool_)  # nowhere off the page
        kept = np.isfinite(uv[..., 0]) & ~vellum if self.case is Case.A else vellum
        return metrics.dense_error(found, uv, self.two.sheet.page_size_mm) | metrics.region_error(found, uv, kept)

    def _add_gains(
        self, place: str, method: str, here: dict[str, float], wrong: dict[str, float], even: dict[str, float] | None
    ) -> None:
        """Record how many times smaller the errors are than at the other end of the ratios, and than at 1:1."""
        for name, other in (("wrong", wrong), ("even", even)):
            gains = {
                f"{region}_gain_over_{name}": other[f"{region}_mean_mm"] / here[f"{region}_mean_mm"]
                for region in ("kept", "changed")
                if other and here
            }
            self.record.add(place, method, gains)

    def registered(self) -> Registration:
        """Register the photograph to the scan; measured as the page's own figure."""
        name = _PHOTOGRAPH
        with self.record.stage("register"):
            fit = restoration.register(self.scan.images[name], self.scan.images[restoration.UNSHADED], name)
        error = map_error(fit, self.truth.texture_maps[name], self.scan.camera.size)
        figures = {"registration_error_px": error, "registration_residual_px": fit.residual_px}
        self.record.add(f"unrestored/{self.case}", "-", figures)
        return fit

    def measure_difference(self, fit: Registration) -> None:
        """Texture both ends of the ratios with the photograph and subtract one from the other."""
        name = _PHOTOGRAPH
        vellum, paper = self.flattened[max(self.flattened)], self.flattened[min(self.flattened)]
        with self.record.stage("difference"):
            first, second = (
                restoration.restore_textures(self.scan, flat, [name], _SCALE, {name: fit})
                for flat in (vellum, metrics.laid_onto(paper, vellum))
            )
        page = np.isfinite(first.backward_map[..., 0]) & np.isfinite(second.backward_map[..., 0])
        difference, found = metrics.image_difference(first.images[name], second.images[name], page)
        self.record.add(f"difference/{self.case}", "-", found)
        self._picture("vellum", _halved(first.images[name]))
        self._picture("paper", _halved(second.images[name]))
        self._picture("difference", _halved(np.where(page, 255.0 - _DIFFERENCE_GAIN * np.abs(difference), _DESK_GREY)))

    def _picture(self, name: str, image: Array) -> None:
        if self.record.key.trial == 0:
            self.record.picture(f"{self.case}_{name}", image)


def material_figures(found: Mask, uv: Floats, leaf: Leaf) -> dict[str, float]:
    """Compare where the vellum was found with where it is.

    Parameters
    ----------
    found : (H, W) bool array
        Raw pixels that were taken for vellum.
    uv : (H, W, 2) array
        True page coordinates of the same pixels [mm], NaN off the page.
    leaf : Leaf
        The vellum's place.

    Returns
    -------
    dict
        `materials_wrong`, the share of the page's pixels that were taken for the other material, and
        `materials_border_mm`, that share's area over the length of the true border: how far off it is in the mean.
    """
    page = np.isfinite(uv[..., 0])
    wrong = float((found[page] != leaf.holds(*uv[page].T)).mean())
    length = 2 * sum(leaf.size_mm) - (8 - 2 * np.pi) * leaf.corner_mm
    area = leaf.page_size_mm[0] * leaf.page_size_mm[1]
    return {"materials_wrong": wrong, "materials_border_mm": wrong * area / length}


def _halved(image: Array) -> npt.NDArray[np.uint8]:
    """Return a picture of half the size, its pixels averaged by fours."""
    height, width = (n // 2 for n in image.shape)
    fours = image[: 2 * height, : 2 * width].reshape(height, 2, width, 2)
    return np.asarray(np.clip(np.rint(fours.mean(axis=(1, 3))), 0, 255), dtype=np.uint8)

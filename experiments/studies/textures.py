"""Section 2.4: hidden writing under several lights, restored by one flattening, and images of another format."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

import data_synth
from data_synth import Format, Layer, Light, Manuscript, Truth
from deskew import metrics, pipeline, restoration
from deskew.errors import require
from deskew.plugins import Kind
from deskew.restoration import Textures
from deskew.types import Array, Pinhole, Scan, Size
from experiments.reporting import Column, Layout, Montage, Plot
from experiments.settings import Config
from experiments.studies.bench import Bench, calibrated_bench
from experiments.studies.flattened import flattening_figures
from experiments.studies.hidden_writing import Reader
from experiments.studies.methods import method_of, require_methods
from experiments.studies.recipes import calibration_mode, methods_by_recipe
from experiments.studies.registered import map_error
from experiments.studies.study import Study
from experiments.studies.trial_sheets import require_sheets, severity, sheet_inputs, trial_sheet
from experiments.trials import Outcome, Recorder, TrialKey

# The camera of the paper's third experiment, whose video signal is scanned with: 1996 x 1450 pixels.
_KONTRON: Size = (1996, 1450)
_FINE = "uv_fine"
_TEXTS = {Layer.FLUORESCENCE: "uv_text", Layer.TRANSMITTANCE: "backlight_text", Layer.RELIEF: "raking_text"}
_COMBINED = ("mean", "max", "ratio:uv/above", "ratio:backlight/above", "ratio:raking/above", "components")
_N_SHOWN = 3
_SHOWN = {
    "crumpled": "white, as it lies",
    "above": "above",
    "raking": "raking",
    "uv": "ultra-violet",
    "backlight": "back-light",
    "ratio-uv-above": "uv / above",
    "ratio-backlight-above": "back-light / above",
    "component-2": "component 2",
    "component-3": "component 3",
}


class TexturesStudy(Study):
    """Crumpled manuscripts with three hidden texts, photographed under four lights and in a second format.

    Conditions
    ----------
    `unrestored/LIGHT`
        The crumpled page as the camera sees it under a light: `white` (the projector's own), `above`, `raking`, `uv`,
        `backlight`.
    `restored/LIGHT`
        The page under that light, all by one flattening; a row of figures for each method.
    `restored/COMBINATION`
        `mean`, `max`, `ratio-uv-above`, ..., `component-1` to `component-5` of the restored lights.
    `restored`
        The restored page's geometry.
    `registration/above_fine`, `registration/uv_fine`
        The images of the second format, each registered by itself: the stated residual against the known map.
    """

    layout: ClassVar[Layout] = Layout(
        "Textures under several lights and in a second format (section 2.4)",
        "Three hidden texts, each shown by one light alone. `r` is the correlation of the picture with the true flat "
        "text after a rotation and a translation, `read` the share of letters that resemble themselves more than any "
        "of the other 21: guessing reads 0.05. Registration of the images of 1996 x 1450 is from the images alone; "
        "the bar is an error of 0.3 texture pixels.",
        (
            Column("uv_text_correlation", "uv text: r", 2, headline=True),
            Column("uv_text_read", "read", 2, headline=True),
            Column("backlight_text_correlation", "back-light text: r", 2, headline=True),
            Column("backlight_text_read", "read", 2, headline=True),
            Column("raking_text_correlation", "raking text: r", 2, headline=True),
            Column("raking_text_read", "read", 2, headline=True),
            Column("registration_error_px", "registration error [texture px]", 3, headline=True),
            Column("registration_residual_px", "stated residual [texture px]", 3, headline=True),
            Column("registration_uncertainty_px", "stated uncertainty [texture px]", 3, headline=True),
            Column("dense_mean_mm", "dense mean [mm]", 3, headline=True),
            Column("at_rest", "at rest", headline=True, share=True),
            Column("slope_p90_deg", "p90 slope [deg]", 1, headline=True),
            Column("relief_mm", "relief [mm]", 1, headline=True),
        ),
        (Plot("registration_error_px", "registration_error_px", "error of the map, RMS [texture px]", 0.3),),
        (
            Montage(
                "lights",
                tuple((heading, f"page_{{trial}}_{name}") for name, heading in _SHOWN.items()),
            ),
        ),
    )

    def plan(self, config: Config) -> list[TrialKey]:
        """Plan one trial a sheet."""
        require_methods(config, (Kind.FLATTENER,))
        require(config.page.kind == "lettered", "page.kind", "be lettered in this experiment", config.page.kind)
        require_sheets(config)
        return Study.plan(self, config)

    def inputs(self, config: Config) -> dict[str, Path]:
        """Name the given sheets."""
        return sheet_inputs(config)

    def prepare(self, config: Config) -> Bench:
        """Calibrate once for all trials."""
        return calibrated_bench(config, calibration_mode(config))

    def run(self, config: Config, shared: Any, key: TrialKey) -> Outcome:
        """Photograph one sheet under all lights, scan it, restore every light by one flattening, read."""
        bench: Bench = shared
        record, rng = Recorder(key), key.generator()
        with record.stage("render"):
            page = data_synth.hidden_manuscript(rng)
            sheet = trial_sheet(config, key, rng, page.page_size_mm)
            lights = (*data_synth.standard_lights(), *_fine_lights(rng, bench.rig.camera.size))
            capture, truth = data_synth.render(bench.rig, sheet, page, rng, lights=lights)
        trial = _Trial(config, record, page, truth, bench.calibration.camera)
        record.add("unrestored/white", "-", severity(sheet))
        for light in lights:
            if light.readout is not None:
                trial.measure_registration(light, capture.textures[light.name], capture.white)
        plain = [light.name for light in lights if light.readout is None]
        trial.measure_unrestored({"white": capture.white} | {name: capture.textures[name] for name in plain})
        with record.stage("scan"):
            scans = {
                recipe: pipeline.scan_by(
                    recipe, capture, bench.calibration, shape=(config.mesh.rows, config.mesh.columns)
                )
                for recipe in methods_by_recipe(config)
            }
        for recipe, methods in methods_by_recipe(config).items():
            for method in methods:
                with record.attempt("restored", method):
                    trial.measure_restored(scans[recipe], ["white", *plain], method, shown=method == config.methods[0])
        return record.outcome()


def _fine_lights(rng: np.random.Generator, size: Size) -> tuple[Light, ...]:
    """Two lights in a second format with an unknown scale, aspect and crop, which all its images share."""
    scale = _KONTRON[0] / size[0] * float(rng.uniform(0.92, 1.02))
    aspect = float(rng.uniform(0.95, 1.05))
    both = (scale, scale * aspect)
    # What is left over of either picture, and where: a few per cent of the texture.
    offset = tuple(float((t - s * n) / 2 + rng.uniform(-40, 40)) for t, s, n in zip(_KONTRON, both, size, strict=True))
    readout = Format(_KONTRON, both, (offset[0], offset[1]))
    above, _, uv, _ = data_synth.standard_lights(readout)
    return replace(above, name="above_fine"), replace(uv, name=_FINE)


@dataclass(frozen=True, slots=True)
class _Trial:
    """One page and what is measured on its pictures."""

    config: Config
    record: Recorder
    page: Manuscript
    truth: Truth
    camera: Pinhole

    def measure_registration(self, light: Light, image: Array, white: Array) -> None:
        """Register one image by itself and compare with the known map."""
        condition = f"registration/{light.name}"
        with self.record.stage("register", condition), self.record.attempt(condition):
            found = restoration.register(image, white, light.name)
            error = map_error(found, self.truth.texture_maps[light.name], self.camera.size)
            figures = {"error": error, "residual": found.residual_px, "uncertainty": found.uncertainty_px}
            self.record.add(condition, "-", {f"registration_{name}_px": value for name, value in figures.items()})

    def measure_unrestored(self, images: Mapping[str, Array]) -> None:
        """Read the crumpled page under each light."""
        pixels = restoration.undistortion_map(self.camera).astype(np.float64)
        reader = Reader.of(self.page, self.truth.page_at(pixels), restoration.view_camera(self.camera))
        for name, image in images.items():
            self._read(f"unrestored/{name}", "-", reader, restoration.undistorted_view(image, self.camera))
        self._picture("crumpled", restoration.undistorted_view(images["white"], self.camera))

    def measure_restored(self, scan: Scan, lights: list[str], method: str, *, shown: bool) -> None:
        """Restore all lights by one flattening, combine them, and read every picture."""
        with self.record.stage("restore", "restored", method):
            restored = pipeline.restore_lights(scan, method=method_of(self.config, method), lights=lights)
        uv = self.truth.page_at(restored.backward_map.astype(np.float64))
        first = restored.restoration("white")
        figures = metrics.dense_error(first, uv, self.page.page_size_mm)
        self.record.add("restored", method, figures | flattening_figures(scan.sheet, restored.flattened))
        pictures = dict(restored.images) | _combinations(restored)
        reader = Reader.of(self.page, uv, restored.camera)
        for name, image in pictures.items():
            self._read(f"restored/{name}", method, reader, image)
            if shown:
                self._picture(name, image)
        with self.record.stage("restore_fine", "restored", method), self.record.attempt(f"restored/{_FINE}", method):
            fine = restoration.restore_textures(scan, restored.flattened, [_FINE])
            self._read(f"restored/{_FINE}", method, reader, fine.images[_FINE])

    def _read(self, condition: str, method: str, reader: Reader, image: Array) -> None:
        contrast = reader.flattened_contrast(image)
        for layer, text in _TEXTS.items():
            figures = {"correlation": reader.correlation(contrast, layer), "read": reader.letters_read(contrast, layer)}
            self.record.add(condition, method, {f"{text}_{name}": value for name, value in figures.items()})

    def _picture(self, name: str, image: Array) -> None:
        if name in _SHOWN and self.record.key.trial < _N_SHOWN:
            self.record.picture(f"page_{self.record.key.trial}_{name}", image)


def _combinations(restored: Textures) -> dict[str, Array]:
    page = np.isfinite(restored.backward_map[..., 0])
    pictures: dict[str, Array] = {}
    for how in _COMBINED:
        pictures |= restoration.combined(restored.images, page, how)
    return pictures

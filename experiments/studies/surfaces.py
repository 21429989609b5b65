"""Flattening by itself: meshes that store their true flat sheet, any method, with or without a scanner's noise."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from deskew import flattening, metrics
from deskew.errors import DeskewError, require
from deskew.io import Mesh, read_mesh, sheet_mesh
from deskew.types import Flattened, Sheet, Status
from experiments.reporting import Column, Layout, Plot, Times
from experiments.settings import Config
from experiments.studies.methods import require_methods
from experiments.studies.study import Study
from experiments.trials import Outcome, Recorder, TrialKey, trial_keys

_DENOISING = "spring"  # the one method that estimates noise and removes it


class Surfaces(Study):
    """Meshes are flattened as they are, by any method, and compared with the flat sheet that they store.

    With `surfaces.paths` trial i is file i, and there are as many trials as files. Noise of `surfaces.noise_mm` is
    added to z before the methods see the mesh; all figures are taken against the mesh without it, as `deskew score`
    takes them. The method `spring` estimates the noise and removes it; the others know nothing of it.

    Conditions
    ----------
    `flattened/STEM`
        The mesh of the file STEM.obj or STEM.ply; a row of figures for each method, and under "-" what the mesh is.
        `stretch_*` has no row where a face is flipped: it is infinite there, and `flips` says so.
    `flattened/KIND`
        Without paths: the kinds of `data_synth.surfaces`, one of each a trial.
    """

    layout: ClassVar[Layout] = Layout(
        "Flattening of surfaces",
        "Distance of every vertex from its true flat place, rigidly aligned (which decides) and affinely, as in the "
        "paper; stretch after Sander et al. 2001, from the plane to the surface. Stretch and strain say nothing of "
        "noise: a sheet kept true to a noisy scan is perfect by them and too large.",
        (
            Column("flat_rigid_mean_mm", "rigid mean [mm]", 4, headline=True),
            Column("flat_rigid_max_mm", "rigid max [mm]", 3, headline=True),
            Column("flat_mean_mm", "affine mean [mm]", 4, headline=True),
            Column("flat_max_mm", "affine max [mm]", 3),
            Column("flips", "flips", 0, headline=True),
            Column("folds", "folds", 0),
            Column("at_rest", "at rest", headline=True, share=True),
            Column("strain_rms", "strain RMS", 6, headline=True),
            Column("stretch_l2", "stretch L2", 5, headline=True),
            Column("stretch_linf", "stretch Linf", 3),
            Column("area_error", "area error", 5),
            Column("noise_estimated_mm", "noise found [mm]", 3, headline=True),
            Column("vertices", "vertices", 0),
            Column("relief_mm", "relief [mm]", 1),
        ),
        (Plot("flat_rigid_mean_mm", "flat_rigid_mean_mm", "mean distance from the truth, rigidly aligned [mm]"),),
        times=(
            Times(
                "Time",
                "Wall-clock seconds of the flattening alone, median of the trials, after one of a small sheet.",
                (Column("seconds_flatten", "flatten [s]", 3),),
            ),
        ),
    )

    def plan(self, config: Config) -> list[TrialKey]:
        """Plan one trial a file, or one a kind and trial."""
        require_methods(config)
        paths = [Path(path) for path in config.surfaces.paths]
        for path in paths:
            require(path.is_file(), "surfaces.paths", "name files", f"{path}, where there is none")
            require(path.stem.isprintable(), "surfaces.paths", "name files by printable characters", repr(path.stem))
        if paths:
            return [
                TrialKey(config.experiment, f"flattened/{p.stem}", "-", i, config.seed) for i, p in enumerate(paths)
            ]
        return [key for kind in _kinds() for key in trial_keys(config, f"flattened/{kind}")]

    def inputs(self, config: Config) -> dict[str, Path]:
        """Name the given meshes."""
        return {f"surfaces.paths[{i}]": Path(path) for i, path in enumerate(config.surfaces.paths)}

    def run(self, config: Config, shared: Any, key: TrialKey) -> Outcome:
        """Flatten one mesh by each method and measure the results."""
        record, rng = Recorder(key), key.generator()
        mesh = _mesh(config, key, rng)
        record.add(
            key.condition, "-", {"vertices": len(mesh.vertices), "relief_mm": float(np.ptp(mesh.vertices[:, 2]))}
        )
        scanned = mesh.vertices.copy()
        scanned[:, 2] += rng.normal(0.0, config.surfaces.noise_mm, len(scanned))
        for method in config.methods:
            with record.attempt(key.condition, method):
                _warm_up(method)
                with record.stage("flatten", key.condition, method):
                    flattened = _flattened(Sheet(scanned, mesh.faces), method)
                record.add(key.condition, method, _figures(mesh, flattened))
        return record.outcome()


def _kinds() -> Mapping[str, Any]:
    kinds: Mapping[str, Any] = import_module("data_synth.surfaces").KINDS
    return kinds


def _mesh(config: Config, key: TrialKey, rng: np.random.Generator) -> Mesh:
    """Read the trial's file or generate its kind."""
    if config.surfaces.paths:
        path = Path(config.surfaces.paths[key.trial])
        mesh = read_mesh(path)
        require(mesh.texture is not None, str(path), "hold texture coordinates, the flat places [mm]", "none")
        return mesh
    kind = key.condition.partition("/")[2]
    sheet = import_module("data_synth.surfaces").generate(kind, int(rng.integers(1 << 62)))
    return sheet_mesh(Sheet(sheet.vertices), sheet.flat)


def _flattened(sheet: Sheet, method: str) -> Flattened:
    settings: dict[str, object] = {"noise_mm": "auto"} if method == _DENOISING else {}
    return flattening.flatten(sheet, method=method, **settings)


@cache
def _warm_up(method: str) -> None:
    """Have a method compiled or loaded once a process; what is wrong with it its trials will say."""
    x, y = np.meshgrid(np.linspace(0.0, 40.0, 9), np.linspace(0.0, -30.0, 7))
    small = sheet_mesh(Sheet(np.stack([x, y, 5.0 * np.cos(x / 20.0)], axis=-1)))
    try:
        _flattened(small.sheet, method)
    except DeskewError:
        return


def _figures(mesh: Mesh, flattened: Flattened) -> dict[str, float]:
    assert mesh.texture is not None
    score = metrics.score_flattening(mesh.sheet, mesh.texture, flattened.vertices[:, :2])
    figures = {name: value for name, value in score.items() if math.isfinite(value)}
    figures["strain_rms"] = metrics.sheet_strain(mesh.sheet, flattened)["strain_rms"]
    figures["at_rest"] = float(flattened.status is Status.AT_REST)
    if "noise_estimated_mm" in flattened.counters:
        figures["noise_estimated_mm"] = flattened.counters["noise_estimated_mm"]
    return figures

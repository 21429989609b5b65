"""The rig as an experimenter has it: devices to photograph with, and what calibrating them gave."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

import data_synth
from data_synth import Rig
from deskew import pipeline
from deskew.acquisition import SweepSettings
from deskew.errors import InputError
from deskew.io import read_calibration, write_calibration
from deskew.types import Calibration, Pinhole
from experiments.settings import Config, RigSettings
from experiments.trials import fingerprint

# Random numbers of the calibration shots: a trial's number that no trial has, nor have those below it.
_CALIBRATION = 2**32 - 1


@dataclass(frozen=True, slots=True)
class Bench:
    """A rig and its estimated calibration; the true one stays inside `rig` and is for photographs alone."""

    rig: Rig
    calibration: Calibration

    def residuals(self) -> dict[str, float]:
        """Return :func:`calibration_figures` in millimetres."""
        return calibration_figures(self.calibration, "mm")


def calibration_figures(calibration: Calibration, unit: str) -> dict[str, float]:
    """Return `calib_{camera,projector,stereo}_rms_px` and, on boards left out, `calib_held_out_...`.

    Parameters
    ----------
    calibration : Calibration
        The figures' source.
    unit : str
        What its lengths are called in a metric's name: "mm" or "units".
    """
    figures = {f"calib_{name}": value for name, value in calibration.residuals.items()}
    length = figures.pop("calib_held_out_length_rms", None)
    return figures if length is None else figures | {f"calib_held_out_length_rms_{unit}": length}


def configured_rig(settings: RigSettings) -> Rig:
    """Return the rig that the configuration asks for."""
    rig = data_synth.default_rig(settings.noise_scale, baseline_mm=settings.baseline_mm)
    config = replace(
        rig.config,
        noise_draw=settings.noise_draw,
        camera_psf_sigma_px=settings.camera_blur_px,
        stripe_width_px=settings.stripe_width_px,
        projector_gamma=settings.gamma,
        ambient=settings.ambient,
    )
    return replace(rig, config=config)


def calibrated_bench(config: Config, mode: str, draw: int = 0, camera: Pinhole | None = None) -> Bench:
    """Photograph the printed board in its poses and calibrate both devices from that.

    Where `config.calibrations` names a folder, what an earlier run has calibrated in the same way is read from there:
    experiments on one rig share their boards.

    Parameters
    ----------
    config : Config
        Its rig, seed and folder of calibrations.
    mode : str
        How the boards' sweeps are read.
    draw : int
        Picks other noise.
    camera : Pinhole, optional
        Another camera than the default rig's.

    Raises
    ------
    InputError
        If the folder cannot be made, or holds a damaged calibration.
    """
    rig = configured_rig(config.rig)
    rig = rig if camera is None else replace(rig, camera=camera)

    def calibrate() -> Calibration:
        rng = np.random.default_rng(np.random.SeedSequence([config.seed, _CALIBRATION - draw]))
        poses = data_synth.board_poses(config.rig.board_poses)
        captures = (data_synth.render_board(rig, pose, rng) for pose in poses)
        return pipeline.calibrate(data_synth.BOARD, captures, settings=SweepSettings(mode=mode))

    if config.calibrations is None:
        return Bench(rig, calibrate())
    shape = {name: np.asarray(value).tolist() for name, value in asdict(rig.camera).items()}
    how = {"rig": asdict(config.rig), "camera": shape, "seed": config.seed, "mode": mode, "draw": draw}
    return Bench(rig, _kept(Path(config.calibrations), fingerprint(how), calibrate))


def _kept(folder: Path, identity: str, calibrate: Callable[[], Calibration]) -> Calibration:
    """Read a calibration from the folder, or make it and leave it there for the next run."""
    path = folder / f"{identity}.json"
    if path.is_file():
        return read_calibration(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"`calibrations` must be a folder that can be written, got {folder}: {error}.") from error
    calibration = calibrate()
    write_calibration(calibration, path)
    return calibration

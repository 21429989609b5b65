"""Calibrations that runs on one rig share."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import data_synth
from deskew.acquisition import SweepSettings
from deskew.errors import InputError
from deskew.types import Calibration
from experiments.settings import Config, RigSettings
from experiments.studies import bench
from experiments.studies.bench import calibrated_bench

RESIDUALS = {"camera_rms_px": 0.1 / 3, "projector_rms_px": 0.2 / 3, "stereo_rms_px": 0.1}


@pytest.fixture
def calibrations(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What was calibrated, by the mode of reading: each time with another third of a pixel in it."""
    done: list[str] = []

    def calibrate(board: object, captures: object, *, settings: SweepSettings) -> Calibration:
        done.append(settings.mode)
        rig = data_synth.default_rig()
        camera = replace(rig.camera, t=rig.camera.t + len(done) / 3)
        return Calibration(camera, rig.projector, residuals=RESIDUALS, uncertainty={"camera_fx_px": 1 / 7}, n_poses=9)

    monkeypatch.setattr(bench.pipeline, "calibrate", calibrate)
    return done


def config(folder: Path | None, **changes: float) -> Config:
    return Config("plane_accuracy", trials=1, calibrations=folder and str(folder), rig=RigSettings(**changes))


def test_kept_calibration_is_read_again_to_the_bit(calibrations: list[str], tmp_path: Path) -> None:
    first = calibrated_bench(config(tmp_path / "kept"), "temporal")
    again = calibrated_bench(config(tmp_path / "kept"), "temporal")
    assert calibrations == ["temporal"]
    assert np.array_equal(first.calibration.camera.t, again.calibration.camera.t)
    assert first.residuals() == again.residuals()


def test_another_rig_mode_seed_draw_or_camera_is_calibrated_by_itself(calibrations: list[str], tmp_path: Path) -> None:
    plain = config(tmp_path / "kept")
    camera = data_synth.manuscript_rig().camera
    calibrated_bench(plain, "temporal")
    calibrated_bench(plain, "spatial")
    calibrated_bench(config(tmp_path / "kept", noise_scale=2.0), "temporal")
    calibrated_bench(replace(plain, seed=2), "temporal")
    calibrated_bench(plain, "temporal", draw=1)
    calibrated_bench(plain, "temporal", camera=camera)
    assert len(calibrations) == 6
    calibrated_bench(replace(plain, trials=7, experiment="ocr_misses"), "temporal")
    assert len(calibrations) == 6


def test_without_a_folder_nothing_is_kept(calibrations: list[str]) -> None:
    for _ in range(2):
        calibrated_bench(config(None), "temporal")
    assert len(calibrations) == 2


def test_folder_that_cannot_be_made_is_refused_before_the_work(calibrations: list[str], tmp_path: Path) -> None:
    (tmp_path / "notes").write_text("mine")
    with pytest.raises(InputError, match="`calibrations` must be a folder that can be written, got"):
        calibrated_bench(config(tmp_path / "notes"), "temporal")
    assert calibrations == []
    assert (tmp_path / "notes").read_text() == "mine"

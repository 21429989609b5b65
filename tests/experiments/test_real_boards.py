"""The study of real boards on rendered ones, in the real captures' own layout."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

import data_synth
from deskew.types import Board, PatternKind, Pinhole
from experiments.program import main
from experiments.studies import real_boards
from experiments.trials import content_digest

RENDERED = Board(real_boards.BOARD.shape, 24.0)  # mm; the study takes the same squares for 75 units


def halved(camera: Pinhole) -> Pinhole:
    """Half the pixels each way: a quarter of the work."""
    K = camera.K.copy()
    K[:2, 2] = (K[:2, 2] + 0.5) / 2 - 0.5
    K[[0, 0, 1], [0, 1, 1]] /= 2
    return replace(camera, size=(camera.size[0] // 2, camera.size[1] // 2), K=K)


def write_boards(folder: Path) -> None:
    """Photograph five poses under Gray code: column planes, row planes, white, black, as the captures number them."""
    rig = data_synth.default_rig()
    rig = replace(rig, camera=halved(rig.camera))
    for i, pose in enumerate(data_synth.board_poses(5)):
        capture = data_synth.render_board(rig, pose, 7300 + i, RENDERED, PatternKind.GRAY_CODE)
        (folder / f"capture_{i}").mkdir(parents=True)
        for k, frame in enumerate([*capture.columns, *capture.rows, capture.white, capture.black]):
            cv2.imwrite(str(folder / f"capture_{i}" / f"graycode_{k:02d}.png"), frame)


def test_rendered_boards_in_the_real_layout_are_measured_to_their_true_size(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    boards = tmp_path / "boards"
    write_boards(boards)
    digest = content_digest(sorted(boards.glob("capture_*/graycode_*.png")), boards)
    monkeypatch.setattr(real_boards, "CAPTURES_SHA256", digest)
    line = ["experiment=real_boards", f"real_boards.path={boards}", "trials=1", "engine=serial"]
    assert main([*line, "mesh.rows=15", "mesh.columns=15", f"out={tmp_path / 'out'}"]) == 0
    with (tmp_path / "out" / "results.csv").open() as file:
        rows = {(row["condition"], row["metric"]): float(row["value"]) for row in csv.DictReader(file)}
    assert 0.001 < rows["calibration", "calib_camera_rms_px"] < 0.1
    assert 0.005 < rows["calibration", "calib_projector_rms_px"] < 0.2
    # Of lengths over 400 units, 128 mm: a thousandth would be 0.4.
    assert 0.0 < rows["left_out", "length_error_units"] < 0.8
    assert 0.0 < rows["left_out", "plane_mean_abs_units"] < 0.5
    assert 0.5 < rows["left_out", "depth_coverage"] <= 1.0
    assert rows["restored", "corners_missing"] == 0
    assert 0.0 < rows["restored", "corner_rigid_mean_units"] < 3.0
    assert np.isfinite(rows["restored", "corner_rigid_max_units"])

"""Captures in another program's layout become a board folder, and poses can be left out of a calibration."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import deskew as package
from deskew import io
from deskew.types import Board, Calibration, Capture, Pinhole
from tests.cli.conftest import Command

RESIDUALS = {"camera_rms_px": 0.1, "projector_rms_px": 0.2, "stereo_rms_px": 0.3}
DEVICE = Pinhole((7, 4), np.diag([9.0, 9, 1]), np.zeros(5), np.eye(3), np.zeros(3))


@pytest.fixture
def sample_data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Four poses of 14 frames for a projector of 6 x 5; frame k of pose i is of level 100 i + k."""
    for i in range(4):
        (tmp_path / "sample_data" / f"capture_{i}").mkdir(parents=True)
        for k in range(14):
            level = np.full((4, 7), 50 * i + k, np.uint8)
            io.write_image(level, tmp_path / "sample_data" / f"capture_{i}" / f"graycode_{k:02d}.png")
    monkeypatch.chdir(tmp_path)
    return tmp_path


LINE = "import sample_data -o board --inner-corners 9 7 --square 75 --unit units --projector-size 6 5"


def test_every_pose_becomes_a_capture_folder_pixel_for_pixel(deskew: Command, sample_data: Path) -> None:
    code, out, err = deskew(f"{LINE} --json")
    assert (code, err, json.loads(out)) == (0, "", {"board": "board", "n_poses": 4})
    board, poses = io.read_board(Path("board"))
    assert board == Board((9, 7), 75.0, "units")
    assert [int(frame[0, 0]) for frame in poses[2].columns] == [100, 101, 102, 103, 104, 105]
    assert [int(frame[0, 0]) for frame in poses[2].rows] == [106, 107, 108, 109, 110, 111]
    assert (int(poses[2].white[0, 0]), int(poses[2].black[0, 0])) == (112, 113)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("--inner-corners 9 2", "`shape` must be (nx, ny) of at least 3 inner corners"),
        ("--square 0", "`square` must be a positive length, got 0.0."),
        ("--projector-size 0 5", "`--projector-size` must be 2 px or more each way, got (0, 5)."),
        ("--projector-size 1024 768", "must hold 42 frames, graycode_00.png to graycode_41.png, got 14 images"),
        ("-o no/board", "must lie in an existing folder"),
        ("-o sample_data", "`sample_data` must be new or an empty folder"),
    ],
)
def test_what_is_wrong_is_one_line(deskew: Command, sample_data: Path, change: str, message: str) -> None:
    code, out, err = deskew(f"{LINE} {change}")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert message in err
    assert not Path("board").exists()


def test_a_pose_can_be_left_out(deskew: Command, sample_data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    used: list[int] = []

    def calibrate(board: Board, poses: Iterable[Capture], *, watch: Any) -> Calibration:
        used[:] = [int(pose.white[0, 0]) for pose in poses]
        return Calibration(DEVICE, DEVICE, RESIDUALS, {}, len(used), board.unit)

    monkeypatch.setattr(package, "pipeline", SimpleNamespace(calibrate=calibrate), raising=False)
    assert deskew(LINE)[0] == 0
    code, out, _ = deskew("calibrate board -o c.json --leave-out 0 --leave-out 2 --json")
    assert (code, json.loads(out)["n_poses"], used) == (0, 2, [62, 162])
    code, out, err = deskew("calibrate board -o d.json --leave-out 4")
    assert (code, out, err) == (2, "", "deskew: `--leave-out` must be a pose in [0, 3], got [4].\n")

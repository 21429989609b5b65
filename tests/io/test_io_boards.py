from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from deskew.errors import InputError
from deskew.io import read_board, read_procam_graycode, write_board
from deskew.types import Board, Capture, PatternKind

MakeCapture = Callable[..., Capture]


@pytest.fixture
def board_folder(tmp_path: Path, new_capture: MakeCapture) -> Path:
    write_board(Board((5, 4), 25.4), [new_capture()] * 3, tmp_path / "board")
    return tmp_path / "board"


@pytest.fixture
def procam_folder(tmp_path: Path) -> Path:
    """Two captures named as the real ones are, for a projector of 6 x 5: 3 + 3 bits; frame i is grey level i."""
    for pose in range(2):
        folder = tmp_path / "procam" / f"capture_{pose}"
        folder.mkdir(parents=True)
        for i in range(14):
            cv2.imwrite(str(folder / f"graycode_{i:02d}.png"), np.full((4, 7), 100 * pose + i, np.uint8))
    return tmp_path / "procam"


@pytest.mark.parametrize("square", [25.4, 75, 1 / 3, 1e-3])
def test_a_board_comes_back_as_it_was_written(tmp_path: Path, new_capture: MakeCapture, square: float) -> None:
    captures = [new_capture(PatternKind.LINE_SWEEP), new_capture()]
    write_board(Board((10, 7), square, "units"), captures, tmp_path / "board")
    board, found = read_board(tmp_path / "board")
    assert (board.shape, board.square, board.unit) == ((10, 7), square, "units")
    assert [capture.pattern for capture in found] == ["line_sweep", "gray_code"]
    assert np.array_equal(found[1].white, captures[1].white)


def test_poses_are_written_from_a_generator_one_at_a_time(tmp_path: Path, new_capture: MakeCapture) -> None:
    written: list[int] = []

    def poses() -> Iterator[Capture]:
        for _ in range(12):
            written.append(len(list(tmp_path.rglob("white.png"))))
            yield new_capture()

    write_board(Board((5, 4), 25.0), poses(), tmp_path / "board")
    assert written == list(range(12))  # each pose is on disk before the next is asked for
    assert sorted(p.name for p in (tmp_path / "board").iterdir())[-2:] == ["pose_10", "pose_11"]
    assert len(read_board(tmp_path / "board")[1]) == 12


WRONG: dict[str, tuple[Callable[[Path], object], str]] = {
    "no board.toml": (lambda f: (f / "board.toml").unlink(), r"board\.toml` must be a file"),
    "no poses": (lambda f: [shutil.rmtree(f / f"pose_0{i}") for i in range(3)], "must hold pose_00 and further poses"),
    "pose missing": (
        lambda f: shutil.rmtree(f / "pose_01"),
        "numbered without a gap, pose_00 to pose_01, got 'pose_02'",
    ),
    "pose copied": (lambda f: shutil.copytree(f / "pose_01", f / "pose_01 copy"), "without a gap.*got 'pose_01 copy'"),
    "pose not padded": (lambda f: (f / "pose_02").rename(f / "pose_2"), "without a gap.*got 'pose_2'"),
    "pose a file": (lambda f: shutil.rmtree(f / "pose_02") or (f / "pose_02").touch(), "pose_02` must be a folder"),
    "pose elsewhere": (
        lambda f: (f / "pose_02").rename(f.parent / "x") and (f / "pose_02").symlink_to(f.parent / "x"),
        "pose_02` must stay inside",
    ),
    "frame missing in a pose": (lambda f: (f / "pose_01/gray/03.png").unlink(), "pose_01/gray` must hold 12 frames"),
}
WRONG_TOML = {
    "corners of three": ("inner_corners = [5, 4, 3]", "inner_corners` must be two integers"),
    "corners too few": ("inner_corners = [5, 2]", r"inner_corners` must be two integers in \[3, 1000\], got \[5, 2\]"),
    "corners absent": ("", "got none named inner_corners"),
    "square beyond all measure": ("square = 1e300", r"square` must be in \[0.001, 1e\+06\]"),
    "square of no measure": ("square = 1e-300", r"square` must be in \[0.001, 1e\+06\]"),
    "square zero": ("square = 0", "square` must be a finite number above 0, got 0"),
    "square negative": ("square = -25.4", "square` must be a finite number above 0"),
    "square NaN": ("square = nan", "square` must be a finite number above 0"),
    "square infinite": ("square = inf", "square` must be a finite number above 0"),
    "square a string": ('square = "25.4 mm"', "square` must be a finite number above 0"),
    "square true": ("square = true", "square` must be a finite number above 0"),
    "unit a number": ("unit = 25.4", "unit` must be 1 to 64 printable characters"),
    "unit a sentence": ('unit = "milli metres"', "unit` must be 1 to 16 letters"),
    "unknown key": ('colour = "black"', "got also 'colour'"),
}


@pytest.mark.parametrize("case", list(WRONG))
def test_a_wrong_calibration_folder_is_refused(board_folder: Path, case: str) -> None:
    break_it, message = WRONG[case]
    break_it(board_folder)
    with pytest.raises(InputError, match=message):
        read_board(board_folder)


@pytest.mark.parametrize("case", list(WRONG_TOML))
def test_a_wrong_board_is_refused(board_folder: Path, case: str) -> None:
    line, message = WRONG_TOML[case]
    key = line.split(" ")[0] or "inner_corners"
    lines = (board_folder / "board.toml").read_text().splitlines()
    kept = [old for old in lines if not old.startswith(key)]
    (board_folder / "board.toml").write_text("\n".join([*kept, line]))
    with pytest.raises(InputError, match=message):
        read_board(board_folder)


def test_poses_of_another_camera_are_refused(tmp_path: Path, new_capture: MakeCapture) -> None:
    captures = [new_capture(), new_capture(projector_size=(7, 5))]
    write_board(Board((5, 4), 25.0), captures, tmp_path / "board")
    with pytest.raises(InputError, match=r"pose_01: projector_size_px` must be pose_00's \(6, 5\), got \(7, 5\)"):
        read_board(tmp_path / "board")


def test_a_failing_pose_leaves_no_board(tmp_path: Path, new_capture: MakeCapture) -> None:
    with pytest.raises(InputError, match="`textures` must have names"):
        write_board(Board((5, 4), 25.0), [new_capture(), new_capture(lights=("a b",))], tmp_path / "board")
    assert list(tmp_path.iterdir()) == []


def test_procam_frames_are_columns_rows_white_black(procam_folder: Path) -> None:
    first, second = read_procam_graycode(procam_folder, projector_size=(6, 5))
    assert (first.camera_size, first.projector_size, first.pattern) == ((7, 4), (6, 5), PatternKind.GRAY_CODE)
    assert [int(frame[0, 0]) for frame in first.columns] == [0, 1, 2, 3, 4, 5]
    assert [int(frame[0, 0]) for frame in second.rows] == [106, 107, 108, 109, 110, 111]
    assert (int(second.white[0, 0]), int(second.black[0, 0])) == (112, 113)


@pytest.mark.parametrize(
    ("break_it", "message"),
    [
        (lambda f: shutil.rmtree(f / "capture_0"), "numbered without a gap, capture_0 to capture_0, got 'capture_1'"),
        (
            lambda f: (f / "capture_1/graycode_05.png").unlink(),
            r"capture_1` must hold 14 frames.*'graycode_05\.png' mis",
        ),
        (lambda f: (f / "capture_1/graycode_13.png").write_bytes(b""), r"graycode_13\.png` must be a PNG image"),
        (lambda f: shutil.rmtree(f), "procam` must be a folder, got nothing there"),
    ],
    ids=["capture missing", "frame missing", "black empty", "folder missing"],
)
def test_a_wrong_procam_folder_is_refused(
    procam_folder: Path, break_it: Callable[[Path], object], message: str
) -> None:
    break_it(procam_folder)
    with pytest.raises(InputError, match=message):
        read_procam_graycode(procam_folder, projector_size=(6, 5))

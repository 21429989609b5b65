"""Calibration folders: ``board.toml`` beside ``pose_00/``, ``pose_01/``, ..., each of them a capture folder."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from deskew.errors import require
from deskew.io.captures import StoredFrames, numbered, read_capture, read_pair, write_capture
from deskew.io.fields import Fields
from deskew.io.files import read_toml, replacing_folder, require_folder, require_inside, shown
from deskew.io.images import png_size
from deskew.types import Board, Capture, PatternKind, Size, n_planes

BOARD_VERSION = 1
MAX_CORNERS = 1000
SQUARE_RANGE = (1e-3, 1e6)  # in the board's own unit: beyond it a fit in single precision overflows or vanishes

_UNIT = re.compile(r"[A-Za-z\u00b5]{1,16}")


def _pose_folders(folder: Path, prefix: str, digits: int) -> list[Path]:
    """Return PREFIX0, PREFIX1, ... without a gap; one that is misnumbered must not be left out silently."""
    require_folder(folder)
    found = sorted(p.name for p in folder.iterdir() if p.name.startswith(prefix))
    wanted = [f"{prefix}{i:0{digits}d}" for i in range(len(found))]
    require(len(found) > 0, str(folder), f"hold {prefix}{0:0{digits}d} and further poses", "none")
    gap = shown(next((f for f, w in zip(found, wanted, strict=True) if f != w), ""))
    allowed = f"hold poses numbered without a gap, {wanted[0]} to {wanted[-1]}"
    require(sorted(wanted) == found, str(folder), allowed, gap)
    for name in wanted:
        require_inside(folder / name, folder)
    return [folder / name for name in wanted]


def read_board_file(folder: Path) -> Board:
    """Read what was printed from the ``board.toml`` of a calibration folder, its poses aside.

    Raises
    ------
    InputError
        Naming the file or key at fault.
    """
    folder = Path(folder)
    require_folder(folder)
    path = folder / "board.toml"
    require_inside(path, folder)
    fields = Fields(read_toml(path), str(path))
    fields.only(("version", "inner_corners", "square", "unit"))
    fields.version("version", BOARD_VERSION)
    corners = fields.pair("inner_corners", 3, MAX_CORNERS)
    unit = fields.word("unit")
    require(bool(_UNIT.fullmatch(unit)), f"{path}: unit", "be 1 to 16 letters, such as mm", shown(unit))
    square = fields.positive("square")
    sound = SQUARE_RANGE[0] <= square <= SQUARE_RANGE[1]
    require(sound, f"{path}: square", f"be in [{SQUARE_RANGE[0]:g}, {SQUARE_RANGE[1]:g}]", shown(square))
    return Board(corners, square, unit)


def read_board(folder: Path) -> tuple[Board, list[Capture]]:
    """Open a calibration folder.

    Parameters
    ----------
    folder : Path
        As this module describes it.

    Returns
    -------
    board : Board
        What was printed.
    captures : list of Capture
        One a pose, pose 00 first; their frames stay on disk until they are iterated.

    Raises
    ------
    InputError
        Naming the file or key at fault.
    """
    folder = Path(folder)
    board = read_board_file(folder)
    poses = [read_capture(pose) for pose in _pose_folders(folder, "pose_", 2)]
    for i, pose in enumerate(poses):
        for name in ("camera_size", "projector_size"):
            first, here = getattr(poses[0], name), getattr(pose, name)
            require(here == first, f"{folder / f'pose_{i:02d}'}: {name}_px", f"be pose_00's {first}", here)
    return board, poses


def write_board(board: Board, captures: Iterable[Capture], folder: Path) -> None:
    """Write a calibration folder, streaming one frame at a time; it appears whole or not at all.

    Parameters
    ----------
    board : Board
        What was printed.
    captures : iterable of Capture
        One a pose; may be a generator, so that rendered poses are never all in memory.
    folder : Path
        New, or an empty folder.

    Raises
    ------
    InputError
        If the folder is not empty or a capture cannot be written.
    StepError
        If the file system refuses.
    """
    sound = SQUARE_RANGE[0] <= board.square <= SQUARE_RANGE[1]
    require(sound, "square", f"be in [{SQUARE_RANGE[0]:g}, {SQUARE_RANGE[1]:g}]", board.square)
    require(bool(_UNIT.fullmatch(board.unit)), "unit", "be 1 to 16 letters, such as mm", shown(board.unit))
    with replacing_folder(Path(folder)) as new:
        text = (
            f"version = {BOARD_VERSION}\ninner_corners = {list(board.shape)}\n"
            f'square = {float(board.square)!r}\nunit = "{board.unit}"\n'
        )
        (new / "board.toml").write_text(text, encoding="utf-8")
        for i, capture in enumerate(captures):
            write_capture(capture, new / f"pose_{i:02d}")


def read_procam_graycode(folder: Path, projector_size: Size = (1024, 768)) -> list[Capture]:
    """Open the sample data of kamino410/procam-calibration as it is.

    ``capture_0/``, ``capture_1/``, ... each hold ``graycode_00.png`` and on: the column bits, most significant first,
    then the row bits, each followed by its inverse, then all white, then all black.

    Parameters
    ----------
    folder : Path
        The folder that holds the captures.
    projector_size : (width, height)
        Pixels of the projector; its logarithm is the number of bits.

    Returns
    -------
    list of Capture
        One a pose; frames stay on disk until they are iterated.

    Raises
    ------
    InputError
        Naming the file at fault.
    """
    folder = Path(folder)
    n_columns, n_rows = (n_planes(extent) for extent in projector_size)
    poses = []
    for pose in _pose_folders(folder, "capture_", 1):
        *planes, white_path, black_path = numbered(pose, n_columns + n_rows + 2, folder, prefix="graycode_")
        size = png_size(white_path)
        white, black = read_pair(white_path, black_path, size)
        columns = StoredFrames(tuple(planes[:n_columns]), white)
        rows = StoredFrames(tuple(planes[n_columns:]), white)
        poses.append(Capture(white, black, projector_size, PatternKind.GRAY_CODE, columns, rows))
    return poses

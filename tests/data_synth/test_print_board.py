from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

import data_synth as ds
from data_synth.print_board import drawn_board, main, write_print
from deskew.acquisition import find_board
from deskew.errors import InputError
from deskew.types import Board


def test_the_print_has_its_corners_where_the_board_says() -> None:
    """Found by the detector of the calibration, in pixels of 1/100 inch; squares and margin are an inch wide."""
    board = Board((7, 4), 25.4)
    canvas = FigureCanvasAgg(drawn_board(board, margin_mm=25.4))
    canvas.draw()
    picture = np.asarray(canvas.buffer_rgba())[..., 0]
    corners = find_board(picture, board.shape).reshape(4, 7, 2)
    expected = 100.0 * np.stack(np.meshgrid(np.arange(2, 9), np.arange(2, 6)), axis=-1) - 0.5
    assert np.abs(corners - expected).max() < 0.05
    assert picture[110, 110] < 10  # the top left square is black: a half turn cannot be mistaken


def test_the_pdf_is_as_large_as_the_board_and_always_the_same(tmp_path: Path) -> None:
    for name in ("once", "again"):
        write_print(ds.BOARD, tmp_path / name)
    once, again = ((tmp_path / name / "board.pdf").read_bytes() for name in ("once", "again"))
    assert once == again
    box = re.search(rb"/MediaBox \[ ?0 0 ([\d.]+) ([\d.]+) ?\]", once)
    assert box is not None
    size_mm = [float(side) * 25.4 / 72 for side in box.groups()]
    assert size_mm == pytest.approx([12 * 18.0 + 14, 9 * 18.0 + 14], abs=0.01)


def test_the_folder_is_the_beginning_of_a_calibration_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "board"
    assert main([str(folder), "--corners", "9", "6", "--square", "25"]) == 0
    assert capsys.readouterr().out == f"{folder}: board.pdf and board.toml\n"
    written = (folder / "board.toml").read_text()
    assert written == 'version = 1\ninner_corners = [9, 6]\nsquare = 25.0\nunit = "mm"\n'


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("--square -1", "`square` must be a positive length, got -1.0."),
        ("--corners 2 8", "`shape` must be (nx, ny) of at least 3 inner corners, at most 1000, got (2, 8)."),
        ("--margin 0", "`margin_mm` must be positive, got 0.0."),
        ("--square 500", "`square` must give a print of at most 2000 mm, got (6014.0, 4514.0)."),
    ],
)
def test_a_wrong_option_is_one_line_and_leaves_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: str, message: str
) -> None:
    assert main([str(tmp_path / "board"), *options.split()]) == InputError.exit_code
    assert capsys.readouterr().err == f"error: {message}\n"
    assert list(tmp_path.iterdir()) == []

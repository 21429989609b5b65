"""A calibration board to print, with the `board.toml` that says what it is.

    python -m data_synth.print_board board --corners 11 8 --square 18

writes ``board.pdf``, drawn in its true size, and ``board.toml``; the poses are photographed into the same folder. Print
without scaling, glue it to something flat, measure several squares together, and put their size into `board.toml`.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from data_synth.boards import BOARD, MARGIN_MM
from data_synth.pages import board_page
from data_synth.surfaces import CommandParser
from deskew.errors import DeskewError, require
from deskew.io import write_board
from deskew.io.files import replacing_folder
from deskew.types import Board

LARGEST_MM = 2000.0

_MM_PER_INCH = 25.4
_POINTS_PER_MM = 72 / _MM_PER_INCH


def drawn_board(board: Board, margin_mm: float = MARGIN_MM) -> Figure:
    """Draw a board in its true size, its top left square black.

    Parameters
    ----------
    board : Board
        Corners and squares [mm].
    margin_mm : float
        White all round, positive [mm]; what the squares should measure is written into it.

    Raises
    ------
    InputError
        If there is no margin, or the print is larger than 2 m.
    """
    page = board_page(board, margin_mm)
    (width, height), (nx, ny), side = page.page_size_mm, page.squares, page.square_mm
    require(max(width, height) <= LARGEST_MM, "square", f"give a print of at most {LARGEST_MM:g} mm", (width, height))
    figure = Figure(figsize=(width / _MM_PER_INCH, height / _MM_PER_INCH))
    axes = figure.add_axes((0, 0, 1, 1), frameon=False, xlim=(0, width), ylim=(height, 0), xticks=[], yticks=[])
    at = [(margin_mm + side * i, margin_mm + side * j) for j in range(ny) for i in range(nx) if (i + j) % 2 == 0]
    axes.add_collection(PatchCollection([Rectangle(p, side, side) for p in at], facecolor="black", linewidth=0))
    note = f"{nx} x {ny} squares of {side:g} mm: the print should measure {nx * side:g} x {ny * side:g} mm"
    points = min(0.4 * margin_mm, 4.0) * _POINTS_PER_MM
    axes.text(margin_mm, height - margin_mm / 2, note, fontsize=points, va="center", color="0.5")
    return figure


def write_print(board: Board, folder: Path, margin_mm: float = MARGIN_MM) -> None:
    """Write `board.toml` and `board.pdf` into a new or empty folder; both appear or neither.

    Parameters
    ----------
    board : Board
        Corners and squares [mm].
    folder : Path
        New, or an empty folder.
    margin_mm : float
        White all round [mm].

    Raises
    ------
    InputError
        If a setting is out of range or the folder is not empty.
    StepError
        If the file system refuses.
    """
    figure = drawn_board(board, margin_mm)
    with replacing_folder(folder) as new:
        write_board(board, (), new)
        figure.savefig(new / "board.pdf", metadata={"CreationDate": None})  # the same board, the same bytes


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    parser = CommandParser(prog="python -m data_synth.print_board", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("folder", type=Path, help="new or empty")
    inner = "inner corners, squares less one each way %(default)s"
    parser.add_argument("--corners", type=int, nargs=2, metavar=("NX", "NY"), default=BOARD.shape, help=inner)
    parser.add_argument("--square", type=float, default=BOARD.square, help="side of a square [mm] [%(default)s]")
    parser.add_argument("--margin", type=float, default=MARGIN_MM, help="white all round [mm] [%(default)s]")
    try:
        _write(parser.parse_args(arguments))
    except DeskewError as error:
        print(f"error: {error}", file=sys.stderr)
        return error.exit_code
    return 0


def _write(options: argparse.Namespace) -> None:
    write_print(Board(tuple(options.corners), options.square), options.folder, options.margin)
    print(f"{options.folder}: board.pdf and board.toml")


if __name__ == "__main__":
    sys.exit(main())

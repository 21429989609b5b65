"""The command that takes over captures in another program's layout: `import`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from deskew.cli.options import Json
from deskew.cli.printing import report
from deskew.cli.progress import showing_progress, working
from deskew.errors import require


def import_captures(
    folder: Annotated[
        Path, typer.Argument(metavar="FOLDER", help="Holds capture_0/graycode_00.png and on, one folder a pose.")
    ],
    output: Annotated[Path, typer.Option("--output", "-o", help="Board folder to write, new or empty.")],
    inner_corners: Annotated[
        tuple[int, int], typer.Option("--inner-corners", metavar="NX NY", help="Of the printed board, across and down.")
    ],
    square: Annotated[float, typer.Option("--square", metavar="SIDE", help="Side of a square, in --unit.")],
    unit: Annotated[str, typer.Option("--unit", help="Unit of every length.")] = "mm",
    projector_size: Annotated[
        tuple[int, int], typer.Option("--projector-size", metavar="W H", help="Of the projector [px].")
    ] = (1024, 768),
    as_json: Json = False,
) -> None:
    """Turn Gray-code captures of kamino410/procam-calibration into a board folder for `deskew calibrate`.

    Each pose holds the column bits, the most significant first, then the row bits, each followed by its inverse, then
    all white and all black. Every pose becomes a capture folder; pixels stay as they are.

    Example: deskew import sample_data/ -o board/ --inner-corners 9 7 --square 75 --unit units
    """
    from deskew import io
    from deskew.types import Board

    require(min(projector_size) >= 2, "--projector-size", "be 2 px or more each way", projector_size)
    board = Board(inner_corners, square, unit)
    captures = io.read_procam_graycode(folder, projector_size)
    watched = (showing_progress(capture, f"pose {i:02d}", as_json) for i, capture in enumerate(captures))
    with working("importing", as_json):
        io.write_board(board, watched, output)
    report({"board": str(output), "n_poses": len(captures)}, as_json, output)

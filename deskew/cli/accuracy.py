"""The command that measures the scanner itself: `accuracy`."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from deskew.cli.metadata import accuracy_record, write_metadata
from deskew.cli.options import HEIGHTS, JUMP, NEIGHBOUR, CalibrationFile, Gates, Heights, Json, Jump, Mask, Neighbour
from deskew.cli.printing import depth_figures, report, warn
from deskew.cli.progress import open_capture
from deskew.cli.scanning import read_mask
from deskew.errors import require_positive

if TYPE_CHECKING:
    from deskew.acquisition import PlaneDeviation
    from deskew.types import Board, Calibration, Capture, Correspondence, DepthMap

_FARTHEST = 1e6


def accuracy(
    captures: Annotated[list[Path], typer.Argument(metavar="CAPTURE...", help="Capture folders of a flat page.")],
    calibration: CalibrationFile,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="JSON to write the record to, to be kept with every scan.")
    ] = None,
    board_folder: Annotated[
        Path | None,
        typer.Option(
            "--board",
            metavar="BOARD_FOLDER",
            help="The captures show this calibration board instead: its corners lie on a plane at known distances.",
        ),
    ] = None,
    min_length: Annotated[
        float | None,
        typer.Option("--min-length", metavar="D", help="Shortest length that counts; half the board's diagonal."),
    ] = None,
    radius: Annotated[
        int | None,
        typer.Option(
            "--radius", metavar="PX", help="A corner's depth is that of a plane through so many pixels around."
        ),
    ] = None,
    mask: Mask = None,
    heights: Heights = HEIGHTS,
    neighbour: Neighbour = NEIGHBOUR,
    jump: Jump = JUMP,
    as_json: Json = False,
) -> None:
    """Measure the scanner's accuracy on planes: the deviation of their points from the best-fit plane (section 2.5).

    A plane cannot tell a wrong scale. A board can: with --board, the record also has the error of known lengths.

    Give the record to `deskew scan --accuracy`, and every model has its accuracy beside it.

    Example: deskew accuracy plane_00/ plane_01/ --calibration calibration.json -o accuracy.json

    Example: deskew accuracy board/pose_04 --board board/ --calibration without_04.json --json
    """
    from deskew import acquisition, io

    if output is not None:
        io.require_writable(output, (".json",))
    gates = Gates(heights, neighbour, jump)
    if min_length is not None:
        require_positive("--min-length", min_length, _FARTHEST)
    if radius is not None:
        require_positive("--radius", radius, 1000, "px")
    devices = io.read_calibration(calibration)
    board = None if board_folder is None else io.read_board_file(board_folder)
    rows, deviations = [], []
    for folder in captures:
        capture = open_capture(folder, as_json)
        decoded, depth = _measured(capture, folder, devices, gates)
        more: dict[str, float] = {}
        if board is None:
            deviation = _page_plane(capture, devices, depth, mask)
        else:
            deviation, more = _board_plane(board, capture, decoded, devices, depth, min_length, radius)
        deviations.append(deviation)
        rows.append({"capture": str(folder), **_in(devices.unit, asdict(deviation) | more), **depth_figures(depth)})
    average = _in(devices.unit, asdict(acquisition.average_deviation(deviations)))
    record = accuracy_record(calibration, devices.unit, rows, average)
    if output is not None:
        write_metadata(record, output)
    written = [] if output is None else [output]
    if as_json:
        report(record, as_json, *written)
    for row in () if as_json else (*rows, {"capture": f"average of {len(rows)}", **average}):
        report(row, as_json, *written)


def _in(unit: str, figures: dict[str, Any]) -> dict[str, Any]:
    """Name lengths after the unit that they are in."""
    return {f"{name[:-3]}_{unit}" if name.endswith("_mm") else name: value for name, value in figures.items()}


def _measured(capture: Capture, folder: Path, devices: Calibration, gates: Gates) -> tuple[Correspondence, DepthMap]:
    """Decode a capture and triangulate it: no filter, no correction of ink."""
    from deskew import acquisition, pipeline

    acquisition.require_same_devices(devices, capture)
    decoded = pipeline.decode(capture)
    warn(decoded.projector, folder.name)
    return decoded, acquisition.depth_map(devices, decoded, gates.settings())


def _page_plane(capture: Capture, devices: Calibration, depth: DepthMap, mask: Path | None) -> PlaneDeviation:
    """Deviation of a flat page's points; the desk around it is no part of the plane."""
    import cv2
    import numpy as np

    from deskew import acquisition, restoration

    if mask is not None:
        page = read_mask(mask, capture.camera_size).astype(np.uint8)
        return acquisition.plane_deviation(
            acquisition.depth_points(depth, restoration.undistorted_view(page, devices.camera) > 0)
        )
    corners = acquisition.page_outline(capture.white, capture.black, devices.camera, depth=depth).corners
    inside = np.zeros(depth.z.shape, np.uint8)
    cv2.fillConvexPoly(inside, np.round(corners).astype(np.int32), 1)  # a flat page's outline has four straight sides
    return acquisition.plane_deviation(acquisition.depth_points(depth, inside.astype(bool)))


def _board_plane(
    board: Board,
    capture: Capture,
    decoded: Correspondence,
    devices: Calibration,
    depth: DepthMap,
    min_length: float | None,
    radius: int | None,
) -> tuple[PlaneDeviation, dict[str, float]]:
    """Deviation of a board's corners from a plane, error of the lengths between them, and share of it that is seen."""
    from deskew import acquisition

    view = acquisition.view_board(board, capture, decoded)
    found = acquisition.board_accuracy(board, view.corners, devices.camera, depth, min_length, radius)
    return found.plane, {"length_error_mm": found.length_rms_mm, "depth_coverage": found.coverage}

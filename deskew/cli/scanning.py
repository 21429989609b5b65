"""Commands that measure: `calibrate`, `scan` and `accuracy`."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from deskew.cli.options import CalibrationFile, CaptureFolder, Denoise, Ink, Json, Mask, Shape
from deskew.cli.pictures import Wanted
from deskew.cli.printing import depth_figures, projector_figures, report, warn
from deskew.errors import require
from deskew.recipes import Recipe, recipe_for

if TYPE_CHECKING:
    from deskew.io import StiffnessMap
    from deskew.types import (
        Array,
        Calibration,
        Capture,
        Correspondence,
        DepthMap,
        Frames,
        PatternKind,
        ProjectorCheck,
        Scan,
        Sheet,
    )


_METHOD = "spring"  # a scan that is kept is made for this one, unless the user says how


@dataclass(frozen=True, slots=True)
class _Watched:
    """Frames that show on a terminal how far they have been read; into a log or a pipe they write nothing."""

    frames: Frames
    label: str

    def __len__(self) -> int:
        return len(self.frames)

    def __iter__(self) -> Iterator[Array]:
        from tqdm import tqdm

        yield from tqdm(self.frames, self.label, unit="frame", file=sys.stderr, leave=False, disable=None)


def showing_progress(capture: Capture, label: str) -> Capture:
    """Let a capture's frames show on a terminal how far they have been read."""
    columns = _Watched(capture.columns, f"{label} columns")
    return replace(capture, columns=columns, rows=_Watched(capture.rows, f"{label} rows"))


def open_capture(folder: Path) -> Capture:
    """Read a capture folder, its frames one by one and in sight."""
    from deskew import io

    return showing_progress(io.read_capture(folder), folder.name)


@dataclass(frozen=True, slots=True)
class Scanning:
    """How a page is to be scanned."""

    shape: tuple[int, int]
    mask: Path | None
    method: str
    ink: bool | None
    denoise: bool | None
    stiffness: Path | None = None
    unshaded: bool = False

    def recipe(self, pattern: PatternKind) -> Recipe:
        """Return the method's own recipe, but for what the user says."""
        own = recipe_for(self.method, pattern)
        ink, denoise = own.ink if self.ink is None else self.ink, own.denoise if self.denoise is None else self.denoise
        return replace(own, ink=ink, denoise=denoise)

    def page(self, size: tuple[int, int]) -> Array | None:
        """Read the mask, (height, width) bool."""
        if self.mask is None:
            return None
        from deskew import io

        picture = io.read_image(self.mask, size)
        page: Array = (picture if picture.ndim == 2 else picture.max(axis=-1)) > 0
        require(bool(page.any()), "--mask", "show the page: not black all over", str(self.mask))
        return page

    def materials(self, size: tuple[int, int]) -> StiffnessMap | None:
        """Read the stiffness map; one of another size than the camera's is refused before the long work."""
        if self.stiffness is None:
            return None
        from deskew import io

        found = io.read_stiffness(self.stiffness)
        require(found.size == size, str(self.stiffness), f"be {size[0]}x{size[1]} px", "{}x{} px".format(*found.size))
        return found


def scan_page(folder: Path, calibration: Calibration, how: Scanning, wanted: Wanted | None = None) -> Scan:
    """Scan a page as asked; what cannot be `wanted` of it is refused before the long work."""
    allowed = all(2 <= n <= 1000 for n in how.shape)
    require(allowed, "--shape", "be 2 to 1000 vertices down and across", f"{how.shape[0]} {how.shape[1]}")
    capture = open_capture(folder)  # before the import below: a wrong folder is then refused within the blink of an eye
    unshaded = _unshaded(capture, how, wanted)
    mask, materials = how.page(capture.camera_size), how.materials(capture.camera_size)
    from deskew import pipeline

    found = pipeline.scan_by(how.recipe(capture.pattern), capture, calibration, shape=how.shape, mask=mask)
    warn(found.projector, folder.name)
    if unshaded:
        found = pipeline.with_shading_removed(found, capture, calibration, how.recipe(capture.pattern))
    return found if materials is None else pipeline.with_stiffness(found, materials)


def _unshaded(capture: Capture, how: Scanning, wanted: Wanted | None) -> bool:
    """Tell whether the light `unshaded` is to be made; refuse what the capture's lights and it cannot give."""
    if wanted is None and not how.unshaded:
        return False
    from deskew.restoration import UNSHADED
    from deskew.types import WHITE

    known = [WHITE, *capture.textures]
    asked = how.unshaded or (wanted is not None and UNSHADED in wanted.needed(known))
    if asked:
        free = UNSHADED not in known
        require(free, "textures", f"leave the name {UNSHADED} to the page without shading", "a light of that name")
        known.append(UNSHADED)
    if wanted is not None:
        wanted.check(known)
    return asked


def calibrate(
    board_folder: Annotated[Path, typer.Argument(metavar="BOARD_FOLDER", help="board.toml, pose_00/, pose_01/, ...")],
    output: Annotated[Path, typer.Option("--output", "-o", help="calibration.json to write.")],
    as_json: Json = False,
) -> None:
    """Calibrate camera and projector from captures of a printed checkerboard.

    Pose 00 lies on the bed and defines the world: Z = 0, X right and Y up in the camera's picture.

    Example: deskew calibrate board/ -o calibration.json
    """
    from deskew import io, pipeline

    io.require_writable(output, (".json",))
    board, captures = io.read_board(board_folder)
    watched = [showing_progress(capture, f"pose {i:02d}") for i, capture in enumerate(captures)]
    checks: list[ProjectorCheck] = []

    def watch(decoded: Correspondence) -> None:
        warn(decoded.projector, f"pose {len(checks):02d}")
        checks.append(decoded.projector)

    calibration = pipeline.calibrate(board, watched, watch=watch)
    io.write_calibration(calibration, output)
    faulty = [f"pose_{i:02d}" for i, check in enumerate(checks) if check.faults]
    figures = {"n_poses": calibration.n_poses, **calibration.residuals, **calibration.convergence}
    report(
        {"calibration": str(output), **figures} | ({"projector_faults_in": faulty} if faulty else {}), as_json, output
    )


def scan(
    capture: CaptureFolder,
    calibration: CalibrationFile,
    output: Annotated[Path, typer.Option("--output", "-o", help="scan.npz (everything) or scan.ply (the mesh).")],
    shape: Shape = (45, 45),
    mask: Mask = None,
    ink: Ink = None,
    denoise: Denoise = None,
    unshaded: Annotated[
        bool,
        typer.Option("--unshaded", help="Keep the light `unshaded` too: white without the projector's shading."),
    ] = False,
    as_json: Json = False,
) -> None:
    """Measure the page's 3D shape: depth map and mesh, in millimetres.

    A PLY carries texture coordinates into the raw white image; `deskew restore` needs the NPZ. For the paper's methods
    scan as the paper does: --no-ink --no-denoise.

    Example: deskew scan page/ --calibration calibration.json -o scan.npz
    """
    from deskew import io, projection

    io.require_writable(output, (".npz", ".ply"))
    found = scan_page(
        capture, io.read_calibration(calibration), Scanning(shape, mask, _METHOD, ink, denoise, unshaded=unshaded)
    )
    if output.suffix.lower() == ".npz":
        io.write_scan(found, output)
    else:
        size = found.camera.size
        # Texture coordinates run from the picture's lower left corner, and a pixel's centre lies half a pixel inside.
        texture = (projection.project(found.camera, found.sheet.vertices) + 0.5) / size
        texture[..., 1] = 1.0 - texture[..., 1]
        io.write_mesh(io.sheet_mesh(found.sheet, texture), output)
    figures = {"scan": str(output), "vertices": found.sheet.vertices[..., 0].size, **depth_figures(found.depth)}
    figures |= {"filled_fraction": found.filled_fraction, "cut_quads": _cut_quads(found.sheet)}
    report(figures | projector_figures(found.projector), as_json, output)


def _cut_quads(sheet: Sheet) -> int:
    return 0 if sheet.cut is None else int(sheet.cut.sum())


def accuracy(
    captures: Annotated[list[Path], typer.Argument(metavar="CAPTURE...", help="Capture folders of a flat page.")],
    calibration: CalibrationFile,
    as_json: Json = False,
) -> None:
    """Measure the scanner's accuracy on planes: the deviation of their points from the best-fit plane (section 2.5).

    Example: deskew accuracy plane_00/ plane_01/ --calibration calibration.json --json
    """
    from dataclasses import asdict

    from deskew import acquisition, io

    devices = io.read_calibration(calibration)
    rows, deviations = [], []
    for folder in captures:
        depth, page = _flat_page(folder, devices)
        deviations.append(acquisition.plane_deviation(acquisition.depth_points(depth, page)))
        rows.append({"capture": str(folder), **asdict(deviations[-1]), **depth_figures(depth)})
    average = asdict(acquisition.average_deviation(deviations))
    if as_json:
        report({"planes": rows, "average": average}, as_json)
    for row in () if as_json else (*rows, {"capture": f"average of {len(rows)}", **average}):
        report(row, as_json)


def _flat_page(folder: Path, devices: Calibration) -> tuple[DepthMap, Array]:
    """Depth of a flat page's capture, and which pixels lie on the page: the desk around it is no part of the plane."""
    import cv2
    import numpy as np

    from deskew import acquisition, pipeline

    capture = open_capture(folder)
    acquisition.require_same_devices(devices, capture)
    decoded = pipeline.decode(capture)
    warn(decoded.projector, folder.name)
    depth = acquisition.depth_map(devices, decoded)
    corners = acquisition.page_outline(capture.white, capture.black, devices.camera, depth=depth).corners
    inside = np.zeros(depth.z.shape, np.uint8)
    cv2.fillConvexPoly(inside, np.round(corners).astype(np.int32), 1)  # a flat page's outline has four straight sides
    return depth, inside.astype(bool)

"""Commands that measure devices and shapes: `calibrate` and `scan`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from deskew.cli.metadata import Record, read_record, write_metadata
from deskew.cli.options import (
    HEIGHTS,
    HOLE,
    JUMP,
    NEIGHBOUR,
    CalibrationFile,
    CaptureFolder,
    Denoise,
    Gates,
    Heights,
    Hole,
    Ink,
    Json,
    Jump,
    Mask,
    Neighbour,
    Shape,
)
from deskew.cli.pictures import Wanted, all_or_none
from deskew.cli.printing import depth_figures, projector_figures, report, warn
from deskew.cli.progress import open_capture, showing_progress, working
from deskew.errors import require
from deskew.recipes import Recipe, recipe_for
from deskew.types import WHITE

if TYPE_CHECKING:
    from deskew.io import StiffnessMap
    from deskew.types import (
        Array,
        Calibration,
        Capture,
        Correspondence,
        Floats,
        PatternKind,
        ProjectorCheck,
        Scan,
        Sheet,
    )


_METHOD = "spring"  # a scan that is kept is made for this one, unless the user says how


def read_mask(path: Path, size: tuple[int, int]) -> Array:
    """Read where the page is in the camera's picture, (height, width) bool."""
    from deskew import io

    picture = io.read_image(path, size)
    page: Array = (picture if picture.ndim == 2 else picture.max(axis=-1)) > 0
    require(bool(page.any()), "--mask", "show the page: not black all over", str(path))
    return page


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
    gates: Gates = field(default_factory=Gates)
    quiet: bool = False

    def recipe(self, pattern: PatternKind) -> Recipe:
        """Return the method's own recipe, but for what the user says."""
        own = recipe_for(self.method, pattern)
        ink, denoise = own.ink if self.ink is None else self.ink, own.denoise if self.denoise is None else self.denoise
        return replace(own, ink=ink, denoise=denoise)

    def page(self, size: tuple[int, int]) -> Array | None:
        """Read the mask, (height, width) bool."""
        return None if self.mask is None else read_mask(self.mask, size)

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
    # Before the import below: a wrong folder is then refused within the blink of an eye.
    capture = open_capture(folder, how.quiet)
    unshaded = _unshaded(capture, how, wanted)
    mask, materials = how.page(capture.camera_size), how.materials(capture.camera_size)
    from deskew import pipeline

    depth, recipe = how.gates.settings(), how.recipe(capture.pattern)
    with working(f"{folder.name}: measuring", how.quiet):
        found = pipeline.scan_by(
            recipe, capture, calibration, shape=how.shape, mask=mask, depth=depth, max_hole_px=how.gates.hole
        )
    warn(found.projector, folder.name)
    if unshaded:
        found = pipeline.with_shading_removed(found, capture, calibration, recipe)
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
    leave_out: Annotated[
        list[int] | None,
        typer.Option("--leave-out", metavar="POSE", help="Number of a pose not to be used; may be repeated."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Calibrate camera and projector from captures of a printed checkerboard.

    Pose 00 lies on the bed and defines the world: Z = 0, X right and Y up in the camera's picture. If it is left out,
    the first of the others does.

    Example: deskew calibrate board/ -o calibration.json
    """
    from deskew import io, pipeline

    io.require_writable(output, (".json",))
    board, captures = io.read_board(board_folder)
    out = set(leave_out or ())
    known = out <= set(range(len(captures)))
    require(known, "--leave-out", f"be a pose in [0, {len(captures) - 1}]", sorted(out))
    kept = [i for i in range(len(captures)) if i not in out]
    checks: dict[int, ProjectorCheck] = {}

    def watch(decoded: Correspondence) -> None:
        i = kept[len(checks)]
        warn(decoded.projector, f"pose {i:02d}")
        checks[i] = decoded.projector

    with working("calibrating", as_json):
        poses = [showing_progress(captures[i], f"pose {i:02d}", as_json) for i in kept]
        calibration = pipeline.calibrate(board, poses, watch=watch)
    io.write_calibration(calibration, output)
    faulty = [f"pose_{i:02d}" for i, check in checks.items() if check.faults]
    figures = {"n_poses": calibration.n_poses, **calibration.residuals, **calibration.convergence}
    report(
        {"calibration": str(output), **figures} | ({"projector_faults_in": faulty} if faulty else {}), as_json, output
    )


def scan(
    capture: CaptureFolder,
    calibration: CalibrationFile,
    output: Annotated[
        Path, typer.Option("--output", "-o", help="scan.npz (everything), or scan.ply or scan.obj (the mesh).")
    ],
    shape: Shape = (45, 45),
    mask: Mask = None,
    ink: Ink = None,
    denoise: Denoise = None,
    unshaded: Annotated[
        bool,
        typer.Option("--unshaded", help="Keep the light `unshaded` too: white without the projector's shading."),
    ] = False,
    heights: Heights = HEIGHTS,
    neighbour: Neighbour = NEIGHBOUR,
    jump: Jump = JUMP,
    hole: Hole = HOLE,
    accuracy: Annotated[
        Path | None,
        typer.Option(
            "--accuracy",
            metavar="RECORD.json",
            help="Accuracy of the same calibration, from `deskew accuracy`, to be kept beside the scan, in scan.json.",
        ),
    ] = None,
    as_json: Json = False,
) -> None:
    """Measure the page's 3D shape: depth map and mesh, in the calibration's unit.

    A PLY or OBJ has texture coordinates into the raw white image, which is written beside it, scan-white.png: MeshLab
    and Blender show the one on the other. `deskew restore` needs the NPZ. For the paper's methods scan as the paper
    does: --no-ink --no-denoise.

    Example: deskew scan page/ --calibration calibration.json -o scan.npz

    Example: deskew scan page/ --calibration calibration.json -o page.ply --accuracy accuracy.json
    """
    from deskew import io

    io.require_writable(output, (".npz", *io.MESH_SUFFIXES))
    how = Scanning(
        shape,
        mask,
        _METHOD,
        ink,
        denoise,
        unshaded=unshaded,
        gates=Gates(heights, neighbour, jump, hole),
        quiet=as_json,
    )
    devices = io.read_calibration(calibration)
    record = None if accuracy is None else read_record(accuracy, calibration)
    found = scan_page(capture, devices, how)
    figures = {"scan": str(output), "vertices": found.sheet.vertices[..., 0].size, **depth_figures(found.depth)}
    figures |= {"filled_fraction": found.filled_fraction, "cut_quads": _cut_quads(found.sheet)}
    figures |= projector_figures(found.projector)
    written = _write(found, output, record, figures)
    report(figures, as_json, *written)


def _write(found: Scan, output: Path, record: Record | None, figures: Mapping[str, Any]) -> list[Path]:
    """Write a scan with what goes beside it, all or nothing; return the files."""
    from deskew import io

    beside = [] if record is None else [output.with_suffix(".json")]
    is_mesh = output.suffix.lower() != ".npz"
    picture = output.with_name(f"{output.stem}-{WHITE}.png")
    material = [output.with_suffix(".mtl")] if output.suffix.lower() == ".obj" else []
    written = [output, *([picture, *material] if is_mesh else []), *beside]
    for path in written:
        io.require_writable(path, (path.suffix.lower(),))
    with all_or_none(written):
        if is_mesh:
            io.write_image(found.images[WHITE], picture, profile=found.profiles.get(WHITE))
            io.write_mesh(io.sheet_mesh(found.sheet, _texture(found)), output, picture.name)
        else:
            io.write_scan(found, output)
        if record is not None:
            write_metadata({**figures, "unit": found.unit, "accuracy": record}, beside[0])
    return written


def _texture(found: Scan) -> Floats:
    """Texture coordinates of a sheet's vertices in the raw white image."""
    from deskew import projection

    # They run from the picture's lower left corner, and a pixel's centre lies half a pixel inside.
    texture = (projection.project(found.camera, found.sheet.vertices) + 0.5) / found.camera.size
    texture[..., 1] = 1.0 - texture[..., 1]
    return texture


def _cut_quads(sheet: Sheet) -> int:
    return 0 if sheet.cut is None else int(sheet.cut.sum())

"""The ``deskew`` command: capture folders in; calibrations, scans, figures and restored pages out.

Figures go to stdout, one a line or, with --json, as one JSON object; progress and errors go to stderr. Exit codes:
0 done, 2 a wrong input, 3 a step that failed on valid input. Nothing is written unless the work succeeds; if only the
figures cannot be printed afterwards, the error says that the file is there.
"""

from __future__ import annotations

import json
import math
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from deskew.errors import DeskewError, StepError, require

# The stages are imported inside the commands: --help and wrong options answer at once, without numba and OpenCV.
if TYPE_CHECKING:
    from deskew.types import (
        Array,
        Calibration,
        Capture,
        Correspondence,
        DepthMap,
        Frames,
        ProjectorCheck,
        Restoration,
        Scan,
        Sheet,
    )

app = typer.Typer(
    help="Restore an arbitrarily warped page from its 3D shape.",
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

_PICTURES = (".png", ".tif", ".tiff")

CaptureFolder = Annotated[
    Path, typer.Argument(metavar="CAPTURE", help="Capture folder (capture.toml, white.png, ...).")
]
CalibrationFile = Annotated[Path, typer.Option("--calibration", "-c", help="calibration.json of the same devices.")]
Shape = Annotated[tuple[int, int], typer.Option("--shape", metavar="R C", help="Mesh vertices down and across.")]
Mask = Annotated[
    Path | None,
    typer.Option("--mask", metavar="IMAGE", help="The page in the camera's picture, not black; found if not given."),
]
Ink = Annotated[bool, typer.Option("--ink", help="Take out what ink does to the depth; the paper does not.")]
Denoise = Annotated[
    bool, typer.Option("--denoise", help="Filter the depth, its creases kept; use with --ink on a printed page.")
]
Method = Annotated[str, typer.Option("--method", "-m", help="Flattening method.")]
Lights = Annotated[
    list[str] | None,
    typer.Option("--light", "-l", metavar="NAME", help="Light to restore; may be repeated. White unless any is named."),
]
Combine = Annotated[
    list[str] | None,
    typer.Option(
        "--combine",
        metavar="HOW",
        help="mean, max, ratio:A/B or components of the named lights, or of all; may be repeated.",
    ),
]
Scale = Annotated[float, typer.Option("--scale", metavar="S", help="Restored pixels for each of the camera's.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout.")]


@dataclass(frozen=True, slots=True)
class _Wanted:
    """Which pictures of a page are asked for, and where; plain white if neither lights nor combinations are named."""

    output: Path
    lights: tuple[str, ...]
    combine: tuple[str, ...]
    scale: float

    @classmethod
    def of(cls, output: Path, lights: Sequence[str] | None, combine: Sequence[str] | None, scale: float) -> _Wanted:
        require(math.isfinite(scale) and 0 < scale <= 16, "--scale", "lie in (0, 16]", scale)
        return cls(output, tuple(dict.fromkeys(lights or ())), tuple(dict.fromkeys(combine or ())), scale)

    @property
    def shown(self) -> tuple[str, ...]:
        """Lights that are a picture of their own."""
        from deskew.types import WHITE

        return self.lights or (() if self.combine else (WHITE,))

    def combined(self, how: str, known: Sequence[str]) -> list[str]:
        """Return the lights that a combination is made of: a ratio's two, else those that are named, else all."""
        from deskew import restoration

        return restoration.lights_of(how, self.lights or known)

    def needed(self, known: Sequence[str]) -> list[str]:
        """Return the lights to restore, each once."""
        combined = [light for how in self.combine for light in self.combined(how, known)]
        return list(dict.fromkeys([*self.shown, *combined]))

    def paths(self, known: Sequence[str]) -> dict[str, Path]:
        """Name one picture as asked, several after what each shows."""
        from deskew import restoration

        names = [*self.shown]
        for how in self.combine:
            names += restoration.pictures_of(how, self.combined(how, known))
        twice = sorted({name for name in names if names.count(name) > 1})
        require(not twice, "--combine", "give pictures of different names", f"several called {', '.join(twice)}")
        if len(names) == 1:
            return {names[0]: self.output}
        return {name: self.output.with_name(f"{self.output.stem}-{name}{self.output.suffix}") for name in names}

    def check(self, known: Sequence[str]) -> None:
        """Refuse what these lights cannot give, and where it cannot be written, before any long work."""
        from deskew import io, restoration

        for light in self.lights:
            require(light in known, "--light", f"be one of {', '.join(known)}", light)
        for how in self.combine:
            ratio = how.startswith("ratio:")
            restoration.require_combination(how, known if ratio else self.lights or known)
        for path in self.paths(known).values():
            io.require_writable(path, _PICTURES)


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


def _watched(capture: Capture, label: str) -> Capture:
    columns = _Watched(capture.columns, f"{label} columns")
    return replace(capture, columns=columns, rows=_Watched(capture.rows, f"{label} rows"))


def _open(folder: Path) -> Capture:
    from deskew import io

    return _watched(io.read_capture(folder), folder.name)


@dataclass(frozen=True, slots=True)
class _Scanning:
    """How a page is to be scanned."""

    shape: tuple[int, int]
    mask: Path | None
    ink: bool
    denoise: bool

    def page(self, size: tuple[int, int]) -> Array | None:
        """Read the mask, (height, width) bool."""
        if self.mask is None:
            return None
        from deskew import io

        picture = io.read_image(self.mask, size)
        page: Array = (picture if picture.ndim == 2 else picture.max(axis=-1)) > 0
        require(bool(page.any()), "--mask", "show the page: not black all over", str(self.mask))
        return page


def _scan(folder: Path, calibration: Calibration, how: _Scanning, wanted: _Wanted | None = None) -> Scan:
    allowed = all(2 <= n <= 1000 for n in how.shape)
    require(allowed, "--shape", "be 2 to 1000 vertices down and across", f"{how.shape[0]} {how.shape[1]}")
    capture = _open(folder)  # before the import below: a wrong folder is then refused within the blink of an eye
    if wanted is not None:
        from deskew.types import WHITE

        wanted.check([WHITE, *capture.textures])
    mask = how.page(capture.camera_size)
    from deskew import acquisition, pipeline

    found = pipeline.scan(
        capture,
        calibration,
        shape=how.shape,
        mask=mask,
        ink=acquisition.InkSettings() if how.ink else None,
        denoise=acquisition.DenoiseSettings() if how.denoise else None,
    )
    _warn(found.projector, folder.name)
    return found


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(part) for part in value]
    if hasattr(value, "item"):  # a number of numpy's
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value  # JSON has no NaN


def _report(figures: Mapping[str, Any], as_json: bool, *written: Path) -> None:
    """Print figures, and say what has been `written` already if nobody takes them."""
    plain = _plain(figures)
    lines = [f"{key}: {f'{value:.6g}' if isinstance(value, float) else value}" for key, value in plain.items()]
    try:
        print(json.dumps(plain) if as_json else "\n".join(lines), flush=True)
    except OSError as error:
        # Else the interpreter would try once more to print what is left in the buffer, and complain in its own words.
        with suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        named = ", ".join(f"`{path}`" for path in written)
        whole = "is written and whole" if len(written) == 1 else "are written and whole"
        done = f"{named} {whole}" if written else "nothing was to be written"
        raise StepError(f"Printing the figures failed: {error.strerror or error}; {done}.") from error


def _depth_figures(depth: DepthMap) -> dict[str, Any]:
    from deskew.types import Reason

    reason = depth.reason
    missing = {kind.name.lower(): int((reason == kind).sum()) for kind in Reason if kind is not Reason.OK}
    return {"depth_pixels": int((reason == 0).sum()), "missing_pixels": missing}


def _warn(check: ProjectorCheck, name: str) -> None:
    """Say on stderr what is wrong with the projector; the work goes on, since only its user can judge the result."""
    for fault in check.faults:
        _say(f"warning: {name}: {fault}")


def _projector_figures(check: ProjectorCheck) -> dict[str, Any]:
    """Name what the frames say of the projector; nothing where they could not tell."""
    known = {"projector_gamma": check.gamma, "projector_stray": check.stray}
    figures: dict[str, Any] = {name: value for name, value in known.items() if value is not None}
    return {**figures, "projector_faults": list(check.faults)} if figures or check.faults else {}


def _restored_figures(restoration: Restoration) -> dict[str, Any]:
    """Status and counters; a page that did not come to rest flat is still shown, and said so on stderr."""
    from deskew.types import Status

    flattened = restoration.flattened
    if flattened is None:
        return {}
    if flattened.status is not Status.AT_REST:
        _say(f"warning: the page is {flattened.status}, not at rest and flat: {flattened.remedy}")
    return {"status": str(flattened.status), **flattened.counters}


@app.command()
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
    watched = [_watched(capture, f"pose {i:02d}") for i, capture in enumerate(captures)]
    checks: list[ProjectorCheck] = []

    def watch(decoded: Correspondence) -> None:
        _warn(decoded.projector, f"pose {len(checks):02d}")
        checks.append(decoded.projector)

    calibration = pipeline.calibrate(board, watched, watch=watch)
    io.write_calibration(calibration, output)
    faulty = [f"pose_{i:02d}" for i, check in enumerate(checks) if check.faults]
    figures = {"n_poses": calibration.n_poses, **calibration.residuals, **calibration.convergence}
    _report(
        {"calibration": str(output), **figures} | ({"projector_faults_in": faulty} if faulty else {}), as_json, output
    )


@app.command()
def scan(
    capture: CaptureFolder,
    calibration: CalibrationFile,
    output: Annotated[Path, typer.Option("--output", "-o", help="scan.npz (everything) or scan.ply (the mesh).")],
    shape: Shape = (45, 45),
    mask: Mask = None,
    ink: Ink = False,
    denoise: Denoise = False,
    as_json: Json = False,
) -> None:
    """Measure the page's 3D shape: depth map and mesh, in millimetres.

    A PLY carries texture coordinates into the raw white image; `deskew restore` needs the NPZ.

    Example: deskew scan page/ --calibration calibration.json -o scan.npz
    """
    from deskew import io, projection

    io.require_writable(output, (".npz", ".ply"))
    found = _scan(capture, io.read_calibration(calibration), _Scanning(shape, mask, ink, denoise))
    if output.suffix.lower() == ".npz":
        io.write_scan(found, output)
    else:
        size = found.camera.size
        # Texture coordinates run from the picture's lower left corner, and a pixel's centre lies half a pixel inside.
        texture = (projection.project(found.camera, found.sheet.vertices) + 0.5) / size
        texture[..., 1] = 1.0 - texture[..., 1]
        io.write_mesh(io.sheet_mesh(found.sheet, texture), output)
    figures = {"scan": str(output), "vertices": found.sheet.vertices[..., 0].size, **_depth_figures(found.depth)}
    figures |= {"filled_fraction": found.filled_fraction, "cut_quads": _cut_quads(found.sheet)}
    _report(figures | _projector_figures(found.projector), as_json, output)


def _cut_quads(sheet: Sheet) -> int:
    return 0 if sheet.cut is None else int(sheet.cut.sum())


@app.command()
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
        rows.append({"capture": str(folder), **asdict(deviations[-1]), **_depth_figures(depth)})
    average = asdict(acquisition.average_deviation(deviations))
    if as_json:
        _report({"planes": rows, "average": average}, as_json)
    for row in () if as_json else (*rows, {"capture": f"average of {len(rows)}", **average}):
        _report(row, as_json)


def _flat_page(folder: Path, devices: Calibration) -> tuple[DepthMap, Array]:
    """Depth of a flat page's capture, and which pixels lie on the page: the desk around it is no part of the plane."""
    import cv2
    import numpy as np

    from deskew import acquisition, pipeline

    capture = _open(folder)
    acquisition.require_same_devices(devices, capture)
    decoded = pipeline.decode(capture)
    _warn(decoded.projector, folder.name)
    depth = acquisition.depth_map(devices, decoded)
    corners = acquisition.page_outline(capture.white, capture.black, devices.camera, depth=depth).corners
    inside = np.zeros(depth.z.shape, np.uint8)
    cv2.fillConvexPoly(inside, np.round(corners).astype(np.int32), 1)  # a flat page's outline has four straight sides
    return depth, inside.astype(bool)


@app.command()
def restore(
    scan_file: Annotated[Path, typer.Argument(metavar="SCAN", help="scan.npz from `deskew scan`.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="Image to write: .png or .tif.")],
    method: Method = "paper_euler",
    lights: Lights = None,
    combine: Combine = None,
    scale: Scale = 1.0,
    as_json: Json = False,
) -> None:
    """Flatten a scanned page and texture it: the restored image, under any of its lights.

    With more than one picture each is named after its light or combination: restored-uv.png, restored-mean.png.

    Example: deskew restore scan.npz -o restored.png --light white --light uv --combine ratio:uv/white
    """
    from deskew import io

    io.require_writable(output, _PICTURES)
    wanted = _Wanted.of(output, lights, combine, scale)
    found = io.read_scan(scan_file)
    wanted.check(list(found.images))
    _restore(found, method, wanted, as_json)


@app.command()
def run(
    capture: CaptureFolder,
    calibration: CalibrationFile,
    output: Annotated[Path, typer.Option("--output", "-o", help="Image to write: .png or .tif.")],
    method: Method = "paper_euler",
    shape: Shape = (45, 45),
    mask: Mask = None,
    ink: Ink = False,
    denoise: Denoise = False,
    lights: Lights = None,
    combine: Combine = None,
    scale: Scale = 1.0,
    as_json: Json = False,
) -> None:
    """Take a capture folder to a restored page: scan, flatten, texture, under any of its lights.

    With more than one picture each is named after its light or combination: restored-uv.png, restored-mean.png.

    Example: deskew run page/ --calibration calibration.json -o restored.png --light uv
    """
    from deskew import io

    io.require_writable(output, _PICTURES)
    _require_method(method)
    wanted = _Wanted.of(output, lights, combine, scale)
    how = _Scanning(shape, mask, ink, denoise)
    _restore(_scan(capture, io.read_calibration(calibration), how, wanted), method, wanted, as_json)


def _require_method(method: str) -> None:
    """Refuse an unknown method before the long work rather than after it."""
    from deskew.flattening import find_method

    find_method(method)


def _restore(found: Scan, method: str, wanted: _Wanted, as_json: bool) -> None:
    import numpy as np

    from deskew import pipeline, restoration

    known = list(found.images)
    needed = wanted.needed(known)
    restored = pipeline.restore_lights(found, method=method, lights=needed, scale=wanted.scale)
    page = np.isfinite(restored.backward_map[..., 0])
    pictures = {light: restored.images[light] for light in wanted.shown}
    for how in wanted.combine:
        parts = {light: restored.images[light] for light in wanted.combined(how, known)}
        pictures |= restoration.combined(parts, page, how)
    paths = wanted.paths(known)
    figures: dict[str, Any] = {"restored": [str(path) for path in paths.values()], "method": method}
    if len(paths) == 1:
        figures["restored"] = str(wanted.output)
    figures |= _restored_figures(restored.restoration(needed[0]))
    for light, fit in restored.registrations.items():
        figures |= {f"{light}_scale": fit.scale.tolist(), f"{light}_offset_px": fit.offset.tolist()}
        figures[f"{light}_residual_px"] = fit.residual_px
    figures |= _projector_figures(found.projector)
    _write_all(pictures, paths)
    _report(figures, as_json, *paths.values())


def _write_all(pictures: Mapping[str, Array], paths: Mapping[str, Path]) -> None:
    """Write every picture or leave none behind."""
    from deskew import io

    try:
        for name, path in paths.items():
            io.write_image(pictures[name], path)
    except BaseException:
        for path in paths.values():
            path.unlink(missing_ok=True)
        raise


def _say(message: str) -> None:
    """Write one line to stderr, whatever line breaks or escape codes a file's name or content brought along."""
    line = " ".join(message.split())
    print("deskew: " + "".join(c if c.isprintable() else "?" for c in line), file=sys.stderr)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return the exit code.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments after the program's name; those of the process by default.

    Returns
    -------
    int
        0 done, 2 wrong input or usage, 3 a step failed, 130 interrupted.
    """
    try:
        # Typer's own handling would print usage, a hint and the error: three lines and no house wording.
        return int(app(args=None if argv is None else list(argv), prog_name="deskew", standalone_mode=False) or 0)
    except typer.TyperException as error:
        _say(f"{error.format_message()} (deskew --help shows what is allowed)")
        return 2
    except DeskewError as error:
        _say(str(error))
        return error.exit_code
    except (OSError, MemoryError) as error:
        _say(f"The system refused: {error or 'out of memory'}; free some room or name another place.")
        return 3
    except (KeyboardInterrupt, typer.Abort):
        _say("interrupted; nothing was written.")
        return 130

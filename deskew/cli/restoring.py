"""Commands that restore: `restore` and `run`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from deskew.cli.batch import Batch
from deskew.cli.flattening import require_method
from deskew.cli.options import (
    HEIGHTS,
    HOLE,
    JUMP,
    NEIGHBOUR,
    CalibrationFile,
    Combine,
    Denoise,
    FreeScale,
    Gates,
    Heights,
    Hole,
    Ink,
    Json,
    Jump,
    Lights,
    Mask,
    Method,
    Neighbour,
    Scale,
    Shape,
    Stiffness,
)
from deskew.cli.pictures import PICTURES, Wanted, write_pictures
from deskew.cli.printing import flattened_figures, projector_figures, report
from deskew.cli.progress import working
from deskew.cli.scanning import Scanning, scan_page
from deskew.errors import require
from deskew.plugins import Kind

if TYPE_CHECKING:
    from deskew.types import Scan

SCALING = "spring"  # the one method that finds a material's scale


class Suffix(StrEnum):
    """Format of a batch's pictures."""

    PNG = "png"
    TIFF = "tif"


def restore(
    scan_file: Annotated[Path, typer.Argument(metavar="SCAN", help="scan.npz from `deskew scan`.")],
    output: Annotated[Path, typer.Option("--output", "-o", help="Image to write: .png or .tif.")],
    method: Method = "spring",
    stiffness: Stiffness = None,
    free_scale: FreeScale = False,
    lights: Lights = None,
    combine: Combine = None,
    scale: Scale = 1.0,
    as_json: Json = False,
) -> None:
    """Flatten a scanned page and texture it: the restored image, under any of its lights.

    With more than one picture each is named after its light or combination: restored-uv.png, restored-mean.png. They
    keep the bits and the colour profile of their lights, and state their dots per inch.

    A stiffness map has the white image's frame. A scan made with --unshaded has the light `unshaded`: the page without
    the projector's shading.

    Example: deskew restore scan.npz -o restored.png --light white --light uv --combine ratio:uv/white
    """
    from deskew import io

    io.require_writable(output, PICTURES)
    restoring = Restoring.of(method, Wanted.of(output, lights, combine, scale), stiffness, free_scale, as_json)
    materials = None if stiffness is None else io.read_stiffness(stiffness)
    found = io.read_scan(scan_file)
    restoring.wanted.check(list(found.images))
    if materials is not None:
        from deskew import pipeline

        found = pipeline.with_stiffness(found, materials)
    figures, paths = restoring.restore(found)
    report(figures, as_json, *paths)


def run(
    captures: Annotated[
        list[Path], typer.Argument(metavar="CAPTURE...", help="Capture folders (capture.toml, white.png, ...).")
    ],
    calibration: CalibrationFile,
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Image to write, .png or .tif; a folder for a batch of captures.")
    ],
    method: Method = "spring",
    stiffness: Stiffness = None,
    free_scale: FreeScale = False,
    shape: Shape = (45, 45),
    mask: Mask = None,
    ink: Ink = None,
    denoise: Denoise = None,
    lights: Lights = None,
    combine: Combine = None,
    scale: Scale = 1.0,
    heights: Heights = HEIGHTS,
    neighbour: Neighbour = NEIGHBOUR,
    jump: Jump = JUMP,
    hole: Hole = HOLE,
    suffix: Annotated[Suffix, typer.Option("--format", help="Of a batch's pictures.")] = Suffix.PNG,
    as_json: Json = False,
) -> None:
    """Take a capture folder to a restored page, or many: scan, flatten, texture, under any of its lights.

    With more than one picture each is named after its light or combination: restored-uv.png, restored-mean.png. They
    keep the bits and the colour profile of their lights, and state their dots per inch.

    A stiffness map has the white image's frame. The light `unshaded` is white without the projector's shading, which
    the page's shape tells.

    A batch gives each capture a folder of its name in OUTPUT, with its pictures and their figures (run.json), whole or
    not at all. A capture that fails stops no other: it is told with its reason, listed in batch.json, and the code is 3
    at the end. The same line again does what is missing, failed or changed: a capture, an option, the version.

    Example: deskew run page/ --calibration calibration.json -o restored.png --light all

    Example: deskew run pages/* --calibration calibration.json -o restored/
    """
    from deskew import io

    many = len(captures) > 1 or (output.is_dir() and output.suffix.lower() not in PICTURES)
    picture = Path(f"restored.{suffix}") if many else output
    if not many:
        io.require_writable(output, PICTURES)
    restoring = Restoring.of(method, Wanted.of(picture, lights, combine, scale), stiffness, free_scale, as_json)
    gates = Gates(heights, neighbour, jump, hole)
    how = Scanning(shape, mask, method, ink, denoise, stiffness, gates=gates, quiet=as_json)
    devices = io.read_calibration(calibration)

    def restored(capture: Path, picture: Path) -> tuple[dict[str, Any], list[Path]]:
        job = restoring.to(picture)
        return job.restore(scan_page(capture, devices, how, job.wanted))

    if not many:
        figures, paths = restored(captures[0], output)
        report(figures, as_json, *paths)
        return
    options = {"scanning": asdict(how) | {"quiet": None}, "restoring": asdict(restoring) | {"quiet": None}}
    inputs = [path for path in (calibration, mask, stiffness, stiffness and stiffness.with_suffix(".toml")) if path]
    Batch(output, picture.name, options, tuple(inputs), as_json).run(captures, restored)


@dataclass(frozen=True, slots=True)
class Restoring:
    """How a scanned page is to be restored, and into which pictures."""

    method: str
    kind: Kind
    wanted: Wanted
    settings: Mapping[str, object]
    quiet: bool

    @classmethod
    def of(cls, method: str, wanted: Wanted, stiffness: Path | None, free_scale: bool, quiet: bool) -> Restoring:
        """Take the options of a command; what the method cannot do is refused before the long work."""
        kind = require_method(method, tuple(Kind))
        if kind is not Kind.FLATTENER:  # it restores the page as a whole: one picture of the white light
            asked = {"--light": wanted.lights, "--combine": wanted.combine, "--stiffness": stiffness}
            for option, value in (asked | {"--scale": wanted.scale if wanted.scale != 1.0 else None}).items():
                require(not value, option, f"be left out: {method}, a {kind}, restores the white image alone", value)
        if not free_scale:
            return cls(method, kind, wanted, {}, quiet)
        able = method == SCALING
        require(able, "--free-scale", f"be left out, since only the method {SCALING} finds a scale", method)
        require(stiffness is not None, "--free-scale", "come with --stiffness, a map of two materials", "none")
        return cls(method, kind, wanted, {"free_scale": True}, quiet)

    def to(self, picture: Path) -> Restoring:
        """Return the same, written elsewhere."""
        return replace(self, wanted=replace(self.wanted, output=picture))

    def restore(self, found: Scan) -> tuple[dict[str, Any], list[Path]]:
        """Write a scanned page's pictures; return the figures and the files."""
        with working("flattening and restoring", self.quiet):
            if self.kind is Kind.FLATTENER:
                return restore_page(found, self.method, self.wanted, self.settings)
            return _restore_whole(found, self.method, self.kind, self.wanted.output)


def _restore_whole(found: Scan, method: str, kind: Kind, output: Path) -> tuple[dict[str, Any], list[Path]]:
    """Let a restorer or a dewarper make the page's picture, and write it; a dewarper's has no scale."""
    from deskew import flattening, pipeline, restoration
    from deskew.types import WHITE

    dpi = None
    if kind is Kind.DEWARPER:
        image = restoration.dewarp_by(flattening.find_method(method), found.images[WHITE]).image
    else:
        restored = pipeline.restore(found, method=method)
        image, dpi = restored.image, restoration.dots_per_inch(found, restored.camera, restored.backward_map)
    write_pictures({WHITE: image}, {WHITE: output}, found.profiles, dpi)
    return {"restored": str(output), "method": method, "kind": str(kind), **_named_dpi(dpi)}, [output]


def restore_page(
    found: Scan, method: str, wanted: Wanted, settings: Mapping[str, object]
) -> tuple[dict[str, Any], list[Path]]:
    """Flatten and texture a scanned page, and write its pictures; return the figures and the files."""
    import numpy as np

    from deskew import pipeline, restoration

    known = list(found.images)
    needed = wanted.needed(known)
    restored = pipeline.restore_lights(found, method=method, lights=needed, scale=wanted.scale, **settings)
    page = np.isfinite(restored.backward_map[..., 0])
    pictures = {light: restored.images[light] for light in wanted.shown(known)}
    for how in wanted.combine:
        parts = {light: restored.images[light] for light in wanted.combined(how, known)}
        pictures |= restoration.combined(parts, page, how)
    paths = wanted.paths(known)
    dpi = restoration.dots_per_inch(found, restored.camera, restored.backward_map)
    figures: dict[str, Any] = {"restored": [str(path) for path in paths.values()], "method": method}
    if len(paths) == 1:
        figures["restored"] = str(wanted.output)
    figures |= (
        _named_dpi(dpi) | {"filled_fraction": found.filled_fraction} | flattened_figures(restored.flattened, "page")
    )
    for light, fit in restored.registrations.items():
        figures |= {f"{light}_scale": fit.scale.tolist(), f"{light}_offset_px": fit.offset.tolist()}
        figures[f"{light}_residual_px"] = fit.residual_px
    figures |= projector_figures(found.projector)
    write_pictures(pictures, paths, {light: found.profiles[light] for light in found.profiles if light in needed}, dpi)
    return figures, list(paths.values())


def _named_dpi(dpi: tuple[float, float] | None) -> dict[str, Any]:
    return {} if dpi is None else {"dpi": list(dpi)}

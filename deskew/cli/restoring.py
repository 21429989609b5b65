"""Commands that restore: `restore` and `run`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from deskew.cli.flattening import require_method
from deskew.cli.options import (
    CalibrationFile,
    CaptureFolder,
    Combine,
    Denoise,
    FreeScale,
    Ink,
    Json,
    Lights,
    Mask,
    Method,
    Scale,
    Shape,
    Stiffness,
)
from deskew.cli.pictures import PICTURES, Wanted, write_pictures
from deskew.cli.printing import flattened_figures, projector_figures, report
from deskew.cli.scanning import Scanning, scan_page
from deskew.errors import require
from deskew.plugins import Kind

if TYPE_CHECKING:
    from deskew.types import Scan

SCALING = "spring"  # the one method that finds a material's scale


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

    With more than one picture each is named after its light or combination: restored-uv.png, restored-mean.png.

    A stiffness map has the white image's frame. A scan made with --unshaded has the light `unshaded`: the page without
    the projector's shading.

    Example: deskew restore scan.npz -o restored.png --light white --light uv --combine ratio:uv/white
    """
    from deskew import io

    io.require_writable(output, PICTURES)
    wanted = Wanted.of(output, lights, combine, scale)
    settings = _settings(method, free_scale, stiffness)
    kind = _kind(method, wanted, stiffness)
    materials = None if stiffness is None else io.read_stiffness(stiffness)
    found = io.read_scan(scan_file)
    wanted.check(list(found.images))
    if materials is not None:
        from deskew import pipeline

        found = pipeline.with_stiffness(found, materials)
    if kind is Kind.FLATTENER:
        restore_page(found, method, wanted, as_json, settings)
    else:
        _restore_whole(found, method, kind, output, as_json)


def run(
    capture: CaptureFolder,
    calibration: CalibrationFile,
    output: Annotated[Path, typer.Option("--output", "-o", help="Image to write: .png or .tif.")],
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
    as_json: Json = False,
) -> None:
    """Take a capture folder to a restored page: scan, flatten, texture, under any of its lights.

    With more than one picture each is named after its light or combination: restored-uv.png, restored-mean.png.

    A stiffness map has the white image's frame. The light `unshaded` is white without the projector's shading, which
    the page's shape tells.

    Example: deskew run page/ --calibration calibration.json -o restored.png --light uv
    """
    from deskew import io

    io.require_writable(output, PICTURES)
    wanted = Wanted.of(output, lights, combine, scale)
    kind = _kind(method, wanted, stiffness)
    settings = _settings(method, free_scale, stiffness)
    how = Scanning(shape, mask, method, ink, denoise, stiffness)
    page = scan_page(capture, io.read_calibration(calibration), how, wanted)
    if kind is Kind.FLATTENER:
        restore_page(page, method, wanted, as_json, settings)
    else:
        _restore_whole(page, method, kind, output, as_json)


def _kind(method: str, wanted: Wanted, stiffness: Path | None) -> Kind:
    """Return the method's kind; one that restores the page as a whole makes one picture of the white light."""
    kind = require_method(method, tuple(Kind))
    if kind is not Kind.FLATTENER:
        asked = {"--light": wanted.lights, "--combine": wanted.combine, "--stiffness": stiffness}
        for option, value in (asked | {"--scale": wanted.scale if wanted.scale != 1.0 else None}).items():
            require(not value, option, f"be left out: {method}, a {kind}, restores the white image alone", value)
    return kind


def _restore_whole(found: Scan, method: str, kind: Kind, output: Path, as_json: bool) -> None:
    """Let a restorer or a dewarper make the page's picture, and write it."""
    from deskew import flattening, pipeline, restoration
    from deskew.types import WHITE

    if kind is Kind.DEWARPER:
        image = restoration.dewarp_by(flattening.find_method(method), found.images[WHITE]).image
    else:
        image = pipeline.restore(found, method=method).image
    write_pictures({WHITE: image}, {WHITE: output})
    report({"restored": str(output), "method": method, "kind": str(kind)}, as_json, output)


def _settings(method: str, free_scale: bool, stiffness: Path | None) -> dict[str, object]:
    """Return the method's settings; what it cannot do is refused before the long work."""
    if not free_scale:
        return {}
    require(method == SCALING, "--free-scale", f"be left out, since only the method {SCALING} finds a scale", method)
    require(stiffness is not None, "--free-scale", "come with --stiffness, a map of two materials", "none")
    return {"free_scale": True}


def restore_page(found: Scan, method: str, wanted: Wanted, as_json: bool, settings: Mapping[str, object]) -> None:
    """Flatten and texture a scanned page, write its pictures and print the figures."""
    import numpy as np

    from deskew import pipeline, restoration

    known = list(found.images)
    needed = wanted.needed(known)
    restored = pipeline.restore_lights(found, method=method, lights=needed, scale=wanted.scale, **settings)
    page = np.isfinite(restored.backward_map[..., 0])
    pictures = {light: restored.images[light] for light in wanted.shown}
    for how in wanted.combine:
        parts = {light: restored.images[light] for light in wanted.combined(how, known)}
        pictures |= restoration.combined(parts, page, how)
    paths = wanted.paths(known)
    figures: dict[str, Any] = {"restored": [str(path) for path in paths.values()], "method": method}
    if len(paths) == 1:
        figures["restored"] = str(wanted.output)
    if restored.flattened is not None:
        figures |= flattened_figures(restored.flattened, "page")
    for light, fit in restored.registrations.items():
        figures |= {f"{light}_scale": fit.scale.tolist(), f"{light}_offset_px": fit.offset.tolist()}
        figures[f"{light}_residual_px"] = fit.residual_px
    figures |= projector_figures(found.projector)
    write_pictures(pictures, paths)
    report(figures, as_json, *paths.values())

"""The command that flattens a mesh by itself: `flatten`."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from deskew.cli.options import Json, Method, Stiffness
from deskew.cli.printing import flattened_figures, report, say
from deskew.errors import StepError, require
from deskew.plugins import Kind, kind_of

if TYPE_CHECKING:
    from deskew.io import Mesh
    from deskew.types import Floats

DENOISING = "spring"  # the one method that estimates noise and removes it
_NOISE_MAX_MM = 1000.0

Surface = Annotated[
    Path, typer.Argument(metavar="IN", help="Mesh in mm: .obj, .ply, or a tifxyz folder (x.tif, y.tif, z.tif).")
]
Output = Annotated[Path, typer.Option("--output", "-o", help="Flat mesh to write: .ply or .obj.")]
Noise = Annotated[
    str | None,
    typer.Option("--noise", metavar="auto|MM", help="Scanner noise to remove; auto, the default, estimates it."),
]
Picture = Annotated[
    Path | None,
    typer.Option("--picture", metavar="IMAGE", help="The texture's picture, to be named in the flat mesh for viewers."),
]
Voxel = Annotated[float | None, typer.Option("--voxel", metavar="MM", help="Edge of a tifxyz folder's voxels [mm].")]


def flatten(
    surface: Surface,
    output: Output,
    method: Method = "spring",
    stiffness: Stiffness = None,
    noise: Noise = None,
    voxel: Voxel = None,
    picture: Picture = None,
    as_json: Json = False,
) -> None:
    """Flatten a mesh from any scanner: the same vertices and faces, in their order, on the plane z = 0.

    The mesh is one piece with a border; holes and overhangs are welcome. Its texture coordinates are kept, and a
    stiffness map is looked up by them (0 to 1, from the picture's lower left corner). Of a tifxyz folder in several
    pieces the largest is taken, and it is said how much that leaves out.

    Example: deskew flatten page.obj -o flat.ply --noise auto

    Example: deskew flatten page.ply -o flat.ply --picture page-white.png

    Example: deskew flatten segment/ -o flat.ply --voxel 0.00864
    """
    from deskew import io

    io.require_writable(output, io.MESH_SUFFIXES)
    settings = _settings(method, noise)
    require_method(method)
    mesh = _read(surface, voxel)
    shown = _named(picture, mesh, output)
    constants: Floats | None = None
    if stiffness is not None:
        require(mesh.texture is not None, str(surface), "have texture coordinates for a stiffness map", "none")
        constants = io.face_stiffness(mesh, io.read_stiffness(stiffness))
    from deskew import flattening
    from deskew.types import Sheet, Status

    flattened = flattening.flatten(Sheet(mesh.vertices, mesh.faces, constants), method=method, **settings)
    if flattened.status is Status.DIVERGED:
        raise StepError(f"Flattening diverged: {flattened.remedy}")
    head = {"flat": str(output), "method": method, "vertices": len(mesh.vertices), "faces": len(mesh.faces)}
    figures = head | flattened_figures(flattened, "sheet")
    io.write_mesh(io.Mesh(flattened.vertices, mesh.faces, mesh.texture), output, shown)
    report(figures, as_json, output)


def _named(picture: Path | None, mesh: Mesh, output: Path) -> str | None:
    """Name a texture's picture as seen from the mesh that is to be written; its own pixels are not read."""
    if picture is None:
        return None
    from deskew.io.files import require_file

    require_file(picture)
    require(mesh.texture is not None, "--picture", "come with a mesh that has texture coordinates", "none")
    return Path(os.path.relpath(picture, output.parent)).as_posix()


def require_method(method: str, kinds: tuple[Kind, ...] = (Kind.FLATTENER,)) -> Kind:
    """Refuse an unknown method, or one of another kind, before the long work rather than after it."""
    from deskew.flattening import find_method

    kind = kind_of(find_method(method))
    require(kind in kinds, "--method", f"be a {' or '.join(kinds)} here", f"{method}, a {kind}")
    return kind


def _settings(method: str, noise: str | None) -> dict[str, float | str]:
    """Return the method's settings; only one knows what noise is, and the others are not asked to."""
    if method != DENOISING:
        require(noise is None, "--noise", f"be left out, since only the method {DENOISING} removes noise", noise)
        return {}
    if noise in (None, "auto"):
        return {"noise_mm": "auto"}
    try:
        level = float(str(noise))
    except ValueError:
        level = math.nan
    require(0 <= level <= _NOISE_MAX_MM, "--noise", f"be auto or lie in [0, {_NOISE_MAX_MM:g}] mm", noise)
    return {"noise_mm": level}


def _read(surface: Path, voxel: float | None) -> Mesh:
    """Read a mesh, or a folder whose voxels have a size."""
    from deskew import io

    if os.path.isdir(surface):  # noqa: PTH112  # answers for names that pathlib raises on
        if voxel is None:
            require(False, "--voxel", "be given for a tifxyz folder, which does not say its voxels' size", "none")
        segment = io.read_tifxyz(surface, float(voxel or 0.0))
        if segment.quads_left_out:
            say(
                f"warning: {surface} holds {segment.n_pieces} pieces; the largest is flattened, and "
                f"{segment.quads_left_out} quads of the others are left out."
            )
        return segment.mesh
    require(voxel is None, "--voxel", f"be left out for a mesh in mm such as {surface}", voxel)
    return io.read_mesh(surface)

"""The command that compares what any program made of a page with the truth, a flattening or a picture: `score`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from deskew.cli.options import Json
from deskew.cli.pictures import PICTURES
from deskew.cli.printing import report, say
from deskew.errors import require

if TYPE_CHECKING:
    from deskew.io import Mesh
    from deskew.types import Array, Floats

_ROUNDED_MM = 1e-3  # what writing a texture with few digits may change

FlatFile = Annotated[
    Path,
    typer.Argument(
        metavar="FLAT",
        help="Flattened mesh in mm: OBJ, texture coordinates if present, else x y; or PLY. Or a restored picture: "
        ".png or .tif.",
    ),
]
TruthFile = Annotated[
    Path,
    typer.Option(
        "--truth",
        "-t",
        help="OBJ of the bent mesh, its texture coordinates the true flat places [mm]; of a picture, the flat page's.",
    ),
]


def score(flat_file: FlatFile, truth_file: TruthFile, as_json: Json = False) -> None:
    """Score what any program made of a page against the truth: a flattening, or a restored picture.

    Of a flattening: distance from the truth, stretch against the bent surface, flips. Both files hold the same vertices
    in the same order, and the same faces. The true v may run up or down. The flattening shows the surface from above,
    or from the front of its faces if it lies neither up nor down; one that is mirrored is an error, code 3.

    Figures: flat_mean_mm and flat_max_mm after an affine fit, flat_rigid_mean_mm and flat_rigid_max_mm after a rigid
    one; stretch_l2 and stretch_linf of the map from the plane to the surface (Sander 2001), stretch_inverse_l2 and
    stretch_inverse_linf of the map from the surface to the plane, infinite (null in JSON) if a face is flipped;
    area_error, the mean relative change of area; angle_mean_deg; flips, the number of faces turned over; folds, the
    number of edges along which the sheet folds over.

    Of a picture, against a scan of the flat page cut to the same part of it: ms_ssim_docunet, the document-unwarping
    field's MS-SSIM, and ms_ssim_wang, that of Wang and others 2003; ld_dis_px, ad_dis and lid_dis_px, local, aligned
    and line distortion by DIS flow; text_lines found in the restored picture, and line_straightness_px and
    line_spread_deg of them.

    Example: deskew score flat.obj --truth page.obj --json

    Example: deskew score restored.png --truth scan.png
    """
    from deskew import io

    suffix, known = flat_file.suffix.lower(), (*io.MESH_SUFFIXES, *PICTURES)
    require(suffix in known, str(flat_file), f"end in one of {', '.join(known)}", suffix or "no suffix")
    if suffix in PICTURES:
        _score_picture(flat_file, truth_file, as_json)
        return
    truth, flat = io.read_mesh(truth_file), io.read_mesh(flat_file)
    require(truth.texture is not None, str(truth_file), "hold texture coordinates, the flat places [mm]", "none")
    n = len(truth.vertices)
    require(len(flat.vertices) == n, str(flat_file), f"have the truth's {n} vertices", len(flat.vertices))
    _require_same_faces(flat.faces, truth.faces, flat_file)
    from deskew import metrics

    by_texture = flat_file.suffix.lower() == ".obj" and flat.texture is not None and not _carried_along(flat, truth)
    places: Floats = flat.texture if by_texture and flat.texture is not None else flat.vertices[:, :2]
    assert truth.texture is not None
    figures = metrics.score_flattening(truth.sheet, truth.texture, places, same_axes=by_texture)
    if not by_texture and flat.vertices[:, 2].any():
        say(f"warning: {flat_file.name} is not flat on z = 0; only its x and y are scored")
    head = {"flat": str(flat_file), "truth": str(truth_file), "places": "texture" if by_texture else "xy"}
    report({**head, "vertices": n, "faces": len(truth.faces), **figures}, as_json)


def _score_picture(restored_file: Path, scan_file: Path, as_json: bool) -> None:
    """Compare a restored picture with a scan of the flat page."""
    from deskew import io

    restored, scan = io.read_image(restored_file), io.read_image(scan_file)
    from deskew import metrics

    figures = metrics.image_figures(restored, scan)
    report({"restored": str(restored_file), "truth": str(scan_file), **figures}, as_json)


def _carried_along(flat: Mesh, truth: Mesh) -> bool:
    """Whether a file flat on z = 0 holds but the truth's own texture, as flattening keeps it: no result to score."""
    import numpy as np

    assert flat.texture is not None
    assert truth.texture is not None
    return not flat.vertices[:, 2].any() and np.allclose(flat.texture, truth.texture, rtol=0.0, atol=_ROUNDED_MM)


def _require_same_faces(found: Array, wanted: Array, path: Path) -> None:
    """Refuse other faces than the truth's; their order, and where each begins, is left to the other program."""
    import numpy as np

    def ordered(faces: Array) -> Array:
        turns = (faces.argmin(axis=1)[:, None] + np.arange(3)) % 3
        faces = np.take_along_axis(faces, turns, axis=1)
        return faces[np.lexsort(faces.T[::-1])]

    require(len(found) == len(wanted), str(path), f"have the truth's {len(wanted)} faces", len(found))
    if not np.array_equal(found, wanted):
        other = int((ordered(found) != ordered(wanted)).any(axis=1).sum())
        require(other == 0, str(path), "have the truth's faces, wound alike", f"{other} others")

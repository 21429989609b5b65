"""tifxyz folders, as programs for scrolls write segments of them: a grid of points in a volume, one TIFF an axis.

`x.tif`, `y.tif` and `z.tif` are float32 pictures of one size whose pixel holds a coordinate in voxels, or -1 where the
grid has a hole; `meta.json` says what else is known. None of it says how large a voxel is.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from deskew.errors import require, require_positive
from deskew.io.files import read_json, require_file, require_folder
from deskew.io.meshes import Mesh, grid_faces
from deskew.io.scans import read_depth_image
from deskew.types import Floats

HOLE = -1.0


def _grid(folder: Path) -> Floats:
    """Points in voxels, (rows, columns, 3)."""
    require_folder(folder)
    axes = [folder / f"{axis}.tif" for axis in "xyz"]
    for path in axes:
        require_file(path)
    planes = [read_depth_image(path) for path in axes]
    for path, plane in zip(axes, planes, strict=True):
        same = plane.shape == planes[0].shape
        size, wanted = (f"{p.shape[1]}x{p.shape[0]} px" for p in (plane, planes[0]))
        require(same, str(path), f"be {wanted} as x.tif", size)
        n_bad = int((~np.isfinite(plane)).sum())
        require(n_bad == 0, str(path), "be finite, -1 where there is a hole", f"{n_bad} pixels with NaN or infinity")
    return np.stack(planes, axis=-1).astype(np.float64)


def _pieces(quads: npt.NDArray[np.bool_]) -> tuple[npt.NDArray[np.int32], int]:
    """Find the connected pieces, numbered from 1; quads that only touch at a corner are not connected."""
    from scipy.ndimage import label

    pieces, n = label(quads)
    return pieces, int(n)


class Segment(NamedTuple):
    """A surface in a volume.

    Attributes
    ----------
    mesh : Mesh
        Its largest connected piece [mm].
    n_pieces : int
        Pieces that the folder holds.
    quads_left_out : int
        Valid quads of all other pieces.
    """

    mesh: Mesh
    n_pieces: int
    quads_left_out: int


def read_tifxyz(folder: Path, voxel_mm: float) -> Segment:
    """Read a tifxyz folder as a triangle mesh; of several pieces, the largest.

    Parameters
    ----------
    folder : Path
        With `x.tif`, `y.tif` and `z.tif`.
    voxel_mm : float
        Edge of a voxel [mm], in (0, 10]; the folder does not say it.

    Returns
    -------
    Segment
        Two triangles for each quad of the grid with four valid corners; vertices [mm] row by row, those that no quad
        uses left out. The texture coordinate of row r, column c of an R x C grid is ``((c + 0.5) / C,
        1 - (r + 0.5) / R)``, the middle of that pixel in a picture of the grid's size.

    Raises
    ------
    InputError
        If a file is missing or damaged, the sizes differ, a coordinate is not finite, or no quad is valid.
    """
    folder = Path(folder)
    require_positive("voxel", voxel_mm, 10.0, "mm")
    grid = _grid(folder)
    if (folder / "meta.json").exists():
        kind = read_json(folder / "meta.json").get("format", "tifxyz")
        require(kind == "tifxyz", f"{folder / 'meta.json'}: format", "be tifxyz", repr(kind))
    rows, columns = grid.shape[:2]
    require(min(rows, columns) >= 2, str(folder), "hold a grid of at least 2 x 2 points", f"{rows} x {columns}")
    valid = (grid != HOLE).all(axis=-1)
    quads = valid[:-1, :-1] & valid[:-1, 1:] & valid[1:, :-1] & valid[1:, 1:]
    require(bool(quads.any()), str(folder), "hold a quad of four valid points", f"{int(valid.sum())} points, no quad")
    pieces, n_pieces = _pieces(quads)
    whole = int(quads.sum())
    quads = pieces == 1 + int(np.bincount(pieces.ravel())[1:].argmax())
    faces = grid_faces(rows, columns).reshape(-1, 2, 3)[quads.ravel()].reshape(-1, 3)
    used, compact = np.unique(faces, return_inverse=True)
    row, column = np.divmod(used, columns)
    texture = np.column_stack([(column + 0.5) / columns, 1.0 - (row + 0.5) / rows])
    mesh = Mesh(voxel_mm * grid.reshape(-1, 3)[used], compact.reshape(-1, 3).astype(np.int64), texture)
    return Segment(mesh, n_pieces, whole - int(quads.sum()))

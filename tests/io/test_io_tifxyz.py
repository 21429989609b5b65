"""tifxyz folders as triangle meshes."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from deskew.errors import InputError
from deskew.io import read_tifxyz
from deskew.types import Floats

VOXEL = 0.00864


def grid(rows: int = 4, columns: int = 6) -> Floats:
    row, column = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    return np.stack([100.0 + 3 * column, 200.0 + 2 * row, 50.0 + column * row], axis=-1)


def write(points: Floats, folder: Path, meta: str | None = '{"format": "tifxyz"}') -> Path:
    folder.mkdir(exist_ok=True)
    for k, axis in enumerate("xyz"):
        cv2.imwrite(str(folder / f"{axis}.tif"), points[..., k].astype(np.float32))
    if meta is not None:
        (folder / "meta.json").write_text(meta)
    return folder


@pytest.mark.parametrize("meta", ['{"format": "tifxyz", "scale": [0.05, 0.05]}', "{}", None])
def test_a_whole_grid_becomes_two_triangles_a_quad(tmp_path: Path, meta: str | None) -> None:
    mesh = read_tifxyz(write(grid(), tmp_path / "s", meta), VOXEL).mesh
    assert mesh.vertices.tobytes() == (VOXEL * grid()).reshape(-1, 3).tobytes()
    assert len(mesh.faces) == 2 * 3 * 5
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    assert (area > 0).all()


def test_holes_leave_out_their_quads_and_lonely_points_but_no_place_is_lost(tmp_path: Path) -> None:
    points = grid()
    points[0, :2] = -1.0
    points[3, 4] = -1.0  # leaves (3, 5) without any quad
    mesh = read_tifxyz(write(points, tmp_path / "s"), VOXEL).mesh
    assert len(mesh.vertices) == 24 - 2 - 1 - 1
    assert len(mesh.faces) == 2 * (15 - 2 - 2)
    assert mesh.texture is not None
    column, row = np.rint(mesh.texture * [6, 4] - 0.5).astype(int).T
    assert np.array_equal(mesh.vertices, VOXEL * points[3 - row, column])


def test_a_hole_in_one_axis_is_a_hole(tmp_path: Path) -> None:
    points = grid()
    points[0, 0, 2] = -1.0
    assert len(read_tifxyz(write(points, tmp_path / "s"), VOXEL).mesh.faces) == 2 * 14


def test_of_several_pieces_the_largest_is_taken_and_the_rest_counted(tmp_path: Path) -> None:
    points = grid(4, 8)
    points[:, 3] = -1.0
    folder = write(points, tmp_path / "s")
    mesh, n_pieces, left_out = read_tifxyz(folder, VOXEL)
    assert (n_pieces, left_out) == (2, 6)
    assert (len(mesh.vertices), len(mesh.faces)) == (16, 18)
    assert np.array_equal(mesh.vertices, VOXEL * points[:, 4:].reshape(-1, 3))


def test_quads_that_touch_at_a_corner_are_two_pieces(tmp_path: Path) -> None:
    points = grid(3, 3)
    points[0, 2] = points[2, 0] = -1.0
    assert read_tifxyz(write(points, tmp_path / "s"), VOXEL)[1:] == (2, 1)


def faulty(kind: str) -> Floats:
    points = grid()
    match kind:
        case "no quad":
            points[::2, ::2] = points[1::2, 1::2] = -1.0
        case "NaN" | "infinite":
            points[1, 1, 1] = np.nan if kind == "NaN" else np.inf
        case "one row":
            points = points[:1]
    return points


def damage(kind: str, folder: Path) -> None:
    match kind:
        case "missing":
            (folder / "y.tif").unlink()
        case "sizes":
            cv2.imwrite(str(folder / "z.tif"), np.ones((4, 5), np.float32))
        case "whole numbers":
            cv2.imwrite(str(folder / "z.tif"), np.ones((4, 6), np.uint16))
        case "cut":
            (folder / "z.tif").write_bytes((folder / "z.tif").read_bytes()[:40])
        case "another format":
            (folder / "meta.json").write_text('{"format": "obj"}')
        case "damaged meta":
            (folder / "meta.json").write_text("{")


WRONG = {
    "missing": r"`.*y\.tif` must be a file, got nothing there",
    "sizes": r"`.*z\.tif` must be 6x4 px as x\.tif, got 5x4 px",
    "whole numbers": r"`.*z\.tif` must hold one float32 channel, got uint16",
    "cut": r"`.*z\.tif` must be ",
    "no quad": "`.*s` must hold a quad of four valid points, got 12 points, no quad",
    "NaN": r"`.*y\.tif` must be finite, -1 where there is a hole, got 1 pixels with NaN",
    "infinite": r"`.*y\.tif` must be finite",
    "one row": "`.*s` must hold a grid of at least 2 x 2 points, got 1 x 6",
    "another format": r"`.*meta\.json: format` must be tifxyz, got 'obj'",
    "damaged meta": r"`.*meta\.json` must be valid JSON",
}


@pytest.mark.parametrize("case", list(WRONG))
def test_a_wrong_folder_is_refused_by_name(tmp_path: Path, case: str) -> None:
    damage(case, write(faulty(case), tmp_path / "s"))
    with pytest.raises(InputError, match=WRONG[case]):
        read_tifxyz(tmp_path / "s", VOXEL)


@pytest.mark.parametrize("voxel", [0.0, -1.0, np.nan, np.inf, 11.0])
def test_a_voxel_has_a_size(tmp_path: Path, voxel: float) -> None:
    with pytest.raises(InputError, match=r"`voxel` must be in \(0, 10\] \[mm\]"):
        read_tifxyz(write(grid(), tmp_path / "s"), voxel)


def test_a_folder_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"`.*gone` must be a folder, got nothing there"):
        read_tifxyz(tmp_path / "gone", VOXEL)

"""`deskew flatten`: any mesh in, the same mesh flat."""

from __future__ import annotations

import importlib
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from deskew.flattening import METHODS
from deskew.io import Mesh, read_mesh, write_image, write_mesh
from deskew.types import Flattened, Sheet, Status

Command = Callable[[str], tuple[int, str, str]]

METHOD = """
from dataclasses import replace
from deskew.types import Flattened, Status

seen = []

def press(sheet, **settings):
    seen.append((sheet, settings))
    return Flattened(sheet.vertices * [1.0, 1.0, 0.0], Status.AT_REST, "", {"iterations": 3.0})

def lock(sheet):
    return Flattened(sheet.vertices, Status.LOCKED, "push harder")

def burst(sheet):
    return Flattened(sheet.vertices, Status.DIVERGED, "smaller steps")
"""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, page: Mesh) -> Path:
    """A working folder with meshes of every form and an empty `out`; the method `own:press` projects."""
    assert page.texture is not None
    write_mesh(replace(page, texture=(page.texture - [0, -30]) / [40, 30]), tmp_path / "page.obj")
    write_mesh(page, tmp_path / "page.ply")
    write_mesh(Mesh(page.vertices, page.faces), tmp_path / "bare.obj")
    (tmp_path / "segment").mkdir()
    for k, axis in enumerate("xyz"):
        cv2.imwrite(str(tmp_path / f"segment/{axis}.tif"), page.vertices[:, k].reshape(7, 21).astype(np.float32))
    write_image(np.repeat([[7, 200]], 2, axis=0).astype(np.uint8), tmp_path / "m.png")
    (tmp_path / "m.toml").write_text("[stiffness]\n7 = 0.5\n200 = 20\n")
    (tmp_path / "own.py").write_text(METHOD)
    (tmp_path / "out").mkdir()
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(importlib.sys.modules, "own", raising=False)  # type: ignore[attr-defined]
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("name", ["page.obj", "page.ply", "bare.obj"])
@pytest.mark.parametrize("suffix", [".ply", ".obj"])
def test_the_same_vertices_and_faces_come_out_flat(here: Path, deskew: Command, name: str, suffix: str) -> None:
    code, out, err = deskew(f"flatten {name} -o out/flat{suffix} --method own:press --json")
    assert (code, err) == (0, "")
    assert json.loads(out) == {
        "flat": f"out/flat{suffix}",
        "method": "own:press",
        "vertices": 147,
        "faces": 240,
        "status": "at_rest",
        "iterations": 3.0,
    }
    before, after = read_mesh(here / name), read_mesh(here / "out" / f"flat{suffix}")
    assert np.array_equal(after.faces, before.faces)
    assert not after.vertices[:, 2].any()
    assert np.allclose(after.vertices[:, :2], before.vertices[:, :2], rtol=0, atol=1e-5)
    assert (after.texture is None) == (before.texture is None)
    if before.texture is not None and after.texture is not None:
        assert np.allclose(after.texture, before.texture, rtol=0, atol=1e-6)


def test_a_tifxyz_folder_is_scaled_by_its_voxels(here: Path, deskew: Command, page: Mesh) -> None:
    assert deskew("flatten segment -o out/flat.obj --voxel 0.5 -m own:press")[0] == 0
    found = read_mesh(here / "out" / "flat.obj")
    assert np.allclose(found.vertices[:, :2], 0.5 * page.vertices[:, :2], rtol=0, atol=1e-5)
    assert np.array_equal(found.faces, page.faces)


def test_of_a_folder_in_pieces_the_largest_is_taken_and_it_is_said(here: Path, deskew: Command) -> None:
    x = cv2.imread(str(here / "segment/x.tif"), cv2.IMREAD_UNCHANGED)
    x[:, 4] = -1.0
    cv2.imwrite(str(here / "segment/x.tif"), x)
    line = "flatten segment -o out/flat.ply --voxel 0.5 -m own:press"
    code, _, err = deskew(line)
    assert (code, err.count("\n")) == (0, 1)
    assert "holds 2 pieces; the largest is flattened, and 18 quads of the others are left out." in err
    assert len(read_mesh(here / "out" / "flat.ply").vertices) == 7 * 16


@pytest.mark.parametrize(
    ("option", "noise"), [("", "auto"), ("--noise auto", "auto"), ("--noise 0.3", 0.3), ("--noise 0", 0.0)]
)
def test_noise_is_estimated_by_the_default_method_unless_given(
    here: Path, deskew: Command, monkeypatch: pytest.MonkeyPatch, option: str, noise: str | float
) -> None:
    asked: list[dict[str, Any]] = []

    def spring(sheet: Sheet, **settings: Any) -> Flattened:
        asked.append(settings)
        return Flattened(sheet.vertices * [1.0, 1.0, 0.0], Status.AT_REST)

    monkeypatch.setitem(METHODS, "spring", spring)
    code, out, err = deskew(f"flatten page.obj -o out/flat.ply {option} --json")
    assert (code, err, json.loads(out)["method"]) == (0, "", "spring")
    assert asked == [{"noise_mm": noise}]


def test_a_stiffness_map_is_looked_up_by_texture(here: Path, deskew: Command, page: Mesh) -> None:
    assert deskew("flatten page.obj -o out/flat.ply --stiffness m.png -m own:press")[0] == 0
    sheet, settings = importlib.import_module("own").seen[-1]
    assert page.texture is not None
    left = page.texture[page.faces].mean(axis=1)[:, 0] < 20
    assert np.array_equal(sheet.stiffness, np.where(left, 0.5, 20.0))
    assert settings == {}


def test_stiffness_decides_which_part_of_a_stretched_page_keeps_its_lengths(
    here: Path, deskew: Command, page: Mesh
) -> None:
    """Noise that is left in, half of the page 40 times as stiff as the other: there the edges hold."""
    rough = page.vertices + np.random.default_rng(0).normal(0, 0.3, page.vertices.shape)
    assert page.texture is not None
    write_mesh(Mesh(rough, page.faces, (page.texture - [0, -30]) / [40, 30]), here / "rough.obj")
    line = "flatten rough.obj -o out/flat.ply --noise 0 --json"
    strains = []
    for option in ("", " --stiffness m.png"):
        code, out, err = deskew(line + option)
        assert (code, err, json.loads(out)["status"]) == (0, "", "at_rest")
        flat = read_mesh(here / "out" / "flat.ply").vertices
        sides = page.faces, np.roll(page.faces, 1, axis=1)
        before, after = (np.linalg.norm(v[sides[0]] - v[sides[1]], axis=-1) for v in (rough, flat))
        stiff = page.texture[page.faces].mean(axis=1)[:, 0] > 20
        strains.append([np.abs(after / before - 1)[part].mean() for part in (stiff, ~stiff)])
    (even, _), (stiff_part, soft_part) = strains
    assert 0 < stiff_part < even
    assert stiff_part < soft_part


def test_what_is_flattened_can_be_scored(here: Path, deskew: Command, page: Mesh) -> None:
    """The truth comes along as texture and is no answer: x and y are, short of it by chords of 2 mm on 25 mm."""
    write_mesh(page, here / "truth.obj")
    for suffix in (".ply", ".obj"):
        line = f"flatten truth.obj -o out/flat{suffix} --method deskew.flattening.meshes:flatten_mesh"
        assert deskew(line)[0] == 0
        code, out, err = deskew(f"score out/flat{suffix} --truth truth.obj --json")
        figures = json.loads(out)
        assert (code, err, figures["places"], figures["flips"]) == (0, "", "xy", 0)
        assert 0 < figures["flat_rigid_max_mm"] < 0.02
        assert 0.999 < figures["stretch_l2"] < 1.001


def test_what_is_not_at_rest_is_written_and_said_so(here: Path, deskew: Command) -> None:
    code, out, err = deskew("flatten page.obj -o out/flat.ply -m own:lock --json")
    assert (code, json.loads(out)["status"]) == (0, "locked")
    assert err == "deskew: warning: the sheet is locked, not at rest and flat: push harder\n"
    assert (here / "out" / "flat.ply").exists()


def test_what_diverged_is_an_error(here: Path, deskew: Command) -> None:
    code, out, err = deskew("flatten page.obj -o out/flat.ply -m own:burst")
    assert (code, out, err) == (3, "", "deskew: Flattening diverged: smaller steps\n")
    assert list((here / "out").iterdir()) == []


WRONG = {
    "no input": ("flatten -o out/f.ply", "Missing argument 'IN'"),
    "no output": ("flatten page.obj", "Missing option '--output'"),
    "input missing": ("flatten gone.obj -o out/f.ply -m own:press", "`gone.obj` must be a file, got nothing there"),
    "input an image": ("flatten m.png -o out/f.ply -m own:press", "`m.png` must end in .obj or .ply, got .png"),
    "output an image": ("flatten page.obj -o out/f.png", "`out/f.png` must end in .obj or .ply, got .png"),
    "output in no folder": ("flatten page.obj -o no/f.ply", "`no/f.ply` must lie in an existing folder"),
    "unknown method": ("flatten page.obj -o out/f.ply -m iron", "`method` must be one of "),
    "noise of another method": (
        "flatten page.obj -o out/f.ply -m own:press --noise 0.3",
        "`--noise` must be left out, since only the method spring removes noise, got 0.3",
    ),
    "noise of words": ("flatten page.obj -o out/f.ply --noise loud", "`--noise` must be auto or lie in [0, 1000] mm"),
    "noise negative": ("flatten page.obj -o out/f.ply --noise -0.1", "`--noise` must be auto or lie in [0, 1000] mm"),
    "noise NaN": (
        "flatten page.obj -o out/f.ply --noise nan",
        "`--noise` must be auto or lie in [0, 1000] mm",
    ),
    "no voxel": ("flatten segment -o out/f.ply -m own:press", "`--voxel` must be given for a tifxyz folder"),
    "voxel 0": ("flatten segment -o out/f.ply -m own:press --voxel 0", "`voxel` must be in (0, 10] [mm], got 0.0"),
    "voxel of a mesh": (
        "flatten page.obj -o out/f.ply -m own:press --voxel 1",
        "`--voxel` must be left out",
    ),
    "no tifxyz": ("flatten out -o out/f.ply -m own:press --voxel 1", "`out/x.tif` must be a file, got nothing there"),
    "stiffness without texture": (
        "flatten bare.obj -o out/f.ply -m own:press --stiffness m.png",
        "`bare.obj` must have texture coordinates for a stiffness map, got none",
    ),
    "stiffness missing": ("flatten page.obj -o out/f.ply -m own:press --stiffness n.png", "`n.png` must be a file"),
    "texture in mm": (
        "flatten page.ply -o out/f.ply -m own:press --stiffness m.png",
        "`texture` must lie in [0, 1], got -30 to 40",
    ),
    "page for a grid": ("flatten page.obj -o out/f.ply -m paper_rk4", "must"),
}


@pytest.mark.parametrize("case", list(WRONG))
def test_a_wrong_line_is_one_line_and_code_2(here: Path, deskew: Command, case: str) -> None:
    line, message = WRONG[case]
    code, out, err = deskew(line)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert message in err
    assert list((here / "out").iterdir()) == []


@pytest.mark.parametrize("suffix", ["ply", "obj"])
def test_a_flat_mesh_names_its_texture_as_seen_from_itself(
    deskew: Command, page: Mesh, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "flat").mkdir()
    write_mesh(page, tmp_path / "page.obj")
    write_image(np.zeros((3, 4), np.uint8), tmp_path / "page.png")
    assert deskew(f"flatten page.obj -o flat/page.{suffix} --noise 0 --picture page.png")[0] == 0
    named = tmp_path / "flat" / ("page.mtl" if suffix == "obj" else "page.ply")
    assert b"../page.png\n" in named.read_bytes()
    code, out, err = deskew("flatten page.obj -o flat/b.ply --noise 0 --picture none.png")
    assert (code, out, err) == (2, "", "deskew: `none.png` must be a file, got nothing there.\n")
    write_mesh(Mesh(page.vertices, page.faces), tmp_path / "bare.obj")
    code, _, err = deskew("flatten bare.obj -o flat/b.ply --noise 0 --picture page.png")
    assert (code, "`--picture` must come with a mesh that has texture coordinates" in err) == (2, True)
    assert not (tmp_path / "flat" / "b.ply").exists()

"""`deskew score`: a flattening by any program against the truth."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from deskew.io import Mesh, write_mesh
from deskew.types import Floats

Command = Callable[[str], tuple[int, str, str]]


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, page: Mesh) -> Path:
    write_mesh(page, tmp_path / "truth.obj")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def flat(page: Mesh, places: Floats | None = None) -> Mesh:
    """The page flat on z = 0, without texture."""
    assert page.texture is not None
    at = page.texture if places is None else places
    return Mesh(np.column_stack([at, 0 * at[:, 0]]), page.faces)


def true(page: Mesh) -> Floats:
    assert page.texture is not None
    return page.texture


def test_the_truth_flat_on_the_bed_is_perfect(here: Path, page: Mesh, deskew: Command) -> None:
    write_mesh(flat(page, true(page) @ np.array([[0.6, 0.8], [-0.8, 0.6]]) + 5), here / "flat.obj")
    code, out, err = deskew("score flat.obj --truth truth.obj --json")
    figures = json.loads(out)
    assert (code, err, figures["places"]) == (0, "", "xy")
    assert (figures["vertices"], figures["faces"], figures["flips"]) == (147, 240, 0)
    for name in ("flat_mean_mm", "flat_max_mm", "flat_rigid_mean_mm", "flat_rigid_max_mm"):
        assert 0 <= figures[name] < 1e-9
    for name in ("stretch_l2", "stretch_linf", "stretch_inverse_l2", "stretch_inverse_linf"):
        assert 0.999 < figures[name] < 1.001
    code, out, err = deskew("score flat.obj --truth truth.obj")
    assert (code, err) == (0, "")
    assert "flips: 0\n" in out


@pytest.mark.parametrize("form", ["x y of an OBJ", "texture of an OBJ", "x y of a PLY"])
def test_every_form_of_a_flattening_is_read(here: Path, page: Mesh, deskew: Command, form: str) -> None:
    """Two per cent too large, seen rigidly and not affinely; a texture comes before bent vertices."""
    name = "flat.ply" if "PLY" in form else "flat.obj"
    large = 1.02 * true(page)
    write_mesh(replace(page, texture=large) if "texture" in form else flat(page, large), here / name)
    code, out, err = deskew(f"score {name} --truth truth.obj --json")
    figures = json.loads(out)
    assert (code, err) == (0, "")
    radius = np.linalg.norm(true(page) - true(page).mean(axis=0), axis=1)
    assert figures["flat_rigid_mean_mm"] == pytest.approx(0.02 * radius.mean(), abs=1e-5)
    assert 0 <= figures["flat_max_mm"] < 1e-5
    assert figures["stretch_inverse_linf"] == pytest.approx(1.02, abs=1e-3)


def test_a_texture_that_flattening_only_carried_along_is_no_result(here: Path, page: Mesh, deskew: Command) -> None:
    rounded = np.round(true(page), 3)
    write_mesh(replace(flat(page, 1.02 * true(page)), texture=rounded), here / "flat.obj")
    code, out, _ = deskew("score flat.obj --truth truth.obj --json")
    figures = json.loads(out)
    assert (code, figures["places"]) == (0, "xy")
    assert figures["flat_rigid_mean_mm"] > 0.1


@pytest.mark.parametrize("v", [1.0, -1.0], ids=["v up", "v down"])
def test_mirrored_is_code_3_whichever_way_the_truths_v_runs(here: Path, page: Mesh, deskew: Command, v: float) -> None:
    write_mesh(replace(page, texture=true(page) * [1.0, v]), here / "truth.obj")
    write_mesh(flat(page), here / "flat.obj")
    assert deskew("score flat.obj --truth truth.obj")[0] == 0
    assert deskew("score truth.obj --truth truth.obj")[0] == 0
    write_mesh(flat(page, true(page) * [-1.0, 1.0]), here / "flat.obj")
    code, out, err = deskew("score flat.obj --truth truth.obj")
    assert (code, out, err.count("\n")) == (3, "", 1)
    assert "mirrored" in err


def test_a_flipped_face_is_counted_and_stretches_without_end(here: Path, page: Mesh, deskew: Command) -> None:
    places = true(page).copy()
    places[40] += [2.5, 0.0]
    write_mesh(flat(page, places), here / "flat.obj")
    code, out, _ = deskew("score flat.obj --truth truth.obj --json")
    figures = json.loads(out)
    assert (code, figures["stretch_l2"], figures["stretch_inverse_linf"]) == (0, None, None)
    assert figures["flips"] >= 1
    assert "stretch_linf: inf\n" in deskew("score flat.obj --truth truth.obj")[1]


def test_faces_in_another_order_are_the_same_faces(here: Path, page: Mesh, deskew: Command) -> None:
    rng = np.random.default_rng(4)
    faces = np.array([np.roll(face, rng.integers(3)) for face in rng.permutation(page.faces)])
    write_mesh(replace(flat(page), faces=faces), here / "flat.obj")
    assert deskew("score flat.obj --truth truth.obj")[0] == 0


def test_a_surface_that_is_not_flat_is_scored_by_x_and_y_and_said_so(here: Path, page: Mesh, deskew: Command) -> None:
    write_mesh(Mesh(page.vertices, page.faces), here / "bent.obj")
    code, _, err = deskew("score bent.obj --truth truth.obj")
    assert (code, err) == (0, "deskew: warning: bent.obj is not flat on z = 0; only its x and y are scored\n")


WRONG: dict[str, tuple[str, str]] = {
    "no truth": ("score flat.obj", "Missing option '--truth'"),
    "truth missing": ("score flat.obj -t gone.obj", "`gone.obj` must be a file, got nothing there"),
    "truth without texture": ("score flat.obj -t flat.obj", "`flat.obj` must hold texture coordinates"),
    "truth an image": ("score flat.obj -t truth.png", "`truth.png` must end in .obj or .ply, got .png"),
    "flat damaged": ("score damaged.obj -t truth.obj", "`damaged.obj` must be a valid mesh"),
    "a vertex more": ("score more.obj -t truth.obj", "`more.obj` must have the truth's 147 vertices, got 148"),
    "a face less": ("score less.obj -t truth.obj", "`less.obj` must have the truth's 240 faces, got 239"),
    "another face": ("score other.obj -t truth.obj", "must have the truth's faces, wound alike, got 1 others"),
    "wound otherwise": ("score wound.obj -t truth.obj", "must have the truth's faces, wound alike, got 240 others"),
    "on a line": ("score line.obj -t truth.obj", "`flat` must span a plane, and more than 1e-09 mm, got points on"),
}  # fmt: skip


@pytest.mark.parametrize("case", list(WRONG))
def test_a_wrong_input_is_one_line_and_code_2(here: Path, page: Mesh, deskew: Command, case: str) -> None:
    sheet = flat(page)
    other = sheet.faces.copy()
    other[0] = [0, 22, 45]
    meshes = {
        "flat": sheet,
        "more": Mesh(np.concatenate([sheet.vertices, [[0.0, 0, 0]]]), sheet.faces),
        "less": replace(sheet, faces=sheet.faces[1:]),
        "other": replace(sheet, faces=other),
        "wound": replace(sheet, faces=sheet.faces[:, ::-1]),
        "line": flat(page, true(page) * [1.0, 0.0]),
    }
    for name, mesh in meshes.items():
        write_mesh(mesh, here / f"{name}.obj")
    (here / "damaged.obj").write_bytes(b"v 1 2 x\n")
    line, message = WRONG[case]
    code, out, err = deskew(line)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert message in err

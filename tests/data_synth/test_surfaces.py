from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from data_synth import surfaces
from data_synth.sheets import PAGE_SIZE_MM, TrueSheet, least_cell, projected_cells
from deskew.errors import InputError
from deskew.io import grid_faces, read_mesh
from deskew.types import Floats

CLOSED = ("cylinder", "cone", "folds", "mirror")
SHAPE = (181, 233)
SEEDS = (9101, 9102, 9103)


@pytest.fixture(scope="module")
def sheets() -> dict[tuple[str, int], TrueSheet]:
    return {(kind, seed): surfaces.generate(kind, seed, SHAPE) for kind in CLOSED for seed in SEEDS}


def of(sheets: dict[tuple[str, int], TrueSheet], kind: str) -> list[TrueSheet]:
    return [sheet for (name, _), sheet in sheets.items() if name == kind]


def normals(sheet: TrueSheet) -> Floats:
    V = sheet.vertices
    n = np.cross(V[:-1, 1:] - V[1:, :-1], V[:-1, :-1] - V[1:, 1:]).reshape(-1, 3)
    return n / np.linalg.norm(n, axis=-1, keepdims=True)


@pytest.mark.parametrize("kind", CLOSED)
def test_no_edge_is_longer_than_the_paper(kind: str, sheets: dict[tuple[str, int], TrueSheet]) -> None:
    for sheet in of(sheets, kind):
        assert surfaces.edge_strain(sheet).max() < 1e-11


@pytest.mark.parametrize("kind", ["cylinder", "cone"])
def test_smooth_kinds_are_isometric(kind: str) -> None:
    for seed in SEEDS:
        # A chord across curvature k is (k h)^2 / 24 shorter than its arc, and no more: 1e-6 on this fine a grid.
        sheet = surfaces.generate(kind, seed, (541, 697))
        strain = np.abs(surfaces.edge_strain(sheet))
        assert 0 < np.median(strain) < 1e-6
        assert np.percentile(strain, 99) < 4e-6


@pytest.mark.parametrize("kind", ["folds", "mirror"])
def test_folded_kinds_are_isometric_away_from_their_creases(
    kind: str, sheets: dict[tuple[str, int], TrueSheet]
) -> None:
    for sheet in of(sheets, kind):
        strain = np.abs(surfaces.edge_strain(sheet))
        assert np.median(strain) < 1e-6
        assert 0.001 < np.mean(strain > 1e-4) < 0.12
        assert 0.003 < strain.max() < 0.3


def test_a_cylinder_has_its_normals_in_a_plane_and_a_cone_on_a_circle(
    sheets: dict[tuple[str, int], TrueSheet],
) -> None:
    for sheet in of(sheets, "cylinder"):
        assert np.linalg.svd(normals(sheet), compute_uv=False)[2] < 1e-4 * np.sqrt(normals(sheet).size)
    for sheet in of(sheets, "cone"):
        n = normals(sheet)
        spread = np.linalg.svd(n - n.mean(axis=0), compute_uv=False) / np.sqrt(len(n))
        assert spread[2] < 1e-3 * spread[0]
        assert np.linalg.svd(n, compute_uv=False)[2] / np.sqrt(len(n)) > 1e-3


@pytest.mark.parametrize("kind", CLOSED)
def test_sheets_span_the_page_on_the_grid_asked_for(kind: str, sheets: dict[tuple[str, int], TrueSheet]) -> None:
    for sheet in of(sheets, kind):
        assert sheet.vertices.shape == (*SHAPE, 3)
        assert sheet.page_size_mm == PAGE_SIZE_MM
        assert sheet.flat.min() == 0
        assert np.ptp(np.diff(sheet.flat[0, :, 0])) < 1e-9


@pytest.mark.parametrize("kind", CLOSED)
def test_sheets_are_height_fields_that_rest_on_the_bed_unmirrored(
    kind: str, sheets: dict[tuple[str, int], TrueSheet]
) -> None:
    for sheet in of(sheets, kind):
        assert sheet.vertices[..., 2].min() == pytest.approx(0, abs=0.05)
        assert least_cell(sheet.vertices) >= 0.3
        assert (projected_cells(sheet.vertices) > 0).all()


@pytest.mark.parametrize("kind", CLOSED)
def test_the_slope_asked_for_is_met(kind: str) -> None:
    for slope in (12.0, 24.0):
        sheet = surfaces.generate(kind, 77, (121, 156), slope_p90_deg=slope)
        assert sheet.slope_p90_deg == pytest.approx(slope, abs=1.0)


def test_cylinders_and_cones_bulge_by_centimetres(sheets: dict[tuple[str, int], TrueSheet]) -> None:
    for kind in ("cylinder", "cone"):
        assert all(20 < sheet.relief_mm < 130 for sheet in of(sheets, kind))


def test_folds_rise_and_fall_in_turn() -> None:
    for seed in SEEDS:
        n = normals(surfaces.generate("folds", seed, (121, 156)))
        # All panels' normals lie in one plane; counted along it they fall on both sides of the upright.
        axis = np.linalg.svd(n, full_matrices=False)[2][2]
        lean = np.einsum("ni,i->n", n, np.cross(axis, [0.0, 0.0, 1.0]))
        assert lean.min() < -0.1
        assert lean.max() > 0.1


@pytest.mark.parametrize("kind", CLOSED)
def test_the_surface_does_not_depend_on_the_grid(kind: str) -> None:
    dense, sparse = surfaces.generate(kind, 5, (121, 157)), surfaces.generate(kind, 5, (61, 79))
    shift = dense.vertices[::2, ::2] - sparse.vertices
    assert np.ptp(shift.reshape(-1, 3), axis=0).max() < 1e-9  # but for where it is put


@pytest.mark.parametrize("kind", CLOSED)
def test_a_seed_is_one_surface_and_the_next_another(kind: str, sheets: dict[tuple[str, int], TrueSheet]) -> None:
    again = surfaces.generate(kind, SEEDS[0], SHAPE)
    assert np.array_equal(again.vertices, sheets[kind, SEEDS[0]].vertices)
    assert np.abs(again.vertices - sheets[kind, SEEDS[1]].vertices).max() > 1


def test_the_grid_is_drawn_unless_given() -> None:
    shapes = {surfaces.generate("cylinder", seed).vertices.shape for seed in range(6)}
    assert len(shapes) > 3
    assert all(180 <= rows <= 240 and 230 <= columns <= 310 for rows, columns, _ in shapes)


def test_a_file_comes_back_as_it_was_written(tmp_path: Path) -> None:
    sheet = surfaces.generate("folds", 3, (31, 40))
    surfaces.write_surface(sheet, tmp_path / "a.obj", ["a remark"])
    mesh = read_mesh(tmp_path / "a.obj")
    assert np.abs(mesh.vertices - sheet.vertices.reshape(-1, 3)).max() < 1e-8
    assert mesh.texture is not None
    assert np.abs(mesh.texture - sheet.flat.reshape(-1, 2)).max() < 1e-8
    assert np.array_equal(mesh.faces, grid_faces(31, 40))
    assert (tmp_path / "a.obj").read_text().startswith("# a remark\nv ")


def test_the_command_writes_the_same_bytes_again_and_says_how_bent(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("one", "two"):
        options = ["--kind", "cone,folds", "--count", "2", "--seed", "7", "--rows", "41", "--columns", "53"]
        assert surfaces.main([str(tmp_path / name), *options]) == 0
    names = sorted(path.name for path in (tmp_path / "one").iterdir())
    assert names == ["cone_7.obj", "cone_8.obj", "folds_7.obj", "folds_8.obj"]
    for name in names:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 8
    assert lines[0].startswith("cone_7: 41 x 53 vertices, slope p90 ")
    assert "edge strain" in lines[0]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--kind", "sphere"], "`kind` must be one of cylinder, cone, folds, mirror, physical, got sphere."),
        (["--rows", "50"], "`rows` must be given together with `columns`, got one of them."),
        (["--rows", "1", "--columns", "9"], "`rows` must be a whole number in [2, 2000], got 1."),
        (["--count", "0"], "`count` must be a whole number in [1, 10000], got 0."),
        (["--seed", "-1"], "`seed` must be a whole number in [0, 9223372036854775807], got -1."),
        (
            ["--seed", str(2**63 - 1), "--count", "2"],
            "`seed` must be a whole number in [0, 9223372036854775806], got 9223372036854775807.",
        ),
        (["--count", "x"], "The arguments must be as --help shows, got: argument --count: invalid int value: 'x'."),
        (["--bent"], "The arguments must be as --help shows, got: unrecognized arguments: --bent."),
        (["--kind", "cone", "--slope-p90-deg", "nan"], "`slope_p90_deg` must be in [1, 50], got nan."),
    ],
)
def test_bad_requests_end_in_one_line(
    options: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert surfaces.main([str(tmp_path / "out"), *options]) == 2
    assert capsys.readouterr().err == f"error: {message}\n"
    assert not list(tmp_path.glob("out/*"))


def test_a_file_in_the_folders_place_is_refused(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("")
    assert surfaces.main([str(tmp_path / "out"), "--kind", "cone"]) == 2


def test_arguments_out_of_range_are_named() -> None:
    with pytest.raises(InputError, match=r"`shape` must be \(rows, columns\)"):
        surfaces.cylinder(np.random.default_rng(0), (1, 5))
    with pytest.raises(InputError, match=r"`n_folds` must be"):
        surfaces.folds(np.random.default_rng(0), n_folds=(3, 2))

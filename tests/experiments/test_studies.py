"""What the studies share, and what they refuse before any work is done."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from deskew.io import write_arrays
from deskew.projection import ideal, project, rays
from deskew.types import Array, Floats, Pinhole
from experiments.program import main
from experiments.studies import STUDIES, find_study
from experiments.studies.given_sheets import read_sheet
from experiments.studies.real_boards import _in_world, _onto_bed
from experiments.studies.views import restored_corners

SIZE = (160, 120)
K = np.array([[400.0, 0.0, 80.3], [0.0, 401.0, 59.6], [0.0, 0.0, 1.0]])
ROTATION = cv2.Rodrigues(np.array([3.0, 0.1, -0.2]))[0]
CAMERA = Pinhole(SIZE, K, np.array([-0.1, 0.05, 1e-3, -1e-3, 0.0]), ROTATION, np.array([5.0, -3.0, 800.0]))
NORMAL, OFFSET = np.array([0.1, -0.2, 0.97]) / np.linalg.norm([0.1, -0.2, 0.97]), 12.0


def plane_depth(pixels: Floats) -> Floats:
    """Return the camera z at which the ideal camera's rays meet the plane NORMAL . x = OFFSET."""
    origin = -CAMERA.R.T @ CAMERA.t
    return np.asarray((OFFSET - origin @ NORMAL) / (rays(ideal(CAMERA), pixels) @ NORMAL))


def test_corners_are_found_where_the_restored_page_shows_them() -> None:
    y, x = np.mgrid[0:60, 0:80].astype(np.float64)
    uv = np.stack([0.5 * x + 3.0, 0.5 * y - 2.0], axis=-1)
    uv[:, :10] = np.nan
    corners = np.array([(20.5, 10.0), (3.5, 10.0), (200.0, 10.0)])
    found = restored_corners(uv, corners)
    assert found[0].tolist() == [35.0, 24.0]
    assert np.isnan(found[1:]).all()


def test_moving_the_world_onto_the_board_changes_no_picture_and_lays_the_board_on_the_bed() -> None:
    rng = np.random.default_rng(2)
    across = np.linalg.svd(NORMAL[None])[2][1:]
    points = OFFSET * NORMAL + rng.uniform(-80, 80, (63, 2)) @ across
    projector = Pinhole(SIZE, K, np.zeros(5), ROTATION, np.array([-200.0, 0.0, 780.0]))
    R, t = _onto_bed(CAMERA, points)
    here = points @ R.T + t
    assert np.abs(here[:, 2]).max() < 1e-9
    for before in (CAMERA, projector):
        after = _in_world(before, R, t)
        assert np.abs(project(after, here) - project(before, points)).max() < 1e-9
    camera = _in_world(CAMERA, R, t)
    assert -(camera.R.T @ camera.t)[2] > 0


def test_real_boards_refuse_other_captures(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "capture_0"
    folder.mkdir()
    (folder / "graycode_00.png").write_bytes(b"something else")
    assert main(["experiment=real_boards", f"out={tmp_path / 'out'}", f"real_boards.path={tmp_path}"]) == 2
    error = capsys.readouterr().err
    assert error.startswith("`real_boards.path` must hold the frames of kamino410/procam-calibration at 09e58d5")
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "name",
    [
        "ablations",
        "attribution",
        "corner_distance",
        "culling",
        "plane_accuracy",
        "real_boards",
        "sensitivity",
        "settling",
        "speed",
    ],
)
def test_every_study_documents_its_conditions(name: str) -> None:
    study = find_study(name)
    assert "Conditions\n" in str(type(study).__doc__)
    assert len({column.metric for column in study.layout.columns}) == len(study.layout.columns)
    assert name in STUDIES


@pytest.mark.parametrize(
    ("overrides", "names"),
    [
        (["experiment=corner_distance", "method=magic"], ("method", "magic")),
        (["experiment=corner_distance", "sheet.paths=[a.npz]", "trials=2"], ("`trials`", "at most 1", "got 2")),
        (["experiment=corner_distance", "sheet.paths=[no.npz]", "trials=1"], ("no.npz",)),
        (["experiment=corner_distance", "sheet.slope_p90_deg=50"], ("`sheet.slope_p90_deg`", "[1, 45]", "50")),
        (["experiment=corner_distance", "sheet.kind=crumpled"], ("`sheet.kind`", "mirror, physical", "crumpled")),
        (
            ["experiment=corner_distance", "sheet.paths=[a.npz]", "trials=1", "sheet.drawn=true"],
            ("`sheet.drawn`", "false"),
        ),
        (
            ["experiment=decoders", "sheet.kind=physical", "sheet.drawn=true", "sheet.slope_p90_deg=33"],
            ("`sheet.slope_p90_deg`", "[3, 30] degrees", "33"),
        ),
        (["experiment=plane_accuracy", "sheet=physical"], ("`sheet.kind`", "left out: this", "physical")),
        (["experiment=surfaces", "sheet.drawn=true"], ("`sheet.drawn`", "left out", "True")),
        (["experiment=plane_accuracy", "method=nope"], ("method", "nope")),
        (["experiment=plane_accuracy", "sheet.paths=[no.npz]"], ("`sheet.paths`", "left out", "no.npz")),
        (["experiment=ablations", "method=nope"], ("method", "nope")),
        (["experiment=ablations", "sheet.paths=[no.npz]"], ("`sheet.paths`", "left out", "no.npz")),
        (
            ["experiment=attribution", "method=[spring,paper_euler]"],
            ("`method`", "two ends", "['spring', 'paper_euler']"),
        ),
        (["experiment=attribution", "scan.ink=true"], ("`scan`", "switches it")),
        (["experiment=sensitivity", "method=[arap]"], ("`method`", "spring, paper_euler, paper_rk4", "arap")),
        (["experiment=sensitivity", "scan.denoise=true"], ("`scan`", "switches it")),
        (["experiment=sensitivity", "sheet=physical"], ("`sensitivity.slope_p90_deg`", "[] for sheets that are given")),
        (["experiment=sensitivity", "mesh.rows=30"], ("`sensitivity.mesh`", "unless mesh.rows equals")),
        (["experiment=sensitivity", "sensitivity.noise_scale=[1]"], ("`sensitivity.noise_scale`", "leave out 1,")),
        (["experiment=real_boards", "sheet.paths=[no.npz]"], ("`sheet.paths`", "left out", "no.npz")),
        (["experiment=real_boards", "trials=6"], ("`trials`", "at most 5", "got 6")),
        (["experiment=real_boards", "real_boards.path=/no/such"], ("`real_boards.path`", "be a folder", "/no/such")),
    ],
)
def test_a_study_refuses_before_it_writes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], overrides: list[str], names: tuple[str, ...]
) -> None:
    assert main([*overrides, f"out={tmp_path / 'out'}"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert all(name in line for name in names)
    assert not (tmp_path / "out").exists()


def test_real_boards_without_data_say_absent(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["experiment=real_boards", f"out={tmp_path / 'out'}"]) == 0
    assert capsys.readouterr().out.startswith("real_boards: absent: ")
    assert not (tmp_path / "out").exists()


def _flat_sheet() -> dict[str, Array]:
    u, v = np.meshgrid(np.linspace(0.0, 279.0, 8), np.linspace(0.0, 216.0, 6))
    return {"V": np.stack([u - 139.5, 108.0 - v, 0.0 * u], axis=-1), "F": np.stack([u, v], axis=-1)}


def _with(name: str, values: Array) -> dict[str, Array]:
    return _flat_sheet() | {name: values}


FLAT = _flat_sheet()


@pytest.mark.parametrize(
    ("arrays", "names"),
    [
        ({"V": FLAT["V"]}, ("hold V (h, w, 3) and F (h, w, 2)", "got V")),
        (_with("V", np.full((6, 8, 3), np.nan)), (": V`", "finite")),
        (_with("F", np.full((6, 8, 2), np.inf)), (": F`", "finite")),
        (_with("V", FLAT["V"][..., :2]), (": V`", "shape (h, w, 3)", "(6, 8, 2)")),
        (_with("V", FLAT["V"][:1]), (": V`", "h, w >= 2", "(1, 8, 3)")),
        (_with("F", FLAT["F"][:4]), (": F`", "shape (6, 8, 2)", "(4, 8, 2)")),
        (_with("V", FLAT["V"] + (0.0, 0.0, 1001.0)), (": V`", "1000 mm of", "got 1001 mm")),
        (_with("V", np.full((6, 8, 3), 1e300)), (": V`", "1000 mm of", "got 1e+300 mm")),
        (_with("V", 0.0 * FLAT["V"]), (": V`", "20%", "got 100%")),
        (_with("V", 1.25 * FLAT["V"]), (": V`", "20%", "got 25%")),
        (_with("V", 0.75 * FLAT["V"]), (": V`", "20%", "got 25%")),
        (_with("F", 0.9 * FLAT["F"]), (": F`", "279 x 216 mm", "(251.1, 194.4)")),
        (_with("F", FLAT["F"] + 50.0), (": F`", "from (0, 0)", "got (50, 50)")),
    ],
)
def test_a_given_sheet_that_is_no_page_is_refused_by_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arrays: dict[str, Array], names: tuple[str, ...]
) -> None:
    path = tmp_path / "sheet.npz"
    write_arrays(arrays, path)
    out = tmp_path / "out"
    assert main(["experiment=corner_distance", f"sheet.paths=[{path}]", "trials=1", f"out={out}"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"`{path}")
    assert all(name in line for name in names)
    assert not out.exists()


@given(stretch=st.floats(0.81, 1.19), shift=st.floats(-100.0, 100.0))
def test_a_given_sheet_within_the_bounds_is_read_as_it_is(
    tmp_path_factory: pytest.TempPathFactory, stretch: float, shift: float
) -> None:
    path = tmp_path_factory.getbasetemp() / "within.npz"
    write_arrays(_with("V", stretch * FLAT["V"] + shift), path)
    sheet = read_sheet(path, (279.0, 216.0))
    assert np.array_equal(sheet.vertices, stretch * FLAT["V"] + shift)
    assert np.array_equal(sheet.flat, FLAT["F"])

"""The study of surfaces: its rows, its noise, and that what breaks fails its own rows alone."""

from __future__ import annotations

import csv
import json
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from data_synth import TrueSheet, surfaces
from deskew.io import Mesh, grid_faces, write_mesh
from experiments.program import main
from experiments.settings import SURFACE_KINDS, SurfacesSettings
from experiments.trials import Row, TrialKey

METHODS = ("unroll", "project", "fold", "mirror")
Figures = dict[tuple[str, str, int], dict[str, float]]


def cylinder() -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    s, y = np.meshgrid(np.linspace(-20, 20, 21), np.linspace(0, -30, 7))
    return np.stack([25 * np.sin(s / 25), y, 25 * np.cos(s / 25)], axis=-1), np.stack([s + 20, -y], axis=-1)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Two meshes with their truth, page coordinates whose v runs down, and one without."""
    V, uv = cylinder()
    for name in ("a", "b,c"):
        write_mesh(Mesh(V.reshape(-1, 3), grid_faces(7, 21), uv.reshape(-1, 2)), tmp_path / f"{name}.obj")
    write_mesh(Mesh(V.reshape(-1, 3), grid_faces(7, 21)), tmp_path / "bare.obj")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*overrides: str, methods: tuple[str, ...] = METHODS) -> int:
    named = ",".join(f"tests.experiments.flatteners:{name}" for name in methods)
    return main(["experiment=surfaces", f"method=[{named}]", "engine=serial", "out=out", *overrides])


def read(name: str = "results.csv") -> Figures:
    found: Figures = defaultdict(dict)
    with Path("out", name).open() as file:
        for row in csv.DictReader(file):
            method = row["method"].rpartition(":")[2]
            found[row["condition"], method, int(row["trial"])][row["metric"]] = float(row["value"])
    return found


def test_every_file_is_a_trial_and_every_method_has_its_rows(here: Path) -> None:
    assert run("surfaces.paths=['a.obj','b,c.obj']") == 0
    found, times = read(), read("timings.csv")
    places = {(f"flattened/{stem}", method, i) for i, stem in enumerate(("a", "b,c")) for method in (*METHODS, "-")}
    assert set(found) == places
    for condition, _, i in places:
        assert found[condition, "-", i] == {"vertices": 147.0, "relief_mm": pytest.approx(25 * (1 - np.cos(0.8)))}
        perfect = found[condition, "unroll", i]
        for name in ("flat_mean_mm", "flat_max_mm", "flat_rigid_mean_mm", "flat_rigid_max_mm", "flips", "folds"):
            assert perfect[name] == pytest.approx(0.0, abs=1e-9)
        assert (perfect["at_rest"], perfect["noise_estimated_mm"]) == (1.0, pytest.approx(0.0, abs=1e-9))
        # Chords of 2 mm on a radius of 25 mm: short of their arcs by d^2 / 24 r^2.
        assert perfect["stretch_linf"] == pytest.approx(1.0, abs=1e-9)
        assert 0.5 * 2**2 / (24 * 25**2) < perfect["strain_rms"] < 2**2 / (24 * 25**2)
        assert 0.0 < perfect["area_error"] < 1e-3
        pressed = found[condition, "project", i]
        assert pressed["flat_rigid_mean_mm"] > pressed["flat_mean_mm"] > 0.1
        assert pressed["stretch_linf"] == pytest.approx(1 / np.cos(0.76), abs=1e-6)  # the outermost of 20 facets
        assert pressed["at_rest"] == 0.0
        assert "noise_estimated_mm" not in pressed
        assert set(times[condition, "unroll", i]) == {"seconds_flatten"}


def test_what_is_infinite_has_no_row_and_what_is_mirrored_fails_alone(here: Path) -> None:
    assert run("surfaces.paths=[a.obj]") == 0
    found = read()
    folded = found["flattened/a", "fold", 0]
    assert folded["flips"] > 0
    assert folded["folds"] > 0
    assert not {"stretch_l2", "stretch_linf"} & set(folded)
    assert found["flattened/a", "mirror", 0] == {"failed": 1.0}
    failures = json.loads(Path("out/run.json").read_text())["failures"]
    assert [(failure["method"].rpartition(":")[2], "mirrored" in failure["reason"]) for failure in failures] == [
        ("mirror", True)
    ]
    assert "| flattened/a | tests.experiments.flatteners:unroll |" in Path("out/table.md").read_text()


def test_a_file_without_its_truth_fails_as_a_trial_and_stops_no_other(here: Path) -> None:
    assert run("surfaces.paths=[bare.obj,a.obj]", methods=("unroll",)) == 0
    found = read()
    assert found["flattened/bare", "-", 0] == {"failed": 1.0}
    assert found["flattened/a", "unroll", 1]["flips"] == 0.0


def test_noise_is_each_trials_own_and_unknown_to_the_score(here: Path) -> None:
    assert run("surfaces.paths=[a.obj,a.obj]", "surfaces.noise_mm=0.3", "seed=5", methods=("unroll",)) == 0
    found = read()
    noisy = [found["flattened/a", "unroll", trial]["noise_estimated_mm"] for trial in (0, 1)]
    assert len(set(noisy)) == 2
    for value, trial in zip(noisy, (0, 1), strict=True):
        z = TrialKey("surfaces", trial=trial, seed=5).generator().normal(0.0, 0.3, 147)
        V = cylinder()[0].reshape(-1, 3) + np.column_stack([0 * z, 0 * z, z])
        assert value == pytest.approx(np.abs(np.linalg.norm(V[:, [0, 2]], axis=1) - 25).max())
    first = Path("out/results.csv").read_bytes()
    assert 0.0 < read()["flattened/a", "unroll", 0]["strain_rms"] < 0.5
    Path("out/results.sqlite").unlink()
    assert run("surfaces.paths=[a.obj,a.obj]", "surfaces.noise_mm=0.3", "seed=5", methods=("unroll",)) == 0
    assert Path("out/results.csv").read_bytes() == first


def test_another_draw_of_the_noise_is_on_the_same_surface(here: Path) -> None:
    meshes, noisy = [], []
    for draw in (0, 3):
        overrides = ["surfaces.paths=[a.obj]", "surfaces.noise_mm=0.3", f"rig.noise_draw={draw}"]
        assert run(*overrides, methods=("unroll",)) == 0
        meshes.append(read()["flattened/a", "-", 0])
        noisy.append(read()["flattened/a", "unroll", 0]["noise_estimated_mm"])
    assert meshes[0] == meshes[1]
    assert noisy[0] != noisy[1]


def test_a_renamed_file_is_another_row_and_a_moved_one_the_same(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("surfaces.paths=[a.obj]", methods=("unroll",)) == 0
    (here / "moved").mkdir()
    (here / "a.obj").rename(here / "moved/a.obj")
    capsys.readouterr()
    assert run("surfaces.paths=[moved/a.obj]", methods=("unroll",)) == 0
    assert "1 trials, 0 run now" in capsys.readouterr().out
    (here / "moved/a.obj").rename(here / "moved/d.obj")
    assert run("surfaces.paths=[moved/d.obj]", methods=("unroll",)) == 0
    assert {condition for condition, _, _ in read()} == {"flattened/d"}
    moved = Path("moved/d.obj")
    moved.write_text(moved.read_text() + "# another content\n")
    assert run("surfaces.paths=[moved/d.obj]", methods=("unroll",)) == 0
    assert capsys.readouterr().out.count("1 trials, 1 run now") == 2


def test_without_files_every_kind_is_generated_in_each_trial(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[str, int]] = []

    def generate(kind: str, seed: int) -> TrueSheet:
        asked.append((kind, seed))
        return TrueSheet(*cylinder())

    monkeypatch.setattr(surfaces, "generate", generate)
    assert run("surfaces.kinds=[cone,mirror]", "trials=2", methods=("unroll",)) == 0
    conditions = [f"flattened/{kind}" for kind in ("cone", "mirror")]
    assert set(read()) == {(c, method, i) for c in conditions for method in ("-", "unroll") for i in (0, 1)}
    assert sorted(kind for kind, _ in asked) == ["cone", "cone", "mirror", "mirror"]
    assert len({seed for _, seed in asked}) == 2
    assert run("trials=1", methods=("unroll",)) == 0
    assert [kind for kind, _ in asked[4:]] == ["cylinder", "folds"]  # the others are kept


def test_the_kinds_are_those_that_can_be_generated() -> None:
    assert set(SURFACE_KINDS) == set(surfaces.KINDS)


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("surfaces.paths=[gone.obj]", "`surfaces.paths` must name files, got gone.obj, where there is none."),
        ("surfaces.paths=[a.stl]", "`surfaces.paths` must be a list of OBJ or PLY files, one a trial, got ['a.stl']."),
        ("surfaces.noise_mm=-1", "`surfaces.noise_mm` must lie in [0, 10] mm, got -1.0."),
        ("surfaces.kinds=[ball]", "`surfaces.kinds` must be a list of different ones of cylinder, cone"),
        ("method=iron", "`method` must be one of"),
    ],
)
def test_what_it_cannot_do_is_refused_before_anything_is_written(
    here: Path, capsys: pytest.CaptureFixture[str], override: str, message: str
) -> None:
    assert run(override) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not (here / "out").exists()


def test_defaults_are_of_no_noise_and_no_files() -> None:
    assert (SurfacesSettings().paths, SurfacesSettings().noise_mm) == ([], 0.0)
    assert Row.of(TrialKey("surfaces"), "flattened/a", "-", "noise_estimated_mm", 0.3).unit == "mm"

"""Methods that are not built in: what they break is theirs alone, and the worked example runs from outside."""

from __future__ import annotations

import csv
import json
import os
import re
import shutil
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

from deskew.io import Mesh, grid_faces, write_mesh
from experiments.program import main
from experiments.settings import Config, OwnSettings
from experiments.studies import STUDIES, about_own
from experiments.studies.methods import kind_of
from experiments.studies.recipes import methods_by_recipe

ROOT = Path(__file__).resolve().parents[2]
EXAMPLE = ROOT / "docs" / "examples" / "own_method"
UNRULY = "tests.own.unruly"
Figures = dict[tuple[str, str], dict[str, float]]


def rows_of(out: Path) -> Figures:
    found: Figures = defaultdict(dict)
    with (out / "results.csv").open() as file:
        for row in csv.DictReader(file):
            found[row["condition"], row["method"]][row["metric"]] = float(row["value"])
    return found


@pytest.fixture
def cylinder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A mesh with its truth, in the working folder."""
    s, y = (axis.ravel() for axis in np.meshgrid(np.linspace(-20, 20, 21), np.linspace(0, -30, 7)))
    bent = np.stack([25 * np.sin(s / 25), y, 25 * np.cos(s / 25)], axis=-1)
    write_mesh(Mesh(bent, grid_faces(7, 21), np.stack([s + 20, -y], axis=-1)), tmp_path / "a.obj")
    monkeypatch.chdir(tmp_path)
    return tmp_path


# Each breaks one rule; what is said of it.
BROKEN = {
    "crash": "crashed with SIGSEGV",
    "hang": "took longer than the 10 s that it may take",
    "hoard": "ran out of the 1024 MB that it may take",
    "tear": "must return finite vertices",
    "shorten": "must keep the shape (147, 3), got (146, 3)",
    "mirror": "mirrored",
    "leave": "without a result",
    "flood": "File too large",
    "pickle_code": "left a result that cannot be read",
}


def test_what_a_method_breaks_costs_its_own_rows_and_nothing_else(cylinder: Path) -> None:
    line = ["experiment=surfaces", "surfaces.paths=[a.obj]", "engine=serial", "own.seconds=10", "own.memory_mb=1024"]
    good = "tests.experiments.flatteners:unroll"
    methods = [good, *(f"{UNRULY}:{name}" for name in BROKEN), f"{UNRULY}:flatten"]
    assert main([*line, "out=alone", f"method=[{good}]"]) == 0
    assert main([*line, "out=beside", f"method=[{','.join(methods)}]"]) == 0
    rows, failures = rows_of(cylinder / "beside"), json.loads(Path("beside/run.json").read_text())["failures"]
    assert [name for _, name in rows if rows["flattened/a", name] == {"failed": 1.0}] == sorted(
        f"{UNRULY}:{name}" for name in BROKEN
    )
    reasons = {failure["method"].rpartition(":")[2]: failure["reason"] for failure in failures}
    assert reasons.keys() == BROKEN.keys()
    for name, words in BROKEN.items():
        assert words in reasons[name]
        assert reasons[name].isprintable()
        assert len(reasons[name]) < 500
    assert rows["flattened/a", f"{UNRULY}:flatten"]["flat_rigid_mean_mm"] > 0.1

    def lines_of(out: str) -> list[str]:
        return [text for text in Path(out, "results.csv").read_text().splitlines() if f",{UNRULY}:" not in text]

    assert lines_of("beside") == lines_of("alone")


@pytest.mark.parametrize(
    ("experiment", "name", "words"),
    [
        ("surfaces", "restore", f"be a flattener in the experiment surfaces, got {UNRULY}:restore, a restorer."),
        ("stiffness", "dewarp", f"be a flattener in the experiment stiffness, got {UNRULY}:dewarp, a dewarper."),
        ("textures", "restore", "be a flattener in the experiment textures"),
        ("real_boards", "dewarp", "be a flattener or restorer in the experiment real_boards"),
        ("speed", "flatten", "be built-in ones"),
        ("attribution", "flatten", "be [paper_euler or paper_rk4, spring], the two ends"),
        ("sensitivity", "flatten", "be some of spring, paper_euler, paper_rk4"),
        ("corner_distance", "no_such_function", f"name a function in {UNRULY}"),
    ],
)
def test_a_kind_that_an_experiment_cannot_use_is_refused_in_one_line_before_the_work(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], experiment: str, name: str, words: str
) -> None:
    assert main([f"experiment={experiment}", f"method={UNRULY}:{name}", f"out={tmp_path / 'out'}"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("`method` must ")
    assert words in line
    assert not (tmp_path / "out").exists()


def test_a_method_is_never_imported_beside_the_truth(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "ends_its_process.py").write_text("import os\nos._exit(7)\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    assert main(["experiment=corner_distance", "method=ends_its_process:f", f"out={tmp_path / 'out'}"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "`ends_its_process:f` ended with exit code 7 and without a result" in line


def test_a_changed_method_is_another_row(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "changing"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "methods.py").write_text("def f(sheet): ...\n")
    (tmp_path / "alone.py").write_text("def f(sheet): ...\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    config = Config("surfaces", trials=1, method=["changing.methods:f", "alone:f", "spring"])
    before = about_own(config)["own_methods"]
    assert before["alone:f"]["function"] == "alone:f"
    assert about_own(config)["own_methods"] == before
    (package / "other.py").write_text("x = 1\n")
    after = about_own(config)["own_methods"]
    assert after["changing.methods:f"] != before["changing.methods:f"]
    assert after["alone:f"] == before["alone:f"]
    assert about_own(Config("surfaces", trials=1, method="spring")) == {}
    assert not {"changing", "alone"} & sys.modules.keys()


def test_a_method_that_cannot_be_imported_any_more_is_called_all_the_same() -> None:
    # Its own rows will say what is wrong; a trial's other methods must not be lost with it.
    config = Config("corner_distance", trials=1, method=["spring", "gone.away:f"], own=OwnSettings(20.0, 512))
    assert kind_of(config, "gone.away:f") == "flattener"
    assert list(methods_by_recipe(config).values()) == [["spring", "gone.away:f"]]


def test_a_picture_alone_needs_no_scan() -> None:
    config = Config("corner_distance", trials=1, method=[f"{UNRULY}:dewarp"])
    assert methods_by_recipe(config) == {}


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The worked example, copied out of the repository and installed as its reader would."""
    folder = tmp_path_factory.mktemp("elsewhere")
    shutil.copytree(EXAMPLE, folder / "source")
    options = "--quiet --no-deps --no-build-isolation --no-index --no-compile --disable-pip-version-check --target"
    command = [sys.executable, "-m", "pip", "install", *options.split(), str(folder / "site"), str(folder / "source")]
    subprocess.run(command, check=True, cwd=folder)
    return folder / "site"


def test_the_worked_example_runs_from_outside_the_repository(installed: Path, tmp_path: Path) -> None:
    # By the names of the installed entry points, beside methods whose figures are known without it.
    own = [f"{UNRULY}:{name}" for name in ("restore", "dewarp", "restore_elsewhere", "mirror", "dewarp_nothing")]
    small = "trials=1 engine=serial rig.board_poses=3 mesh.rows=15 mesh.columns=15 scan.denoise=false seed=4713"
    command = [sys.executable, "-m", "experiments", "experiment=corner_distance", *small.split(), f"out={tmp_path}"]
    command.append(f"method=[unroll,lay_out,rectify,{','.join(own)}]")
    subprocess.run(command, check=True, cwd=ROOT, env=os.environ | {"PYTHONPATH": str(installed)})
    rows = rows_of(tmp_path)
    unrestored = rows["unrestored", "-"]
    for name in ("unroll", "lay_out"):
        found = rows["restored", name]
        assert 0.0 < found["corner_mean_px"] < unrestored["corner_mean_px"]
        assert 0.0 < found["dense_mean_mm"] < unrestored["corner_rigid_mean_mm"]
        assert (found["corners_missing"], found["corners_expected"]) == (0.0, 300.0)
        assert found["page_coverage"] > 0.95
    rectified = rows["restored", "rectify"]
    assert not [name for name in rectified if "rigid" in name or "dense" in name]
    assert 0.0 < rectified["corner_mean_mm"] < rectified["corner_similar_mean_mm"] < unrestored["corner_rigid_mean_mm"]
    # A restorer that does nothing is the unrestored page; a picture that does nothing but grow is it but for the lens.
    as_it_lay, doubled = (rows["restored", name] for name in own[:2])
    for name in ("corner_mean_px", "corner_max_mm", "corner_rigid_mean_mm", "corners_missing"):
        assert as_it_lay[name] == pytest.approx(unrestored[name], abs=1e-4)
    assert doubled["corner_mean_px"] == pytest.approx(unrestored["corner_mean_px"], abs=0.05)
    assert doubled["corner_similar_mean_mm"] == pytest.approx(unrestored["corner_rigid_mean_mm"], rel=0.1)
    assert [rows["restored", name] for name in own[2:]] == [{"failed": 1.0}] * 3
    run = json.loads((tmp_path / "run.json").read_text())
    assert run["own_methods"]["unroll"]["function"] == "own_method.flattener:unroll"
    reasons = {failure["method"]: failure["reason"] for failure in run["failures"]}
    assert "`restoration.view_camera(scan.camera)`" in reasons[own[2]]
    assert "mirrored" in reasons[own[3]]
    assert "got (0, 640)" in reasons[own[4]]


def test_what_the_document_shows_are_the_files_of_the_example() -> None:
    text = (ROOT / "docs" / "own-method.md").read_text()
    shown = dict(re.findall(r"^`([\w./]+)`:\n\n```\w+\n(.*?)```$", text, re.MULTILINE | re.DOTALL))
    files = [EXAMPLE / "pyproject.toml", *(EXAMPLE / "own_method").glob("*er.py")]
    assert shown == {str(path.relative_to(EXAMPLE)): path.read_text() for path in files}
    named = set(re.findall(r"experiment=(\w+)", text))
    named |= {
        name for row in re.findall(r"^\| (`\w+`.*?) \| (?:yes|no)", text, re.M) for name in re.findall(r"\w+", row)
    }
    assert {"corner_distance", "ocr_misses", "surfaces", "speed", "integrators"} < named <= set(STUDIES)

"""The command: what it judges, what it writes, and how it ends."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from shutil import copytree
from xml.etree import ElementTree

import pytest
from hydra.core.config_store import ConfigStore

from experiments.gate import command
from experiments.gate.command import main
from experiments.studies import STUDIES
from experiments.trials import plan
from tests.gate.gated_study import STATE

BASELINE = "own.csv"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder with a baseline and its floors."""
    STUDIES["gated"] = "tests.gate.gated_study:GatedStudy"
    ConfigStore.instance().store("gated", {"experiment": "gated"}, group="experiment", package="_global_")
    with pytest.MonkeyPatch.context() as patch:
        # Not the project's own sources: somebody may be editing them.
        patch.setattr(plan, "SOURCES", ("tests/gate/gated_study.py",))
        patch.delenv("GITHUB_STEP_SUMMARY", raising=False)
        patch.chdir(tmp_path_factory.mktemp("baseline"))
        assert gate("record", "experiment=gated trials=4 seed=3 method=spring engine=serial") == 0
        for task in ("redraw", "derive"):
            assert gate(task, "--draws", "11-16", "--table", "redrawn.csv.gz") == 0
        yield Path.cwd()
    STUDIES.pop("gated")


@pytest.fixture
def here(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of that folder, which is the working one."""
    folder = tmp_path / "here"
    copytree(made, folder)
    monkeypatch.chdir(folder)
    return folder


def gate(*arguments: str) -> int:
    task = [name for name in arguments[:1] if name in ("record", "redraw", "derive")]
    return main([*task, "--baseline", BASELINE, *arguments[len(task) :]])


def present(monkeypatch: pytest.MonkeyPatch, **state: float) -> None:
    for name, value in state.items():
        monkeypatch.setitem(STATE, name, value)


def test_the_code_that_made_a_baseline_holds_it(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert gate("--junit", "gate.xml") == 0
    out = capsys.readouterr().out
    assert out.startswith("# Gate `own`: holds\n")
    assert "2 figures judged" in out
    suites = ElementTree.parse(here / "gate.xml").getroot()
    assert (suites.get("tests"), suites.get("failures")) == ("2", "0")
    assert sorted(path.name for path in here.iterdir()) == [
        "gate.xml",
        "own.csv",
        "own.floors.csv",
        "own.json",
        "redrawn.csv.gz",
    ]


def test_a_regression_is_named_in_every_report(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    present(monkeypatch, worse_px=0.05)
    summary = here / "summary.md"
    summary.write_text("before\n")
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(summary))
    assert gate("--junit", "gate.xml") == 1
    out = capsys.readouterr().out
    assert "REGRESSION in 1 of 2 figures" in out
    assert "| gated restored `corner_mean_px` | spring | 4 | 0.11" in out
    assert summary.read_text().startswith("before\n# Gate `own`: REGRESSION")
    (failure,) = ElementTree.parse(here / "gate.xml").getroot().iter("failure")
    assert failure.get("type") == "worse"
    assert "worse by: 0.05" in str(failure.get("message"))


def test_an_improvement_passes_and_says_so(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    present(monkeypatch, worse_px=-0.05)
    assert gate() == 0
    out = capsys.readouterr().out
    assert "holds; better in 1 of 2 figures" in out
    assert "Better than the baseline" in out


def test_redrawn_noise_holds_and_a_lost_corner_a_page_does_not(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert gate("rig.noise_draw=99") == 0
    present(monkeypatch, lost=1.0)
    assert gate() == 1


def test_a_method_stands_in_the_place_of_the_baselines(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert gate("--method", "own.module:flatten") == 0
    assert "`own.module:flatten` stands in the place of the baseline's method" in capsys.readouterr().out
    assert gate("--method", "breaks", "--junit", "gate.xml") == 1
    out = capsys.readouterr().out
    assert "REGRESSION in 3 of 3 figures" in out
    assert "- The sheet tore." in out
    found = [f.get("type") for f in ElementTree.parse(here / "gate.xml").getroot().iter("failure")]
    assert found == ["failed", "missing", "missing"]


def test_where_nothing_succeeds_every_row_is_missing(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert gate("--method", "broken_calibration") == 1
    said = capsys.readouterr()
    assert "Calibration found no board" in said.err
    assert "2 missing" in said.out


def test_stored_results_are_judged_without_a_run(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    present(monkeypatch, worse_px=0.05)
    assert gate("--out", "kept") == 1
    present(monkeypatch, worse_px=0.0)
    assert gate("--results", "kept/run_0/results.csv") == 1
    # Without the run.json beside it the rows alone are judged.
    rows = Path("kept/run_0/results.csv").read_text()
    Path("bare.csv").write_text(rows)
    assert gate("--results", "bare.csv") == 1
    capsys.readouterr()
    assert gate("--out", "kept") == 2
    assert capsys.readouterr().err == "`--out` must be a new folder, got kept, which is there.\n"


def test_what_cannot_be_judged_ends_with_one_line_and_2(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    about = json.loads(Path("own.json").read_text())
    floors = Path("own.floors.csv").read_text()

    def refused(*arguments: str) -> str:
        capsys.readouterr()
        assert gate(*arguments) == 2
        said = capsys.readouterr()
        assert said.out == ""
        (line,) = [line for line in said.err.splitlines() if "%|" not in line and "run now" not in line]
        return line

    assert "`rig.gamma` must be 2.2 as in the baseline, or a new baseline be recorded, got 3.0." in refused(
        "rig.gamma=3"
    )
    assert "`rig.gamma` must lie in [0.5, 4]" in refused("rig.gamma=9")
    assert "must be as --help says" in refused("--nonsense")
    assert "`--draws` must be FIRST-LAST" in refused("redraw", "--draws", "9-3", "--table", "t.gz")
    assert "`t.gz` must be a table of redraws" in refused("derive", "--draws", "3-9", "--table", "t.gz")
    Path("own.floors.csv").write_text(floors.replace("corners_missing", "corners_gone"))
    assert "`the floor of gated restored spring corners_missing` must be derived" in refused()
    Path("own.floors.csv").write_text("these are my notes\n1\n")
    assert "`own.floors.csv` must hold the floors of a baseline" in refused()
    Path("own.json").write_text(json.dumps(about | {"version": 2}))
    assert "`own.json` must be of version 1, got version 2." in refused()
    Path("own.json").write_text("{")
    assert "`own.json` must say what produced the baseline" in refused()
    Path("own.csv").write_text("these are my notes\n")
    assert "`own.csv` must be a results.csv with the columns experiment,condition" in refused()
    Path("own.csv").unlink()
    assert "`own.csv` must be a results.csv" in refused()


def test_a_fault_of_the_gate_itself_is_no_regression(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(*arguments: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(command, "judge", broken)
    assert gate("--results", "own.csv") == 2
    assert "ZeroDivisionError" in capsys.readouterr().err


def test_other_pages_are_not_judged(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    present(monkeypatch, bend_deg=21.0)
    capsys.readouterr()
    assert gate() == 2
    assert "these are other pages" in capsys.readouterr().err


def test_a_baseline_holds_no_failures(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = Path("own.csv").read_bytes()
    assert gate("record", "experiment=gated trials=4 method=breaks engine=serial") == 2
    assert "`the baseline` must hold no failed trial" in capsys.readouterr().err
    assert Path("own.csv").read_bytes() == before


def test_recording_again_takes_the_old_floors_away(here: Path) -> None:
    before = Path("own.csv").read_bytes()
    assert gate("record") == 0
    assert Path("own.csv").read_bytes() == before
    assert not Path("own.floors.csv").exists()

"""The program from its command line: what it accepts, what it refuses and how, what it leaves behind."""

from __future__ import annotations

import argparse
import json
import os
import pickle
import runpy
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import NoReturn
from unittest import mock

import pytest

from experiments.complaints import refuse_arguments
from experiments.program import main
from experiments.reporting import export
from experiments.studies import STUDIES
from tests.experiments.conftest import Program
from tests.experiments.fake_study import ABSENT, ALL_FAIL, NAN, STEP_FAILS, TRIAL_1_FAILS, FakeStudy

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize(
    ("override", "names"),
    [
        ("trials=0", ("`trials`", "[1, 100000]", "got 0")),
        ("trials=many", ("`trials`", "[1, 100000]", "'many'")),
        ("seed=-1", ("`seed`", "[0, 4294967295]", "-1")),
        ("sheet.slope_p90_deg=95", ("`sheet.slope_p90_deg`", "[1, 45] degrees", "95.0")),
        ("sheet.slope_p90_deg=nan", ("`sheet.slope_p90_deg`", "[1, 45]", "nan")),
        ("sheet.slope_p90_deg=steep", ("`sheet.slope_p90_deg`", "[1, 45] degrees", "'steep'")),
        ("sheet.kind=silk", ("`sheet.kind`", "mirror", "'silk'")),
        ("sheet.drawn=maybe", ("`sheet.drawn`", "true or false", "maybe")),
        ("sheet.paths=[a.png]", ("`sheet.paths`", "NPZ", "a.png")),
        ("rig.noise_scale=-0.5", ("`rig.noise_scale`", "[0, 10]", "-0.5")),
        ("rig.colour=red", ("`rig.colour`", "noise_scale")),
        ("rig.stripe_width_px=2", ("`rig.stripe_width_px`", "odd whole number in [1, 15]", "2")),
        ("rig.baseline_mm=50", ("`rig.baseline_mm`", "[100, 700] mm", "50")),
        ("rig.camera_blur_px=nan", ("`rig.camera_blur_px`", "[0.3, 3]", "nan")),
        ("ablations.gamma=[1,9]", ("`ablations.gamma`", "each lie in [0.5, 4]", "[1.0, 9.0]")),
        ("ablations.ambient=[0.1,0.1]", ("`ablations.ambient`", "different values", "[0.1, 0.1]")),
        ("ablations.stripe_width_px=[4]", ("`ablations.stripe_width_px`", "odd whole number", "[4]")),
        ("sensitivity.mesh=[3]", ("`sensitivity.mesh`", "different numbers in [4, 400]", "[3]")),
        ("sensitivity.focal_percent=[1,1]", ("`sensitivity.focal_percent`", "different", "[1.0, 1.0]")),
        ("rig.gamma=0", ("`rig.gamma`", "[0.5, 4]", "0")),
        ("rig.ambient=-0.1", ("`rig.ambient`", "[0, 1]", "-0.1")),
        ("scan.ink=some", ("`scan.ink`", "true, false or null", "got some")),
        ("mesh.rows=1", ("`mesh.rows`", "[2, 1000]", "1")),
        ("colour=red", ("`colour`", "one of ablations, budget, calibrations, culling, decoders, engine, experiment")),
        ("+x=1", ("`x`", "existing key", "+x=1")),
        ("++seed=3", ("`seed`", "++seed=3")),
        ("~seed", ("`seed`", "~seed")),
        ("method=3", ("`method`", "list of different names", "3")),
        ("method=[a,a]", ("`method`", "different", "['a', 'a']")),
        ("method=[]", ("`method`", "[]")),
        ("budget=huge", ("`budget`", "full, paper, smoke", "'huge'")),
        ("engine=dask", ("`engine`", "processes, ray, serial, slurm", "'dask'")),
        ("engine.workers=0", ("`engine.workers`", "[1, 256]", "0")),
        ("engine.address=head", ("`engine.address`", "HOST:PORT of a Ray cluster", "'head'")),
        ("engine.address='ray://head:10001'", ("`engine.address`", "HOST:PORT of a Ray cluster", "ray://head:10001")),
        ("engine.cluster=lsf", ("`engine.cluster`", "slurm, local", "'lsf'")),
        ("engine.partition=' '", ("`engine.partition`", "be a name, or null", "' '")),
        ("engine.minutes=0", ("`engine.minutes`", "[1, 100000]", "0")),
        ("engine.folder=''", ("`engine.folder`", "name of a folder", "''")),
        (
            "experiment=colours",
            ("`experiment`", ", ".join(sorted([*STUDIES, "fake"])), "'colours'"),
        ),
        ("trials=[1", ("`trials=[1`", "KEY=VALUE")),
        ("trials", ("`trials`", "KEY=VALUE")),
        ("--nonsense", ("--nonsense", "KEY=VALUE")),
        ("out=/dev/null/x", ("`out`", "/dev/null/x")),
        (f"out=new/{'y' * 300}", ("`out`", "yyy", "too long")),
        ("experiment=null", ("`experiment`", "ablations, attribution, corner_distance, culling", "got null")),
        ("experiment=1", ("`experiment`", "got 1")),
        ("experiment=[fake,fake]", ("`experiment`", "got [fake,fake]")),
        ("engine=null", ("`engine`", "processes, ray, serial, slurm", "got null")),
        ("sheet=[]", ("`sheet`", "mirror", "got []")),
        ("budget=[smoke,paper]", ("`budget`", "full, paper, smoke", "got [smoke,paper]")),
        ("hydra=null", ("Hydra", "NoneType")),
        ("hydra.run.dir=/proc/x", ("`/proc/x`", "path", "No such file")),
        ("hydra.nope=1", ("`hydra.nope`", "known key, got")),
        ("--resolve", ("Hydra", "--cfg")),
        ("--shell-completion", ("Hydra", "install")),
        ("seed=null", ("`seed`", "[0, 4294967295], got null.")),
        ("seed=${nope}", ("`seed`", "[0, 4294967295], got ${nope}.")),
        ("trials=???", ("`trials`", "[1, 100000], got ???.")),
        ("mesh=5", ("`mesh`", "columns, rows", "got 5.")),
        ("mesh=null", ("`mesh`", "columns, rows", "got null.")),
        ("method={a:1}", ("`method`", "list of different names, got {a:1}.")),
        ("sheet.paths=x.npz", ("`sheet.paths`", "list of NPZ files, one a trial, got x.npz.")),
        (f"engine.name={'x' * 5000}", ("`engine.name`", "processes, ray, serial, slurm", "x ... x")),
    ],
)
def test_wrong_input_is_one_line_and_code_2(
    program: Program, out: Path, capsys: pytest.CaptureFixture[str], override: str, names: tuple[str, ...]
) -> None:
    assert program(override) == 2
    written = capsys.readouterr()
    assert written.out == ""
    assert len(written.err.splitlines()) == 1
    for name in names:
        assert name in written.err
    assert len(written.err) < 450
    # Hydra's and OmegaConf's own words are about their insides.
    assert "full_key" not in written.err
    assert [path.name for path in out.parent.iterdir()] == ["log"]


@pytest.mark.parametrize(
    ("overrides", "names"),
    [
        (["seed=range(0,3,0)"], ("`seed`", "values to sweep over", "range(0,3,0)", "zero")),
        (["seed=range(3,3)"], ("`seed`", "values to sweep over", "range(3,3)")),
        (["seed=glob(*)"], ("`seed`", "values to sweep over", "glob(*)")),
        (["engine=glob(dask*)"], ("`engine`", "match one of processes, ray, serial, slurm", "glob(dask*)")),
        (["out=log", "seed=1,2"], ("`log`", "path", "exists")),
        (["--run"], ("Only one of --run, --multirun",)),
    ],
)
def test_a_multirun_that_cannot_start_is_one_line_and_code_2(
    program: Program, out: Path, capsys: pytest.CaptureFixture[str], overrides: list[str], names: tuple[str, ...]
) -> None:
    assert program("--multirun", *overrides) == 2
    written = capsys.readouterr()
    assert written.out == ""
    (line,) = written.err.splitlines()
    assert all(name in line for name in names)
    assert not out.exists()


def test_a_long_range_is_not_written_out_to_be_checked() -> None:
    line = ["experiment=fake", "seed=range(0,1000000000000)"]
    refuse_arguments(argparse.Namespace(experimental_rerun=None, overrides=line), ROOT / "conf")


def test_a_rerun_from_a_pickle_is_refused_unread(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "config.pickle"
    path.write_bytes(pickle.dumps(Path.touch)[:-1])
    assert main(["--experimental-rerun", str(path)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("`--experimental-rerun` must be left out")


@pytest.mark.parametrize(
    ("error", "says"),
    [(OSError(28, "No space left on device", "/tmp/x"), "No space left"), (MemoryError(), "not enough memory")],
)
def test_what_the_system_refuses_a_job_is_one_line_and_code_3(
    program: Program,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    error: Exception,
    says: str,
) -> None:
    monkeypatch.setattr(FakeStudy, "prepare", mock.Mock(side_effect=error))
    assert program() == 3
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("fake: the system refused: ")
    assert says in line


def test_a_fault_of_the_program_itself_is_not_taken_for_wrong_input(
    program: Program, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(FakeStudy, "prepare", mock.Mock(side_effect=ValueError("a fault")))
    with pytest.raises(ValueError, match="a fault"):
        program()


def test_ctrl_c_during_the_imports_is_one_line_and_code_130(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    class Interrupted(ModuleType):
        def __getattr__(self, name: str) -> NoReturn:
            raise KeyboardInterrupt

    monkeypatch.setitem(sys.modules, "experiments.program", Interrupted("experiments.program"))
    with pytest.raises(SystemExit) as ended:
        runpy.run_module("experiments", run_name="__main__")
    assert ended.value.code == 130
    assert capsys.readouterr().err == "Interrupted before anything was done.\n"


@pytest.mark.parametrize(
    ("name", "kind"), [("figures", "file"), ("table.md", "folder"), ("figures/corners.png", "folder")]
)
def test_a_report_that_could_not_be_written_is_refused_before_the_trials(
    program: Program, out: Path, log: Path, capsys: pytest.CaptureFixture[str], name: str, kind: str
) -> None:
    (out / name).parent.mkdir(parents=True, exist_ok=True)
    if kind == "file":
        (out / name).write_text("notes")
    else:
        (out / name).mkdir()
    assert program() == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"`{out / name}` must be" in line
    assert f"got a {kind}" in line
    assert log.read_text() == ""
    assert not (out / "results.sqlite").exists()


def test_a_report_that_breaks_while_it_is_written_leaves_the_old_one(
    program: Program, out: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert program("trials=1") == 0
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file() and path.suffix != ".sqlite"}
    write = Path.write_bytes

    def full(path: Path, data: bytes) -> int:
        if path.suffix == ".png":
            raise OSError(28, "No space left on device")
        return write(path, data)

    monkeypatch.setattr(Path, "write_bytes", full)
    assert program("trials=2") == 3
    assert "No space left on device" in capsys.readouterr().err
    after = {path: path.read_bytes() for path in out.rglob("*") if path.is_file() and path.suffix != ".sqlite"}
    assert after == before


def test_without_an_experiment_the_program_lists_them(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 2
    error = capsys.readouterr().err
    assert error.splitlines() == [f"`experiment` must be one of {', '.join(sorted(STUDIES))}, got nothing."]


def test_every_planned_study_has_a_configuration_and_every_configuration_its_study() -> None:
    from experiments.studies import STUDIES

    assert {path.stem for path in (ROOT / "conf/experiment").glob("*.yaml")} == set(STUDIES) - {"fake"}


def test_a_run_leaves_its_contracted_files_and_no_others(program: Program, out: Path) -> None:
    assert program() == 0
    found = {str(path.relative_to(out)) for path in out.rglob("*") if path.is_file()}
    pages = {f"figures/page_{trial}.png" for trial in range(4)}
    files = {"results.sqlite", "results.csv", "timings.csv", "table.md", "run.json", "figures/corners.png"}
    assert found == files | pages | ({"results.parquet"} if find_spec("pyarrow") else set())
    assert {path.name for path in out.parent.iterdir()} == {"log", "out"}


def test_without_pyarrow_no_parquet_of_other_rows_is_left(
    program: Program, out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out.mkdir()
    (out / "results.parquet").write_bytes(b"of an earlier run")
    monkeypatch.setattr(export, "find_spec", lambda name: None)
    assert program("trials=1") == 0
    assert not (out / "results.parquet").exists()


def test_results_are_tidy_sorted_and_hold_no_times(program: Program, out: Path) -> None:
    assert program("seed=7", "trials=2", "method=a") == 0
    lines = (out / "results.csv").read_text().splitlines()
    assert lines[0] == "experiment,condition,method,trial,seed,metric,value,unit"
    assert [line.split(",")[:6] for line in lines[1:]] == [
        ["fake", "control", "-", "0", "7", "corner_mean_px"],
        ["fake", "control", "-", "1", "7", "corner_mean_px"],
        ["fake", "restored", "a", "0", "7", "corner_mean_px"],
        ["fake", "restored", "a", "0", "7", "corners_missing"],
        ["fake", "restored", "a", "1", "7", "corner_mean_px"],
        ["fake", "restored", "a", "1", "7", "corners_missing"],
    ]
    assert [line.rsplit(",", 1)[1] for line in lines[3:5]] == ["px", "1"]
    metrics = {line.split(",")[5] for line in (out / "timings.csv").read_text().splitlines()[1:]}
    assert metrics == {"seconds_render", "seconds_prepare", "seconds_trial", "peak_mb"}


@pytest.mark.parametrize(("budget", "trials"), [("smoke", 2), ("paper", 4), ("full", 6)])
def test_budget_sets_the_trials(program: Program, log: Path, budget: str, trials: int) -> None:
    assert program(f"budget={budget}", "method=a") == 0
    assert log.read_text().splitlines() == ["prepare", *(f"trial {trial}" for trial in range(trials))]


def test_explicit_trials_override_the_budget(program: Program, log: Path) -> None:
    assert program("budget=full", "trials=1") == 0
    assert log.read_text().splitlines() == ["prepare", "trial 0"]


def test_smoke_never_writes_into_the_committed_reports(program: Program, capsys: pytest.CaptureFixture[str]) -> None:
    assert program("budget=smoke", f"out={ROOT / 'reports' / 'fake'}") == 2
    assert "reports/" in capsys.readouterr().err
    assert not (ROOT / "reports" / "fake").exists()


def test_absent_data_is_said_and_leaves_the_committed_report(
    program: Program, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out.mkdir()
    (out / "table.md").write_text("committed")
    assert program(f"sheet.slope_p90_deg={ABSENT}") == 0
    assert "fake: absent: no data" in capsys.readouterr().out
    assert [(path.name, path.read_text()) for path in out.iterdir()] == [("table.md", "committed")]


def test_failing_preparation_is_one_line_and_code_3_and_leaves_nothing(
    program: Program, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert program(f"sheet.slope_p90_deg={STEP_FAILS}") == 3
    assert capsys.readouterr().err.splitlines() == ["Calibration found no board."]
    assert not out.exists()


def test_failed_trial_is_a_row_with_its_reason_and_stops_no_other(program: Program, out: Path, log: Path) -> None:
    assert program(f"sheet.slope_p90_deg={TRIAL_1_FAILS}") == 0
    assert log.read_text().splitlines() == ["prepare", "trial 0", "trial 2", "trial 3"]
    assert "fake,-,-,1,1,failed,1.0,1" in (out / "results.csv").read_text().splitlines()
    (failure,) = json.loads((out / "run.json").read_text())["failures"]
    assert failure["trial"] == 1
    assert failure["reason"].startswith("ValueError: sheet | is steep (fake_study.py:")
    table = (out / "table.md").read_text()
    assert "| 1 | 1 | - | - | ValueError: sheet / is steep" in table


def test_nan_is_a_failure_of_its_method_alone(program: Program, out: Path) -> None:
    assert program(f"sheet.slope_p90_deg={NAN}", "trials=1", "method=a") == 0
    rows = [line.split(",")[1:7] for line in (out / "results.csv").read_text().splitlines()[1:]]
    assert rows[0][:3] == ["control", "-", "0"]
    assert rows[1:] == [["restored", "a", "0", "1", "failed", "1.0"]]
    (failure,) = json.loads((out / "run.json").read_text())["failures"]
    assert failure["reason"] == "`corner_mean_px` must be finite, got nan."


def test_when_every_trial_fails_the_run_fails_and_the_old_report_stands(
    program: Program, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out.mkdir()
    (out / "results.csv").write_text("old")
    assert program(f"sheet.slope_p90_deg={ALL_FAIL}", "method=a") == 3
    assert len(capsys.readouterr().err.splitlines()) == 1
    assert (out / "results.csv").read_text() == "old"


def test_multirun_gives_every_job_its_own_folder_and_the_worst_code(program: Program, out: Path) -> None:
    assert program("--multirun", "seed=1,2", "trials=1") == 0
    for number, seed in ((0, "1"), (1, "2")):
        assert (out / str(number) / "results.csv").read_text().splitlines()[1].split(",")[4] == seed
    assert program("--multirun", "trials=1,0") == 2


def test_run_json_says_what_produced_the_numbers_and_names_no_folder(program: Program, out: Path) -> None:
    assert program("trials=1") == 0
    text = (out / "run.json").read_text()
    run = json.loads(text)
    assert set(run) == {
        "changed_since_commit", "commit", "commit_date", "config", "config_hash", "experiment", "failures", "machine",
        "versions",
    }  # fmt: skip
    assert run["config"]["sheet"]["slope_p90_deg"] == 20.0
    assert len(run["config_hash"]) == 64
    assert run["versions"]["python"] == sys.version.split()[0]
    assert str(out) not in text
    assert os.uname().nodename not in text


def test_module_ends_with_the_programs_code_and_without_traceback() -> None:
    command = [sys.executable, "-m", "experiments", "experiment=corner_distance", "trials=0"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "`trials` must be a whole number in [1, 100000], got 0.\n"

"""What a rerun does: only what is missing, never mixed, the same bytes by any engine."""

from __future__ import annotations

import os
import signal
import sqlite3
from functools import partial
from pathlib import Path

import pytest

from experiments.settings import Config
from experiments.trials import TrialKey
from experiments.trials.engines.processes import _answer, _Worker
from tests.experiments.conftest import Program
from tests.experiments.fake_study import KILLED_ONCE, TRIAL_1_KILLS, FakeStudy


def lines_of(log: Path) -> list[str]:
    return log.read_text().splitlines()


def test_rerun_of_a_finished_run_does_nothing_and_repeats_every_byte(program: Program, out: Path, log: Path) -> None:
    names = ("results.csv", "timings.csv", "table.md", "run.json", "figures/corners.png", "figures/page_2.png")
    assert program() == 0
    first = {name: (out / name).read_bytes() for name in names}
    log.write_text("")
    assert program() == 0
    assert lines_of(log) == []
    assert {name: (out / name).read_bytes() for name in names} == first


def test_more_trials_run_only_the_new_ones(program: Program, out: Path, log: Path) -> None:
    assert program("trials=3") == 0
    log.write_text("")
    assert program("trials=5") == 0
    assert lines_of(log) == ["prepare", "trial 3", "trial 4"]
    extended = (out / "results.csv").read_bytes()
    (out / "results.sqlite").unlink()
    assert program("trials=5") == 0
    assert (out / "results.csv").read_bytes() == extended


def test_fewer_trials_report_only_those_planned(program: Program, out: Path, log: Path) -> None:
    assert program("trials=3") == 0
    assert program("trials=2") == 0
    assert {line.split(",")[3] for line in (out / "results.csv").read_text().splitlines()[1:]} == {"0", "1"}


@pytest.mark.parametrize(
    "change", ["sheet.slope_p90_deg=21", "method=[a]", "rig.noise_scale=2", "mesh.rows=30", "scan.ink=true"]
)
def test_changed_settings_never_mix_with_old_rows(program: Program, out: Path, log: Path, change: str) -> None:
    assert program("trials=2") == 0
    before = (out / "results.csv").read_bytes()
    log.write_text("")
    assert program("trials=1", change) == 0
    assert lines_of(log) == ["prepare", "trial 0"]
    assert {line.split(",")[3] for line in (out / "results.csv").read_text().splitlines()[1:]} == {"0"}
    log.write_text("")
    assert program("trials=2") == 0
    assert lines_of(log) == []
    assert (out / "results.csv").read_bytes() == before


def test_engine_and_budget_are_no_part_of_what_a_row_is(program: Program, log: Path) -> None:
    assert program("trials=2") == 0
    log.write_text("")
    assert program("trials=2", "budget=full", "engine=processes", "engine.workers=1") == 0
    assert lines_of(log) == []


def test_serial_and_processes_give_the_same_bytes(program: Program, out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert program() == 0
    serial = (out / "results.csv").read_bytes()
    (out / "results.sqlite").unlink()
    # The driver's own setting must not reach the numbers.
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    assert program("engine=processes", "engine.workers=2") == 0
    assert (out / "results.csv").read_bytes() == serial
    assert os.environ["OMP_NUM_THREADS"] == "2"


def test_killed_worker_costs_one_trial_which_the_next_run_tries_again(program: Program, out: Path, log: Path) -> None:
    trouble = (f"sheet.slope_p90_deg={TRIAL_1_KILLS}", "engine=processes", "engine.workers=2")
    assert program(*trouble) == 0
    table = (out / "table.md").read_text()
    assert "| 1 | 1 | - | - | The worker process died" in table
    rows = (out / "results.csv").read_text().splitlines()[1:]
    assert [line for line in rows if ",failed," in line] == ["fake,-,-,1,1,failed,1.0,1"]
    assert {line.split(",")[3] for line in rows} == {"0", "1", "2", "3"}
    log.write_text("")
    assert program(*trouble) == 0
    assert lines_of(log) == ["prepare"]


def test_ctrl_c_reaches_no_worker_even_while_it_imports() -> None:
    config = Config(experiment="fake", trials=1, method="a")
    worker = _Worker.start(partial(FakeStudy().run, config))
    try:
        # It takes a second to import: this comes first.
        os.kill(worker.process.pid or 0, signal.SIGINT)
        worker.share(0.25)
        worker.take(TrialKey("fake"))
        _, outcome = _answer(worker)
    finally:
        worker.stop(at_once=False)
    assert outcome is not None
    assert worker.process.exitcode == 0
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())


def test_worker_killed_from_outside_loses_no_row(program: Program, out: Path, log: Path) -> None:
    trouble = f"sheet.slope_p90_deg={KILLED_ONCE}"
    assert program(trouble, "engine=processes", "engine.workers=2") == 0
    assert (log.parent / "killed").exists()
    survived = (out / "results.csv").read_bytes()
    assert b"failed" not in survived
    (out / "results.sqlite").unlink()
    assert program(trouble) == 0
    assert (out / "results.csv").read_bytes() == survived


def test_two_runs_cannot_share_a_folder(program: Program, out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert program("trials=1") == 0
    other = sqlite3.connect(out / "results.sqlite")
    other.execute("BEGIN EXCLUSIVE")
    capsys.readouterr()
    assert program("trials=2") == 2
    assert "`out` must be a free, writable folder" in capsys.readouterr().err
    other.close()


def test_a_file_that_is_no_store_is_refused_and_left_alone(
    program: Program, out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out.mkdir()
    (out / "results.sqlite").write_text("these are my notes, and no database " * 50)
    assert program() == 2
    assert "`out` must hold a store of this program or none" in capsys.readouterr().err
    assert (out / "results.sqlite").read_text().startswith("these are my notes")

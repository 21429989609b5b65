"""200 trials survive what kills drivers and workers: every row once, the same bytes, nobody left behind."""

from __future__ import annotations

import os
import signal
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.experiments.driven import N_TRIALS, Run, kept, processes_of, until

SERIAL = ("engine=serial",)
PROCESSES = ("engine=processes", "engine.workers=2")
JOBS = ("engine=slurm", "engine.cluster=local", "engine.workers=2")
needs_submitit = pytest.mark.skipif(find_spec("submitit") is None, reason="submitit is not installed")


@pytest.mark.parametrize(
    "engine",
    [
        pytest.param(SERIAL, id="serial"),
        pytest.param(PROCESSES, id="processes"),
        pytest.param(JOBS, id="slurm", marks=needs_submitit),
    ],
)
def test_a_run_interrupted_and_then_killed_goes_on_from_there(
    engine: tuple[str, ...], out: Path, log: Path, undisturbed: bytes
) -> None:
    run = Run.start(out, log, *engine)
    run.until(50)
    code, line = run.interrupt()
    assert (code, line) == (130, "Interrupted; finished trials are kept, and the same command goes on from there.")
    until(lambda: not processes_of(run.process.pid))
    first = kept(out)

    run = Run.start(out, log, *engine)
    run.until(50)
    run.kill()
    until(lambda: not processes_of(run.process.pid))
    second, again = kept(out), run.trials()
    assert not (out / "results.csv").exists()

    run = Run.start(out, log, *engine)
    run.end()
    assert set(first) < set(second)
    assert not set(first) & set(again)
    assert not set(second) & set(run.trials())
    assert sorted(kept(out)) == list(range(N_TRIALS))
    assert (out / "results.csv").read_bytes() == undisturbed
    assert not list(out.glob("jobs-*"))


@pytest.mark.parametrize(
    ("engine", "worker"),
    [
        pytest.param(PROCESSES, "spawn_main", id="processes"),
        pytest.param(JOBS, "submitit.core._submit", id="slurm", marks=needs_submitit),
    ],
)
def test_a_killed_worker_loses_no_row(
    engine: tuple[str, ...], worker: str, out: Path, log: Path, undisturbed: bytes
) -> None:
    run = Run.start(out, log, *engine)
    run.until(40)
    os.kill(processes_of(run.process.pid, worker)[-1], signal.SIGKILL)
    run.end()
    assert sorted(kept(out)) == list(range(N_TRIALS))
    assert (out / "results.csv").read_bytes() == undisturbed

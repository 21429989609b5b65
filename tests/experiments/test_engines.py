"""Which engine the settings choose, and what is said where it cannot be had."""

from __future__ import annotations

import socket
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from experiments.settings import EngineSettings
from experiments.trials import Processes, Serial, chosen_engine
from tests.experiments.conftest import Program


def test_the_settings_choose() -> None:
    out = Path("out")
    assert chosen_engine(EngineSettings("serial"), out, "f") == Serial()
    assert chosen_engine(EngineSettings("processes", 3), out, "f") == Processes(3)


@pytest.mark.skipif(find_spec("submitit") is None, reason="submitit is not installed")
def test_jobs_of_another_run_have_another_folder(tmp_path: Path) -> None:
    settings = EngineSettings("slurm", folder=str(tmp_path))
    folders = {
        chosen_engine(settings, out, fingerprint).folder  # type: ignore[attr-defined]
        for out, fingerprint in ((tmp_path / "a", "f"), (tmp_path / "b", "f"), (tmp_path / "a", "g"))
    }
    assert len(folders) == 3
    assert {folder.parent for folder in folders} == {tmp_path}


@pytest.mark.parametrize(("name", "package"), [("ray", "ray"), ("slurm", "submitit")])
def test_a_missing_extra_is_one_line_that_names_it(
    program: Program, out: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
    name: str, package: str,
) -> None:  # fmt: skip
    monkeypatch.delitem(sys.modules, f"experiments.trials.engines.{name}", raising=False)
    monkeypatch.setitem(sys.modules, package, None)
    assert program(f"engine={name}") == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert (
        line == f"`engine` must be one that is installed, got {name} without {package}: pip install 'deskew3d[{name}]'."
    )
    assert not out.exists()


@pytest.mark.skipif(find_spec("ray") is None, reason="ray is not installed")
@pytest.mark.parametrize("listens", [False, True])
def test_an_address_without_a_cluster_is_refused_before_anything_is_done(
    program: Program,
    out: Path,
    log: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    listens: bool,
) -> None:
    from experiments.trials.engines import ray

    monkeypatch.setattr(ray, "_ANSWER_SECONDS", 3.0)
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        if listens:
            other.listen()
        address = f"127.0.0.1:{other.getsockname()[1]}"
        assert program("engine=ray", f"engine.address={address}") == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("`engine.address` must be HOST:PORT of a Ray cluster that runs, or null to start one here")
    assert f"got {address}" in line
    assert not out.exists()
    assert log.read_text() == ""


@pytest.mark.skipif(find_spec("submitit") is None, reason="submitit is not installed")
def test_without_slurm_jobs_are_refused_before_anything_is_done(
    program: Program,
    out: Path,
    log: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    assert program("engine=slurm") == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("`engine.cluster` must be local, or slurm where sbatch is")
    assert not out.exists()
    assert log.read_text() == ""

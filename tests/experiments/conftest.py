from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hydra.core.config_store import ConfigStore

from experiments.program import main
from experiments.studies import STUDIES
from experiments.trials import plan
from tests.experiments.driven import Run

SOURCES = ("tests/experiments/fake_study.py",)

Program = Callable[..., int]


@pytest.fixture
def log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """What the fake study did, a line each."""
    path = tmp_path / "log"
    path.touch()
    monkeypatch.setenv("FAKE_LOG", str(path))
    return path


@pytest.fixture
def out(tmp_path: Path) -> Path:
    return tmp_path / "out"


@pytest.fixture
def program(log: Path, out: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Program]:
    """The program with the fake study in it, writing under `out`."""
    register_fake()

    def run(*overrides: str) -> int:
        options = [override for override in overrides if override.startswith("--")]
        keys = [override for override in overrides if not override.startswith("--")]
        return main([*options, "experiment=fake", f"out={out}", "engine=serial", *keys])

    monkeypatch.chdir(log.parent)
    # Not the project's own sources: somebody may be editing them.
    monkeypatch.setattr(plan, "SOURCES", SOURCES)
    yield run
    STUDIES.pop("fake")


def register_fake() -> None:
    STUDIES["fake"] = "tests.experiments.fake_study:FakeStudy"
    node = {"experiment": "fake", "trials_at": {"smoke": 2, "paper": 4, "full": 6}}
    ConfigStore.instance().store("fake", node, group="experiment", package="_global_")


@pytest.fixture(scope="session")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """`results.csv` of 200 slow trials that nobody kills."""
    folder = tmp_path_factory.mktemp("undisturbed")
    Run.start(folder / "out", folder / "log", "engine=serial").end()
    return (folder / "out" / "results.csv").read_bytes()

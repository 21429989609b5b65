"""Every command and every piece of Python in the README and in docs/*.md is run, or listed here with the reason."""

from __future__ import annotations

import os
import shlex
import shutil
import tomllib
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

import data_synth.captures
from data_synth.captures import scaled
from data_synth.rig import default_rig
from deskew import cli
from experiments import program
from experiments.campaign import Finished
from experiments.settings import Config
from tests.docs.blocks import PAGES, ROOT, Block, blocks, commands, indented

EXAMPLE = ".venv/bin/python -m data_synth.captures out/example --pattern gray_code --pages 2 --lights"

FOLDERS = {"BOARD": "board", "PAGE": "page_00", "PLANE": "flat"}
"""What the pages call folders of the user's own: here those of the example."""

N_POSES = 5  # of the board's nine: calibration takes half of the time

NOT_RUN = {
    "make reproduce": "takes hours; CI's job `smoke` runs it with BUDGET=smoke",
    "make test": "is what runs this",
    "make setup": "made the environment that runs this, as the first step of CI",
    "make check": "is a step of CI by itself, `.ci/run`",
    ".venv/bin/python -m experiments.gate": "takes minutes; tests/gate/test_command.py runs it on small pages",
    ".venv/bin/deskew edit": "serves until it is ended; tests/editor/test_edit_command.py does that",
    ".venv/bin/deskew restore scan.npz --stiffness": "takes what was painted; tests/editor/test_desk.py paints it",
    ".venv/bin/pip install --no-deps ./docs/examples/own_method": "tests/experiments/test_own_methods.py installs it",
    ".venv/bin/ray start": "needs machines; tests/experiments/test_ray.py starts a cluster of two nodes",
}
"""Commands that do not run here, by how they begin, and why."""

LANGUAGES = {
    "sh": "run, but for those of NOT_RUN",
    "python": "run; of docs/own-method.md compared with the files that are tested",
    "toml": "parsed; the folders' own files are read by the commands",
    "text": "shown to be read",
}
"""What may stand in a page, and what becomes of it here."""


def every(language: str) -> list[Block]:
    return [block for page in PAGES for block in blocks(page) if block.language == language]


def reason_not_to_run(command: str) -> str | None:
    return next((why for start, why in NOT_RUN.items() if command.startswith(start)), None)


def files(pattern: str) -> list[str]:
    """What a shell makes of a pattern."""
    found = sorted(map(str, Path().glob(pattern)))
    assert found, pattern
    return found


def run(command: str) -> int:
    """Run a command in this process: starting one for each would take most of the time."""
    words = [word for part in shlex.split(command) for word in (files(part) if "*" in part else [part])]
    while "=" in words[0]:
        words = words[1:]  # a search path, for what is not imported here
    if words[0] == ".venv/bin/deskew":
        return cli.main(words[1:])
    assert words[:2] == [".venv/bin/python", "-m"], command
    if words[2] == "experiments":
        return program.main(words[3:])
    code = import_module(words[2]).main(words[3:])
    assert isinstance(code, int)
    return code


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A checkout as a user sees it. The rig has fewer pixels, and experiments are checked but not carried out."""

    def checked(config: Config, out: Path) -> Finished:
        return Finished(out, int(config.trials or 0), 0, 0)

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(program, "carry_out_campaign", checked)
    monkeypatch.setattr(data_synth.captures, "default_rig", lambda: scaled(default_rig(), 0.5))
    (tmp_path / "docs").symlink_to(ROOT / "docs")
    (tmp_path / "out").mkdir()
    for name, folder in FOLDERS.items():
        (tmp_path / name).symlink_to(tmp_path / "out/example" / folder)
    yield tmp_path
    plt.close("all")


def test_every_example_runs(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Page by page in the order of each; the folder of captures first, and a command that several pages show once."""
    assert run(EXAMPLE) == 0
    for pose in sorted((here / "out/example/board").glob("pose_*"))[N_POSES:]:
        shutil.rmtree(pose)
    done = {EXAMPLE}
    for page in PAGES:
        for block in blocks(page):
            for command in commands(block) if block.language == "sh" else ():
                if command not in done and reason_not_to_run(command) is None:
                    code = run(command)
                    assert code == 0, f"{block.place}: {command}: {capsys.readouterr().err}"
                    done.add(command)
            if block.language == "python" and page.name != "own-method.md":
                exec(compile(block.text, block.place, "exec"), {"__name__": "__main__"})
    assert (here / "restored.png").is_file()


def test_the_example_that_is_rendered_is_the_pages_own() -> None:
    places = [block.place for block in every("sh") if EXAMPLE in commands(block)]
    assert any(place.startswith("README.md") for place in places)


def test_no_code_hides_from_this_test() -> None:
    """Indented code has no language, and would be neither run nor listed."""
    assert {page.name: indented(page) for page in PAGES if indented(page)} == {}
    assert {block.place for page in PAGES for block in blocks(page) if block.language not in LANGUAGES} == set()


def test_every_reason_not_to_run_is_still_needed() -> None:
    found = [command for block in every("sh") for command in commands(block)]
    assert len(found) > 20
    unused = [start for start in NOT_RUN if not any(command.startswith(start) for command in found)]
    assert unused == []
    assert sum(reason_not_to_run(command) is not None for command in found) < len(found) / 2


def test_tables_of_settings_can_be_read() -> None:
    found = every("toml")
    assert len(found) >= 3
    for block in found:
        assert tomllib.loads(block.text), block.place


def test_the_code_of_own_methods_is_that_of_the_tested_files() -> None:
    page = (ROOT / "docs/own-method.md").read_text()
    files = [path for path in sorted((ROOT / "docs/examples/own_method").rglob("*.py")) if path.stat().st_size]
    assert len(files) >= 3
    for path in files:
        if path.name != "__init__.py":
            assert f"```python\n{path.read_text()}```" in page, path.name


def test_the_three_commands_from_a_clone_to_a_page_are_three() -> None:
    section = (ROOT / "README.md").read_text().partition("## Your own captures")[2]
    first = next(block for block in blocks(ROOT / "README.md") if block.text in section and block.language == "sh")
    found = list(commands(first))
    assert [command.split()[:2] for command in found] == [
        ["make", "setup"],
        [".venv/bin/deskew", "calibrate"],
        [".venv/bin/deskew", "run"],
    ]


def test_the_first_commands_shown_are_the_two_that_set_everything_up() -> None:
    first = next(iter(blocks(ROOT / "README.md")))
    assert list(commands(first)) == ["make reproduce", "make test"]
    assert os.access(ROOT / "Makefile", os.R_OK)

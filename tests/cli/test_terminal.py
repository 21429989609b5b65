"""What a terminal is shown: bars while something is done, and completion by the shell."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from deskew.cli.progress import showing_progress, watched, working
from deskew.types import Capture, PatternKind

FRAMES = [np.zeros((4, 5), np.uint8) for _ in range(6)]
CAPTURE = Capture(FRAMES[0], FRAMES[0], (6, 5), PatternKind.GRAY_CODE, FRAMES, FRAMES)


def show(quiet: bool) -> None:
    capture = showing_progress(CAPTURE, "page", quiet)
    assert len(list(capture.columns)) == len(capture.rows) == 6
    assert list(watched("abc", "captures", "page", quiet)) == ["a", "b", "c"]
    with working("flattening", quiet):
        pass


def test_a_terminal_sees_what_is_being_done(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    show(quiet=False)
    out, err = capsys.readouterr()
    assert out == ""
    assert all(words in err for words in ("page columns", "0/6", "captures", "0/3", "flattening ..."))
    show(quiet=True)
    assert capsys.readouterr() == ("", "")


def test_a_log_and_a_pipe_see_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    show(quiet=False)
    assert capsys.readouterr() == ("", "")


def complete(shell: str, **typed: str) -> list[str]:
    """Ask as the shell's own script does."""
    environment = {**os.environ, "_DESKEW_COMPLETE": f"complete_{shell}", **typed}
    line = [sys.executable, "-m", "deskew"]
    done = subprocess.run(line, capture_output=True, text=True, check=False, timeout=60, env=environment)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.splitlines()


def test_bash_zsh_and_fish_complete_commands_and_options() -> None:
    assert complete("bash", COMP_WORDS="deskew re", COMP_CWORD="1") == ["restore"]
    assert "--calibration" in complete("bash", COMP_WORDS="deskew run --ca", COMP_CWORD="2")
    assert any('"--light"' in line for line in complete("zsh", _TYPER_COMPLETE_ARGS="deskew run --li"))
    fish = {"_TYPER_COMPLETE_ARGS": "deskew acc", "_TYPER_COMPLETE_FISH_ACTION": "get-args"}
    assert any(line.startswith("accuracy") for line in complete("fish", **fish))


@pytest.mark.parametrize(
    ("shell", "script"),
    [("bash", "complete -o default -F"), ("zsh", "#compdef deskew"), ("fish", "complete --command deskew")],
)
def test_each_shell_is_shown_its_script(shell: str, script: str) -> None:
    line = [sys.executable, "-m", "deskew", "--show-completion"]
    environment = {**os.environ, "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"}
    done = subprocess.run(
        [*line, shell], capture_output=True, text=True, check=False, timeout=60, env=environment, cwd=Path.cwd()
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert script in done.stdout

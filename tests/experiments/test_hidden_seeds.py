"""Hidden seeds: what is published commits to them, and cannot be searched."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from experiments.hidden_seeds import N_OPEN, drawn, main


def test_what_was_drawn_agrees_with_what_was_published(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "seeds.txt"
    assert main(["draw", str(path), "3"]) == 0
    published = capsys.readouterr().out.strip()
    assert published == hashlib.sha256(path.read_bytes()).hexdigest()
    assert main(["check", str(path), published]) == 0
    path.write_text(path.read_text().replace("salt ", "salt 0", 1))
    assert main(["check", str(path), published]) == 1


def test_seeds_are_different_hidden_and_salted() -> None:
    salt, *seeds = drawn(500).splitlines()
    assert len(set(seeds)) == 500
    assert all(N_OPEN <= int(seed) < 2**32 for seed in seeds)
    assert len(bytes.fromhex(salt.removeprefix("salt "))) == 32
    assert drawn(1) != drawn(1)


def test_seeds_that_are_committed_to_are_not_drawn_again(tmp_path: Path) -> None:
    path = tmp_path / "seeds.txt"
    path.write_text("mine\n")
    assert main(["draw", str(path)]) == 2
    assert path.read_text() == "mine\n"


@pytest.mark.parametrize(
    "arguments",
    [[], ["draw"], ["draw", "x", "0"], ["draw", "x", "1001"], ["draw", "x", "-1"], ["check", "absent", "0" * 64],
     ["check", "absent", "12"], ["reveal", "x"]],
)  # fmt: skip
def test_wrong_input_is_one_line(
    arguments: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []

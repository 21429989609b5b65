"""A number that moves has its line in the changelog."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from experiments.reporting.moved import ROOT, digests, main, with_line, without_line

HEADING = "# Changelog\n\n## Unreleased\n\n### Numbers\n"


@pytest.fixture
def root(tmp_path: Path) -> Path:
    (tmp_path / "reports" / "planes").mkdir(parents=True)
    (tmp_path / "reports" / "planes" / "results.csv").write_text("a\n1\n")
    (tmp_path / "reports" / "baseline").mkdir()
    (tmp_path / "reports" / "baseline" / "smoke.csv").write_text("a\n2\n")
    (tmp_path / "CHANGELOG.md").write_text(HEADING)
    return tmp_path


def test_the_changelog_speaks_of_every_committed_table() -> None:
    # `make reproduce` rewrites the tables on somebody's machine, where they may differ in the last digit.
    command = ("git", "status", "--porcelain", "--", "reports")
    state = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    if state.returncode or state.stdout:
        pytest.skip("reports/ is not as it was committed")
    found = without_line((ROOT / "CHANGELOG.md").read_text(), digests(ROOT / "reports"))
    assert not found, 'run `python -m experiments.reporting.moved "why they moved"`'


def test_a_moved_table_is_named_until_its_line_is_there(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([], root) == 1
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == ["baseline/smoke", "planes"]
    assert main(["first run"], root) == 0
    assert main([], root) == 0
    (root / "reports" / "planes" / "results.csv").write_text("a\n1.0001\n")
    capsys.readouterr()
    assert main([], root) == 1
    assert capsys.readouterr().out.startswith("planes ")
    assert main(["The decoder's bias is gone"], root) == 0
    text = (root / "CHANGELOG.md").read_text()
    assert text.startswith(HEADING + "- The decoder's bias is gone: `planes` ")
    assert text.count("`planes` ") == 2
    assert text.count("`baseline/smoke` ") == 1


def test_a_line_without_a_reason_does_not_count(root: Path) -> None:
    digest = digests(root / "reports")["planes"]
    planes = f"`planes` {digest}."
    for line in (f"- {planes}", f"- : {planes}", f"- Why: `others` {digest}.", f"Why: {planes}"):
        assert "planes" in without_line(f"{HEADING}{line}\n", {"planes": digest})
    assert not without_line(f"{HEADING}- Why: `others` 0123456789,\n  `planes`\n  {digest}.\n", {"planes": digest})


def test_a_long_line_is_wrapped_and_read_again() -> None:
    tables = {f"experiment_{i}": f"{i:010x}" for i in range(30)}
    text = with_line(HEADING, tables, "A reason, " * 20 + "that is long")
    assert max(map(len, text.splitlines())) <= 120
    assert without_line(text, tables) == {}


def test_wrong_input_is_one_line(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["a", "b"], root) == 2
    assert main([" "], root) == 2
    (root / "CHANGELOG.md").write_text("# Changelog\n")
    assert main(["why"], root) == 2
    assert len(capsys.readouterr().err.splitlines()) == 3

"""The README says what the reports say."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from deskew.errors import InputError
from experiments.reporting.readme import with_tables

ROOT = Path(__file__).resolve().parents[2]


def test_a_block_takes_the_summary_of_its_report_and_nothing_else(tmp_path: Path) -> None:
    (tmp_path / "planes").mkdir()
    (tmp_path / "planes" / "table.md").write_text("# T\n\n## Summary\n\nMean.\n\n| a |\n\n## Each trial\n\n| b |\n")
    text = "before\n<!-- table planes -->\nold\n<!-- end -->\nafter\n"
    expected = "before\n<!-- table planes -->\nMean.\n\n| a |\n<!-- end -->\nafter\n"
    assert with_tables(text, tmp_path) == expected
    assert with_tables(expected, tmp_path) == expected


def test_a_report_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="got planes"):
        with_tables("<!-- table planes -->\n<!-- end -->", tmp_path)


def test_the_readme_holds_the_tables_of_the_committed_reports() -> None:
    text = (ROOT / "README.md").read_text()
    assert text.count("<!-- table ") >= 3
    assert with_tables(text, ROOT / "reports") == text


def test_every_file_that_the_readme_links_to_is_there() -> None:
    text = (ROOT / "README.md").read_text()
    links = [link for link in re.findall(r"\]\(([^)#]+)\)", text) if "://" not in link]
    assert len(links) > 3
    assert [link for link in links if not (ROOT / link).exists()] == []

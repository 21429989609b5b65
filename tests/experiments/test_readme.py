"""The README and the pages of results say what the reports say."""

from __future__ import annotations

from pathlib import Path

import pytest

from deskew.errors import InputError
from experiments.reporting.claims.measures import Evidence
from experiments.reporting.decisions import decisions_page
from experiments.reporting.headlines import HEADINGS, HEADLINES, Headline, with_results
from experiments.reporting.readme import with_tables

ROOT = Path(__file__).resolve().parents[2]

SUMMARY = """# T

## Summary

Mean.

| condition | n | mean [px] |
| --- | ---: | ---: |
| control | 3 | 0.1 |

| condition | method | n | mean [px] | max [px] | seconds, normalised |
| --- | ---: | ---: | ---: | ---: | ---: |
| control | - | 3 | 0.1 | – | 2 |
| restored | spring | 3 | 0.2 | 0.4 | 1 |

## Each trial

| b |
"""


@pytest.fixture
def reports(tmp_path: Path) -> Path:
    (tmp_path / "planes").mkdir()
    (tmp_path / "planes" / "table.md").write_text(SUMMARY)
    return tmp_path


def test_a_block_takes_the_summary_of_its_report_and_nothing_else(reports: Path) -> None:
    text = "before\n<!-- table planes -->\nold\n<!-- end -->\nafter\n"
    summary = SUMMARY.partition("## Summary\n\n")[2].partition("\n\n## Each")[0]
    expected = f"before\n<!-- table planes -->\n{summary}\n<!-- end -->\nafter\n"
    assert with_tables(text, reports) == expected
    assert with_tables(expected, reports) == expected


def test_a_block_takes_the_columns_that_it_names_of_the_first_table_that_has_them_all(reports: Path) -> None:
    text = "<!-- table planes: condition | method | max [px] | seconds, normalised -->\n<!-- end -->"
    expected = (
        "<!-- table planes: condition | method | max [px] | seconds, normalised -->\n"
        "| condition | method | max [px] | seconds, normalised |\n| --- | ---: | ---: | ---: |\n"
        "| control | - | – | 2 |\n| restored | spring | 0.4 | 1 |\n<!-- end -->"
    )
    assert with_tables(text, reports) == expected
    assert with_tables(expected, reports) == expected


def test_a_row_without_a_figure_in_the_named_columns_is_left_out(reports: Path) -> None:
    filled = with_tables("<!-- table planes: condition | method | n | max [px] -->\n<!-- end -->", reports)
    assert "| restored | spring | 3 | 0.4 |" in filled
    assert "control" not in filled


@pytest.mark.parametrize(
    ("marker", "message"),
    [("spheres", "got spheres"), ("planes: condition | depth", r"must have a table of the columns condition \| depth")],
)
def test_what_is_not_there_is_named(reports: Path, marker: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        with_tables(f"<!-- table {marker} -->\n<!-- end -->", reports)


def test_the_pages_hold_the_tables_of_the_committed_reports() -> None:
    """Not one figure of theirs is typed."""
    results = (ROOT / "docs/results.md").read_text()
    assert results.count("<!-- table ") >= 8
    assert with_tables(results, ROOT / "reports") == results
    readme = (ROOT / "README.md").read_text()
    assert readme.count("<!-- results -->") == 1
    assert with_results(readme, Evidence(ROOT / "reports")) == readme


def rows(**values: list[float]) -> str:
    lines = ["experiment,condition,method,trial,seed,metric,value,unit"]
    for key, found in values.items():
        condition, method, metric = key.split("__")
        lines += [f"e,{condition},{method},{trial},1,{metric},{value},mm" for trial, value in enumerate(found)]
    return "\n".join(lines) + "\n"


def test_a_headline_is_the_mean_of_its_rows_and_counts_failures(tmp_path: Path) -> None:
    (tmp_path / "pages").mkdir()
    (tmp_path / "pages" / "results.csv").write_text(
        rows(restored__paper_euler__mm=[1.0, 2.0, 3.0], restored__spring__mm=[0.5, 0.5])
        + "e,unrestored,-,0,1,mm,4.0,mm\ne,restored,spring,2,1,failed,1,\n"
    )
    headline = Headline("Pages [mm]", "pages", "mm", "unrestored", "restored", "< 5", 1)
    link, n, before, paper, theirs, ours = headline.cells(Evidence(tmp_path))
    assert (link, n, paper) == ("[Pages [mm]](reports/pages/table.md)", "3", "< 5")
    assert before == "4.0"
    assert theirs.startswith("2.0 (")
    assert ours == "0.5, 1 failed"


def test_a_table_of_results_without_its_report_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="corner_distance"):
        with_results("<!-- results -->\n<!-- end -->", Evidence(tmp_path))


def test_the_first_table_is_small_enough_to_be_read() -> None:
    assert len(HEADINGS) <= 6
    assert len(HEADLINES) <= 8


def test_every_decision_is_listed_by_its_title(tmp_path: Path) -> None:
    (tmp_path / "0002-b.md").write_text("# 0002: Second\n")
    (tmp_path / "0001-a.md").write_text("# 0001: First\n\nmore\n")
    (tmp_path / "template.md").write_text("# NNNN: Title\n")
    listed = decisions_page(tmp_path).splitlines()[-2:]
    assert listed == ["- [0001](0001-a.md): First", "- [0002](0002-b.md): Second"]
    (tmp_path / "0003-c.md").write_text("# 0004: Third\n")
    with pytest.raises(InputError, match=r"0003-c.md` must begin with `# 0003: ` and a title, got # 0004: Third"):
        decisions_page(tmp_path)

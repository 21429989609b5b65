"""Every number in the report's tables, reckoned again from the runs' CSV files by pandas."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from experiments.page.runs import Run
from experiments.reporting.blocks import Heading, markdown_page
from tests.report.tables_in import FoundTable, tables_in

REPORTS = Path(__file__).resolve().parents[2] / "reports"

Values = dict[tuple[str, str, str], "pd.Series[float]"]
_NUMBER = r"-?\d+(?:\.\d+)?"
_WITH_ENDS = re.compile(rf"({_NUMBER})(?: \(({_NUMBER})\.\.({_NUMBER})\))?")
_SHARE = re.compile(r"(\d+) of (\d+) \((\d+)\.\.(\d+) %\)")
_NONE = "–"


@pytest.fixture(scope="module")
def tables(report: Path) -> list[FoundTable]:
    return tables_in(report.read_text(encoding="utf-8"))


class Recorded:
    """A run's rows by condition, method and metric, each a series over its pages."""

    def __init__(self, folder: Path, columns: dict[str, object]) -> None:
        self.columns = columns
        self.results, self.timings = (_by_place(folder / f"{kind}.csv") for kind in ("results", "timings"))
        self.failures = json.loads((folder / "run.json").read_text())["failures"]

    def of(self, condition: str, method: str, metric: str) -> pd.Series[float]:
        return self.results.get((condition, method, metric), pd.Series(dtype=float))

    @cache  # noqa: B019
    def n_failed(self, condition: str, method: str) -> int:
        """Count the pages that failed there, and those whose trial failed as a whole before it gave a number there."""
        here = [values for (*place, metric), values in self.results.items() if place == [condition, method]]
        gave = {page for values in here for page in values.index}
        lost = set(self.of(condition, method, "failed").index)
        for (planned, by, metric), values in self.results.items():
            if (by, metric) == ("-", "failed") and set(planned.split("/")) - {"-"} <= set(condition.split("/")):
                lost |= set(values.index) - gave
        return len(lost)


def _by_place(path: Path) -> Values:
    data = pd.read_csv(path, keep_default_na=False, dtype={"value": float})
    data = data.set_index(["trial", "seed"])
    return {place: group["value"] for place, group in data.groupby(["condition", "method", "metric"])}


def agrees(text: str, value: float) -> bool:
    """Whether a printed number is the value, rounded to the digits that are printed."""
    digits = len(text.partition(".")[2])
    return abs(float(text) - value) <= 0.5 * 10.0**-digits * (1 + 1e-6) + 1e-12 * abs(value)


def wilson(ones: int, n: int) -> tuple[float, float]:
    """Wilson's interval in closed form."""
    z, p = 1.959963984540054, ones / n
    middle, reach = p + z * z / (2 * n), z * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return (middle - reach) / (1 + z * z / n), (middle + reach) / (1 + z * z / n)


def check_share(cell: str, ones: float, n: int) -> None:
    found = _SHARE.fullmatch(cell)
    assert found is not None, cell
    assert (int(found[1]), int(found[2])) == (int(ones), n)
    assert [int(found[3]), int(found[4])] == [round(100 * end) for end in wilson(int(ones), n)]


def check_mean(cell: str, value: float) -> None:
    found = _WITH_ENDS.fullmatch(cell)
    assert found is not None, cell
    assert agrees(found[1], value), (cell, value)
    if found[2] is not None:
        assert float(found[2]) <= float(found[1]) <= float(found[3]), cell


def places(table: FoundTable) -> Iterator[tuple[str, str, list[str], str]]:
    """Yield condition, method, cells and metric of each line but the paper's."""
    with_method = "method" in table.headings
    for line, metric in zip(table.lines, table.of_lines, strict=True):
        if line[0] != "the paper":
            yield line[0], line[table.column("method")] if with_method else "-", line, metric


def check_headlines(table: FoundTable, run: Recorded) -> int:
    count = 0
    for condition, method, line, _ in places(table):
        n_failed = int(line[table.column("failed")])
        assert n_failed == run.n_failed(condition, method), line
        counts = [len(run.of(condition, method, metric)) for metric in table.of_columns if metric]
        assert int(line[table.column("n")]) == max(counts), line
        for cell, metric in zip(line, table.of_columns, strict=True):
            if not metric:
                continue
            values = run.of(condition, method, metric)
            column = run.columns[metric]
            if cell == _NONE:
                assert values.empty
            elif column.share:
                check_share(cell, values.sum(), len(values) + n_failed)
            else:
                check_mean(cell, math.sqrt((values**2).mean()) if column.rms else values.mean())
            count += 1
    return count


def check_all_trials(table: FoundTable, run: Recorded) -> int:
    for condition, method, line, metric in places(table):
        n, n_failed, mean, interval, median, least, p90, largest, _ = line[3:]
        assert int(n_failed) == run.n_failed(condition, method), line
        values = run.of(condition, method, metric)
        assert int(n) == len(values)
        if not metric:
            continue
        lost = int(n_failed) if run.columns[metric].share else 0
        assert agrees(mean, values.sum() / (len(values) + lost)), line
        check_interval(interval, values, lost, share=run.columns[metric].share)
        assert agrees(median, values.median()), line
        assert agrees(least, values.min()), line
        assert agrees(largest, values.max()), line
        assert p90 == _NONE if len(values) < 10 else agrees(p90, np.quantile(values, 0.9)), line
    return 6 * len(table.lines)


def check_interval(cell: str, values: pd.Series[float], lost: int, *, share: bool) -> None:
    """A share's interval is Wilson's; a mean's holds the mean and lies among the values, without width if all agree."""
    if cell == _NONE:
        assert len(values) < 3
        return
    low, high = cell.split("..")
    if share:
        ends = wilson(int(values.sum()), len(values) + lost)
        assert agrees(low, ends[0])
        assert agrees(high, ends[1])
        return
    half = 0.5 * 10.0 ** -len(low.partition(".")[2]) * (1 + 1e-6)
    assert values.min() - half <= float(low) <= values.mean() + half, (cell, values.mean())
    assert values.mean() - half <= float(high) <= values.max() + half, (cell, values.mean())
    assert (float(low) < float(high)) or values.std() < 20 * half


def check_each_trial(table: FoundTable, run: Recorded) -> int:
    count = 0
    for condition, method, line, _ in places(table):
        trial = int(line[2])
        for cell, metric in zip(line, table.of_columns, strict=True):
            if metric and cell not in (_NONE, "failed"):
                assert agrees(cell, run.of(condition, method, metric).loc[trial].iloc[0]), line
                count += 1
    return count


def check_tails(table: FoundTable, run: Recorded) -> int:
    levels = {"half of the pages below": 0.5, "9 in 10 below": 0.9, "19 in 20 below": 0.95, "largest": 1.0}
    count = 0
    for condition, method, line, metric in places(table):
        values = run.of(condition, method, metric)
        for heading, level in levels.items():
            cell = line[table.column(heading)]
            if cell != _NONE:
                assert agrees(cell.split(" ")[0], np.quantile(values, level)), line
                count += 1
    return count


def check_pair(one: pd.Series[float], other: pd.Series[float], cells: dict[str, str]) -> int:
    both = one.index.intersection(other.index)
    one, other = one.loc[both], other.loc[both]
    assert int(cells["pages"]) == len(both)
    if len(both) == 0:
        return 1
    if "difference" in cells:
        check_mean(cells["difference"], (one - other).mean())
    if "ratio" in cells and cells["ratio"] != _NONE:
        check_mean(cells["ratio"], one.mean() / other.mean())
        check_share(cells["better"], (one < other).sum(), len(both))
    return len(cells)


def check_lost(cell: str, run: Recorded, one: tuple[str, str], other: tuple[str, str]) -> None:
    assert cell == f"{run.n_failed(*one)} ({run.n_failed(*other)})"


def check_versus(table: FoundTable, run: Recorded) -> int:
    baseline = re.search(r"Method against method: (\S+)$", table.title)
    assert baseline is not None
    against, count = baseline[1].strip("`"), 0
    for condition, method, line, metric in places(table):
        named = {"pages": "pages", "difference": "difference", "ratio": "ratio of means", "better": "better on"}
        cells = {key: line[table.column(heading)] for key, heading in named.items()}
        one, other = run.of(condition, method, metric), run.of(condition, against, metric)
        count += check_pair(one, other, cells)
        both = one.index.intersection(other.index)
        equal = line[table.column("equal on")]
        assert equal == (str((one.loc[both] == other.loc[both]).sum()) if len(both) else _NONE)
        check_lost(line[table.column("failed (against)")], run, (condition, method), (condition, against))
    return count


def check_changes(table: FoundTable, run: Recorded) -> int:
    count = 0
    for condition, method, line, _ in places(table):
        against = line[table.column("against")]
        check_lost(line[table.column("failed (against)")], run, (condition, method), (against, method))
        metrics = [(metric, cell) for metric, cell in zip(table.of_columns, line, strict=True) if metric]
        for i, (metric, cell) in enumerate(metrics):
            cells = {"difference": cell} if cell != _NONE else {}
            if i == 0:
                cells |= {"ratio": line[-2], "better": line[-1]}
            one, other = run.of(condition, method, metric), run.of(against, method, metric)
            # Pages are counted by the first metric.
            cells["pages"] = line[table.column("pages")] if i == 0 else str(len(one.index.intersection(other.index)))
            count += check_pair(one, other, cells)
    return count


def check_times(table: FoundTable, run: Recorded) -> int:
    count = 0
    for condition, method, line, _ in places(table):
        for cell, metric in zip(line, table.of_columns, strict=True):
            if metric and cell != _NONE:
                assert agrees(cell, run.timings[condition, method, metric].median()), line
                count += 1
    return count


def check_failed(table: FoundTable, run: Recorded) -> int:
    asked = ("trial", "seed", "condition", "method", "reason")
    wanted = [[str(failure[name]).replace("|", "/").replace("`", "") for name in asked] for failure in run.failures]
    assert [[cell.replace("`", "") for cell in line] for line in table.lines] == wanted
    return len(table.lines)


def checked(table: FoundTable, run: Recorded) -> int:
    """Check a table by what its headings say it is; return how many numbers were compared."""
    headings = set(table.headings)
    if "reason" in headings:
        return check_failed(table, run)
    if "9 in 10 below" in headings and "median" in headings:
        return check_all_trials(table, run)
    if "19 in 20 below" in headings:
        return check_tails(table, run)
    if "equal on" in headings:
        return check_versus(table, run)
    if "against" in headings:
        return check_changes(table, run)
    if "trial" in headings:
        return check_each_trial(table, run)
    if "failed" in headings:
        return check_headlines(table, run)
    return check_times(table, run)


def test_numbers_in_every_table_are_those_of_the_csv(tables: list[FoundTable], runs: list[Run]) -> None:
    total = 0
    for run in runs:
        recorded = Recorded(REPORTS / run.name, {column.metric: column for column in columns_of(run)})
        found = [table for table in tables if table.section == run.name.replace("_", "-")]
        assert found, run.name
        for table in found:
            count = checked(table, recorded)
            assert count > 0, (run.name, table.title)
            total += count
    assert total > 20_000


def columns_of(run: Run) -> list[object]:
    times = [*run.layout.times, *filter(None, [run.layout.profile])]
    return [*run.layout.columns, *(column for shown in times for column in shown.columns)]


def test_page_has_every_table_and_cell_of_the_markdown(tables: list[FoundTable], runs: list[Run]) -> None:
    for run in runs:
        markdown = (REPORTS / run.name / "table.md").read_text()
        blocks = run.blocks()
        assert markdown_page(blocks) == markdown, f"{run.name}/table.md is not what its results.csv gives"
        rows = [line.strip("| ").split(" | ") for line in markdown.splitlines() if line.startswith("| ")]
        rows = [[re.sub(r"[`*]", "", cell) for cell in row] for row in rows if set(row) - {"---", "---:"}]
        section = run.name.replace("_", "-")
        shown = [row for t in tables if t.section == section for row in (t.headings, *t.lines)]
        assert shown == rows
        assert isinstance(blocks[0], Heading)


def test_verdicts_are_those_of_the_claims_page(report: Path, tables: list[FoundTable]) -> None:
    claims = (REPORTS / "CLAIMS.md").read_text()
    tally = re.search(r"^Of (\d+) figures: (.*)\.$", claims, re.MULTILINE)
    assert tally is not None
    assert f'aria-label="{tally[2]}"' in report.read_text()
    found = [table for table in tables if table.section == "claims"]
    assert sum(len(table.lines) for table in found) == int(tally[1])
    for table in found:
        for line in table.lines:
            what, paper, ours, verdict, best, _ = line
            beginning = what[0].lower() + what[1:] if what[0].lower() + what[1:] in claims else what
            assert f"| {beginning} | {paper} | {ours} | {verdict} | {best} |" in claims, line

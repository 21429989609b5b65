"""Two runs of one commit: what counts as the same."""

from __future__ import annotations

from pathlib import Path

import pytest

from experiments.reporting.agreement import main
from experiments.reporting.export import csv_text
from experiments.trials import Row

ROWS = {"corner_mean_px": 0.3, "dense_mean_mm": 0.1, "misses": 2.0, "misses_normalised": 1.0, "steps": 900.0}


def written(path: Path, **changes: float | None) -> Path:
    values = {metric: value for metric, value in (ROWS | changes).items() if value is not None}
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = [Row("fake", "restored", "spring", 0, 1, metric, value, unit(metric)) for metric, value in values.items()]
    path.write_text(csv_text(rows))
    return path


def unit(metric: str) -> str:
    return {"px": "px", "mm": "mm"}.get(metric.rsplit("_", 1)[-1], "1")


@pytest.mark.parametrize(
    ("change", "code"),
    [
        ({}, 0),
        ({"corner_mean_px": 0.3009}, 0),
        ({"corner_mean_px": 0.3011}, 1),
        ({"dense_mean_mm": 0.0989}, 1),
        ({"misses": 3.0}, 0),
        ({"misses": 4.0}, 1),
        ({"misses_normalised": 3.0}, 1),
        ({"steps": 1000.0}, 0),
        ({"dense_mean_mm": None}, 1),
        ({"failed": 1.0}, 1),
    ],
)
def test_lengths_may_differ_by_a_thousandth_and_pages_by_a_letter(
    tmp_path: Path, change: dict[str, float | None], code: int
) -> None:
    first, second = written(tmp_path / "a.csv"), written(tmp_path / "b.csv", **change)
    assert main([str(first), str(second)]) == main([str(second), str(first)]) == code


def test_folders_are_compared_report_by_report(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for run in ("one", "two"):
        written(tmp_path / run / "corner_distance" / "results.csv")
    assert main([str(tmp_path / "one"), str(tmp_path / "two")]) == 0
    written(tmp_path / "two" / "corner_distance" / "results.csv", corner_mean_px=0.5)
    assert main([str(tmp_path / "one"), str(tmp_path / "two")]) == 1
    assert "fake restored spring 0 1 corner_mean_px: 0.3 and 0.5 differ by more than 0.001" in capsys.readouterr().out


TWICE = csv_text([Row("fake", "control", "-", 0, 1, "misses", 1.0, "1")] * 2)


@pytest.mark.parametrize("content", ["", "these are my notes\n", "experiment,value\nfake,1\n", TWICE])
def test_what_is_no_table_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str], content: str) -> None:
    (tmp_path / "notes.csv").write_text(content)
    for other, wanted in (("notes.csv", "be a results.csv"), ("absent.csv", "be a file, got nothing there")):
        assert main([str(written(tmp_path / "a.csv")), str(tmp_path / other)]) == 2
        assert f"{other}` must {wanted}" in capsys.readouterr().err


def test_two_names_are_wanted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == main(["a", "b", "c"]) == main([str(tmp_path), str(tmp_path)]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 3

"""A curve's points are the means of its trials, at the place that the first condition's rows tell."""

from __future__ import annotations

import pytest

from experiments.reporting import Column, Curve, Layout, Section
from experiments.reporting.curves import curve_plot, curve_points
from experiments.reporting.tables import table
from experiments.trials import Row, TrialKey

CURVE = Curve("severity", "slope_p90_deg", "slope", "misses", "misses", ("unrestored", "restored"), (("band", 1, 3),))


def rows_of(condition: str, method: str, metric: str, values: list[float]) -> list[Row]:
    keys = (TrialKey("fake", trial=i, seed=1) for i in range(len(values)))
    return [Row.of(key, condition, method, metric, value) for key, value in zip(keys, values, strict=True)]


ROWS = [
    *rows_of("unrestored/slope=30", "-", "slope_p90_deg", [29.5, 30.5]),
    *rows_of("unrestored/slope=30", "-", "misses", [6.0, 10.0]),
    *rows_of("restored/slope=30", "a", "misses", [1.0, 0.0]),
    *rows_of("unrestored", "-", "slope_p90_deg", [20.0, 20.0, 20.0]),
    *rows_of("unrestored", "-", "misses", [1.0, 2.0, 6.0]),
    *rows_of("restored", "a", "misses", [0.0, 0.0, 0.0]),
    # Of no line, and of a line without a place.
    *rows_of("control", "-", "misses", [5.0]),
    *rows_of("restored/slope=40", "a", "misses", [9.0]),
]


def test_points_are_means_in_their_order_with_intervals_from_three_trials_on() -> None:
    lines = curve_points(CURVE, ROWS)
    assert list(lines) == ["unrestored", "restored a"]
    assert [(point.x, point.y.mean) for point in lines["unrestored"]] == [(20.0, 3.0), (30.0, 8.0)]
    assert [(point.x, point.y.mean) for point in lines["restored a"]] == [(20.0, 0.0), (30.0, 0.5)]
    interval = lines["unrestored"][0].y.interval
    assert interval is not None
    assert 1.0 <= interval[0] < 3.0 < interval[1] <= 6.0
    assert lines["unrestored"][1].y.interval is None


def test_a_curve_is_drawn_with_the_papers_bands_and_without_data_not_at_all() -> None:
    figure = curve_plot(CURVE, ROWS)
    assert figure is not None
    axes = figure.axes[0]
    assert {text.get_text() for text in axes.get_legend().get_texts()} == {"band", "unrestored", "restored a"}
    assert curve_plot(CURVE, rows_of("control", "-", "misses", [5.0])) is None


def test_a_section_takes_all_that_goes_on_after_a_slash_and_says_what_is_absent() -> None:
    sections = (
        Section("Severity", "", ("unrestored/", "restored/"), ("misses",)),
        Section("Real", "", ("real/",), ("misses",), absent="Absent: no folder."),
    )
    text = table(Layout("T", "n", (Column("misses", "misses", 1),), sections=sections), ROWS, [])
    lines = text[text.index("**Severity.**") : text.index("**Real.**")].splitlines()
    shown = [line.split("|")[1].strip() for line in lines if line.startswith("| ")][2:]
    assert shown == ["unrestored/slope=30", "restored/slope=30", "restored/slope=40"]
    assert "Absent: no folder." in text


@pytest.mark.parametrize(
    ("condition", "rank"), [("real/flat", 0), ("real/hard", 1), ("real", None), ("unreal/x", None)]
)
def test_a_sections_first_fit_ranks_a_condition(condition: str, rank: int | None) -> None:
    assert Section("", "", ("real/flat", "real/"), ()).rank(condition) == rank

"""Tables, figures and statistics say what the rows say."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from deskew.errors import InputError
from experiments.reporting import Column, Layout, Montage, Plot
from experiments.reporting.export import csv_text, parquet_bytes
from experiments.reporting.figures import dot_plot, picture_wall, png_bytes
from experiments.reporting.tables import table
from experiments.trials import Failure, Outcome, Recorder, Row, TrialKey, unit_of

finite = st.floats(allow_nan=False, allow_infinity=False)


def rows_of(values: list[float], condition: str = "restored", metric: str = "corner_mean_px") -> list[Row]:
    return [Row.of(TrialKey("fake", trial=i, seed=1), condition, "a", metric, value) for i, value in enumerate(values)]


@given(finite)
def test_a_value_in_the_csv_reads_back_as_the_same_double(value: float) -> None:
    line = csv_text(rows_of([value])).splitlines()[1]
    assert float(line.split(",")[6]) == value


def test_csv_does_not_depend_on_the_order_of_its_rows() -> None:
    rows = rows_of([0.3, 0.1, 0.2]) + rows_of([1.0], "control")
    assert csv_text(rows) == csv_text(rows[::-1])


def test_parquet_holds_the_rows_of_the_csv_with_types_and_repeats_its_bytes() -> None:
    parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed")
    rows = rows_of([0.3, 0.1, 1 / 3]) + rows_of([1.0], "control")
    written = parquet_bytes(rows)
    assert parquet_bytes(rows[::-1]) == written
    read = parquet.read_table(BytesIO(written))
    assert [str(kind) for kind in read.schema.types] == [
        *("string", "string", "string", "int64", "int64", "string", "double", "string")
    ]
    assert [Row(**row) for row in read.to_pylist()] == sorted(rows)
    assert read.column_names == csv_text([]).strip().split(",")


@pytest.mark.parametrize(
    ("metric", "unit"),
    [
        ("corner_mean_px", "px"),
        ("dense_p95_mm", "mm"),
        ("slope_p90_deg", "deg"),
        ("length_error_units", "units"),
        ("seconds_render", "s"),
        ("peak_mb", "MB"),
        ("corners_missing", "1"),
        ("page_coverage", "1"),
        ("misses", "1"),
        ("shrink_estimated", "%"),
        ("difference_rms_grey", "grey levels"),
        ("error_rate_percent", "%"),
    ],
)
def test_unit_is_the_last_word_of_the_metric(metric: str, unit: str) -> None:
    assert unit_of(metric) == unit


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_row_refuses_what_is_no_number(value: float) -> None:
    with pytest.raises(InputError, match="`corner_mean_px` must be finite"):
        rows_of([value])


def test_a_metric_is_recorded_once() -> None:
    record = Recorder(TrialKey("fake"))
    record.add("restored", "a", {"misses": 1})
    with pytest.raises(InputError, match="recorded once"):
        record.add("restored", "a", {"misses": 2})


def test_a_failure_replaces_the_numbers_of_its_method_and_of_no_other() -> None:
    record = Recorder(TrialKey("fake"))
    with record.attempt("restored", "a"):
        record.add("restored", "a", {"misses": 1})
        raise RuntimeError("locked")
    record.add("restored", "b", {"misses": 2})
    outcome: Outcome = record.outcome()
    assert [(row.method, row.metric, row.value) for row in outcome.rows] == [("a", "failed", 1.0), ("b", "misses", 2.0)]
    assert outcome.failures[0].reason.startswith("RuntimeError: locked")


def test_trials_of_a_seed_differ_and_repeat() -> None:
    draws = [TrialKey("fake", trial=i, seed=3).generator().random() for i in range(20)]
    assert len(set(draws)) == 20
    expected = np.random.default_rng(np.random.SeedSequence([3, 7])).random()
    assert draws[7] == expected == TrialKey("fake", "x", "y", 7, 3).generator().random()


def test_a_montage_has_a_column_a_trial_and_bears_missing_pictures() -> None:
    key = TrialKey("fake")
    record = Recorder(key)
    record.picture("page_0_crumpled", np.full((4, 6), 99, np.uint8))
    record.picture("page_2_restored", np.full((4, 6, 3), 50, np.uint8))
    wall = Montage("pages", (("crumpled", "page_{trial}_crumpled"), ("restored", "page_{trial}_restored")), "sheet")
    figure = picture_wall(wall, record.outcome().pictures)
    assert figure is not None
    assert [axes.get_title() for axes in figure.axes[:2]] == ["sheet 1", "sheet 3"]
    assert [len(axes.images) for axes in figure.axes] == [1, 0, 0, 1]
    assert picture_wall(wall, {}) is None


def test_a_failed_trial_counts_against_a_share() -> None:
    column = Column("meets_paper", "kept", headline=True, share=True)
    rows = rows_of([1.0, 1.0, 0.0], metric="meets_paper")
    failed = Row.of(TrialKey("fake", trial=3, seed=1), "restored", "a", "failed", 1.0)
    text = table(Layout("T", "N", (column,)), [*rows, failed], [])
    assert "| restored | a | 3 | 1 | 2 of 4 (15..85 %) |" in text


def test_root_mean_squares_are_pooled() -> None:
    column = Column("length_error_mm", "error", 2, headline=True, rms=True)
    text = table(Layout("T", "N", (column,)), rows_of([3.0, 4.0], metric="length_error_mm"), [])
    assert "| restored | a | 2 | 0 | 3.54 |" in text


def test_table_shows_count_centre_spread_and_the_papers_figure() -> None:
    column = Column("corner_mean_px", "mean [px]", 2, {"restored": "< 0.5"})
    rows = rows_of([0.1, 0.2, 0.6]) + rows_of([1.0], "control") + rows_of([0.4], "restored/saddle")
    failures = [Failure("restored", "a", 3, 1, "locked")]
    failed = Row.of(TrialKey("fake", trial=3, seed=1), "restored", "a", "failed", 1.0)
    lines = table(Layout("T", "N", (column,)), [*rows, failed], failures).splitlines()
    assert "| restored | a | mean [px] | 3 | 1 | 0.30 | 0.10..0.60 | 0.20 | 0.10 | – | 0.60 | < 0.5 |" in lines
    assert "| control | a | mean [px] | 1 | 0 | 1.00 | – | 1.00 | 1.00 | – | 1.00 | – |" in lines
    assert "| restored/saddle | a | mean [px] | 1 | 0 | 0.40 | – | 0.40 | 0.40 | – | 0.40 | < 0.5 |" in lines
    assert "| restored | a | 3 | failed |" in lines
    assert "| 3 | 1 | restored | a | locked |" in lines


def test_table_of_many_trials_leaves_out_the_single_ones() -> None:
    column = Column("corner_mean_px", "mean [px]")
    text = table(Layout("T", "N", (column,)), rows_of([0.1] * 11), [])
    assert "## Each trial" not in text
    assert "## Each trial" in table(Layout("T", "N", (column,)), rows_of([0.1] * 10), [])


def test_same_rows_give_the_same_picture_and_no_rows_none() -> None:
    plot = Plot("corners", "corner_mean_px", "mean [px]", 0.5)
    figures = [dot_plot(plot, rows_of([0.1, 0.2])) for _ in range(2)]
    first, second = (png_bytes(figure) for figure in figures if figure is not None)
    assert first == second
    assert b"Software" not in first
    other = dot_plot(plot, rows_of([0.1, 0.3]))
    assert other is not None
    assert png_bytes(other) != first
    assert dot_plot(plot, rows_of([0.1], metric="misses")) is None

"""Tables compare by page, and say which pages are missing."""

from __future__ import annotations

import pytest

from experiments.reporting import Changes, Column, Ladder, Layout, Tails, Versus
from experiments.reporting.ladders import ladder_plot
from experiments.reporting.pages import pages_by_place
from experiments.reporting.tables import table
from experiments.reporting.versus import changed_places, paired
from experiments.trials import Row, TrialKey

ERROR, KEPT = Column("corner_mean_px", "mean [px]", 2), Column("meets_paper", "kept", share=True)


def rows_of(condition: str, method: str, values: dict[int, float], metric: str = "corner_mean_px") -> list[Row]:
    return [Row.of(TrialKey("fake", trial=i), condition, method, metric, value) for i, value in values.items()]


def failed(condition: str, method: str, *trials: int) -> list[Row]:
    return rows_of(condition, method, dict.fromkeys(trials, 1.0), "failed")


ROWS = [
    *rows_of("restored", "ours", {0: 1.0, 1: 2.0, 2: 4.0, 4: 7.0}),
    *failed("restored", "ours", 3),
    *rows_of("restored", "theirs", {0: 2.0, 1: 4.0, 3: 9.0}),
    *failed("restored", "theirs", 2, 4),
    # A trial that broke before any method came to it.
    *failed("-", "-", 5),
    *rows_of("unrestored", "-", {0: 5.0, 1: 5.0, 2: 5.0, 3: 5.0, 4: 5.0}),
]


def test_a_trial_that_failed_as_a_whole_failed_everywhere_it_was_planned() -> None:
    places = pages_by_place([*ROWS, *rows_of("restored/slope=40", "ours", {5: 1.0}), *failed("slope=40", "-", 6)])
    assert places["unrestored", "-"].failed == {(5, 0)}
    assert places["restored", "ours"].failed == {(3, 0), (5, 0)}
    assert places["restored/slope=40", "ours"].failed == {(6, 0)}
    assert places["restored", "ours"].of("corner_mean_px") == [1.0, 2.0, 4.0, 7.0]


def test_pairs_are_the_pages_of_both_and_the_lost_are_counted() -> None:
    places = pages_by_place(ROWS)
    pair = paired(places["restored", "ours"], places["restored", "theirs"], "corner_mean_px")
    assert pair.found is not None
    assert (pair.found.n, pair.found.difference, pair.found.ratio) == (2, -1.5, 0.5)
    assert (pair.n_failed, pair.n_failed_against) == (2, 3)


def test_method_against_method_stands_in_the_table() -> None:
    layout = Layout("T", "N", (ERROR,), versus=Versus("Ours.", "theirs", ("restored",), ("corner_mean_px",)))
    text = table(layout, ROWS, [])
    assert "## Method against method: `theirs`" in text
    assert "| restored | ours | mean [px] | 2 | 2 (3) | -1.50 | 0.50 | 2 of 2 (34..100 %) | 0 |" in text
    alone = [row for row in ROWS if row.method != "theirs"]
    assert "Method against method" not in table(layout, alone, [])


def test_a_method_that_always_failed_is_shown_as_such() -> None:
    layout = Layout("T", "N", (ERROR,), versus=Versus("", "theirs", ("restored",), ("corner_mean_px",)))
    rows = [*rows_of("restored", "theirs", {0: 1.0, 1: 2.0}), *failed("restored", "ours", 0, 1)]
    assert "| restored | ours | mean [px] | 0 | 2 (0) | – | – | – | – |" in table(layout, rows, [])
    none = [*failed("restored", "theirs", 0), *failed("restored", "ours", 0, 1)]
    assert "| restored | ours | mean [px] | 0 | 2 (1) | – | – | – | – |" in table(layout, none, [])


def test_condition_against_condition_keeps_to_the_method() -> None:
    rows = [
        *rows_of("restored", "ours", {0: 1.0, 1: 2.0}),
        *rows_of("restored/noise=2", "ours", {0: 2.0, 1: 6.0}),
        *rows_of("restored/noise=4", "theirs", {0: 2.0}),
        *failed("restored/noise=4", "ours", 0, 1),
    ]
    changes = Changes("Noise", "More of it.", (("restored/", "restored"),), ("corner_mean_px",))
    text = table(Layout("T", "N", (ERROR,), changes=(changes,)), rows, [])
    lines = [line for line in text.splitlines() if "against" not in line and "| restored |" in line]
    assert "| restored/noise=2 | restored | ours | 2 | 0 (0) | 2.50 | 2.67 | 0 of 2 (0..66 %) |" in lines
    assert "| restored/noise=4 | restored | ours | 0 | 2 (0) | – | – | – |" in lines
    # `theirs` has nothing to be compared with.
    assert not any("theirs" in line for line in lines if line.count("|") == 9)


def test_conditions_that_go_on_alike_are_compared_in_the_order_of_their_numbers() -> None:
    values = {"raw/mesh=9": 2.0, "raw/mesh=90": 1.5, "raw/mesh=180": 1.0, "fine/mesh=9": 1.0, "fine/mesh=90": 1.0}
    rows = [row for condition, value in values.items() for row in rows_of(condition, "-", {0: value})]
    places = pages_by_place(rows)
    assert [condition for condition, _ in places if condition.startswith("raw")] == list(values)[:3]
    found = list(changed_places((("raw/", "fine/"),), places))
    assert found == [(("raw/mesh=9", "-"), "fine/mesh=9"), (("raw/mesh=90", "-"), "fine/mesh=90")]


def test_a_ladder_shows_what_stands_after_each_step_and_what_each_is_worth() -> None:
    rungs, worth = (("start", "paper"), ("+ a", "path/1_a"), ("+ b", "best")), (("left out", (("best", "no/a"),)),)
    ladder = Ladder("steps", "Steps", "corner_mean_px", "error [px]", rungs, worth, paper=0.5)
    values = {"paper": 4.0, "path/1_a": 2.0, "best": 1.0, "no/a": 3.0}
    rows = [row for name, value in values.items() for row in rows_of(name, "-", {0: value, 1: 2 * value, 2: value})]
    figure = ladder_plot(ladder, rows)
    assert figure is not None
    left, right = figure.axes
    assert [text.get_text() for text in left.texts] == ["5.333", "2.667", "1.333"]
    assert [text.get_text() for text in left.get_yticklabels()] == ["start", "+ a", "+ b"]
    ((drawn, _, _),) = right.containers
    assert drawn.get_xdata() == pytest.approx([8 / 3])  # pages: 3 - 1, 6 - 2, 3 - 1
    assert ladder_plot(ladder, rows_of("no/a", "-", {0: 1.0})) is None


def test_tails_say_what_most_pages_keep_below() -> None:
    layout = Layout(
        "T", "N", (ERROR, KEPT), tails=(Tails("Kept", "", ("restored",), ("corner_mean_px",), KEPT.metric),)
    )
    values = {i: float(i) for i in range(20)}
    kept = {i: float(i < 18) for i in range(20)}
    rows = [*rows_of("restored", "a", values), *rows_of("restored", "a", kept, "meets_paper")]
    text = table(layout, [*rows, *failed("restored", "a", 20)], [])
    line = next(line for line in text.splitlines() if "18 of 21" in line)
    # The 6th and the 15th of 20 bound a median, the 15th and nothing a ninth decile: binomial tails of 2.1 and 1.1 %.
    assert line.startswith("| restored | a | mean [px] | 18 of 21 (65..95 %) | 9.50 (5.00..14.00) | 17.10 (> 14.00) |")
    assert line.endswith("| 18.05 (> 16.00) | 19.00 |")
    few = [row for row in rows if row.trial < 9]
    assert "| – | – | 8.00 |" in table(layout, few, [])

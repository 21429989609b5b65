"""Twenty reruns of the smoke baseline with redrawn noise, kept with the ten that its floors come from."""

from __future__ import annotations

from pathlib import Path

import pytest

from experiments.gate.baseline import Baseline, Place
from experiments.gate.floors import floors_text
from experiments.gate.upkeep import floors_from, judged, read_table, rows_of
from experiments.gate.verdict import Call, judge

RERUNS, OF_FLOORS = range(1, 21), range(101, 111)

Table = dict[int, dict[Place, float]]


@pytest.fixture(scope="module")
def table() -> Table:
    return read_table(Path(__file__).with_name("redrawn.csv.gz"))


def test_twenty_reruns_with_redrawn_noise_raise_no_alarm(smoke: Baseline, table: Table) -> None:
    baseline = [row for row in smoke.rows if judged(row)]
    alarms = {draw: judge(baseline, rows_of(table[draw]), smoke.floors).regressions for draw in RERUNS}
    assert {draw: [verdict.figure for verdict in found] for draw, found in alarms.items() if found} == {}


def test_nor_does_any_of_them_against_any_other(smoke: Baseline, table: Table) -> None:
    """The baseline's own noise is one draw of many: here each of the twenty stands in its place."""
    pairs = [(one, other) for one in RERUNS for other in RERUNS if one != other]
    verdicts = [judge(rows_of(table[one]), rows_of(table[other]), smoke.floors) for one, other in pairs]
    alarms = sum(bool(judgement.regressions) for judgement in verdicts)
    # A hundredth is what the test promises for one pair.
    assert alarms <= 0.01 * len(pairs)
    assert sum(bool(judgement.of(Call.BETTER)) for judgement in verdicts) <= 0.01 * len(pairs)


def test_the_floors_are_those_of_ten_other_draws(smoke: Baseline, table: Table) -> None:
    assert floors_text(smoke.floors) == floors_text(floors_from([table[draw] for draw in OF_FLOORS]))


def test_another_draw_is_other_noise(smoke: Baseline, table: Table) -> None:
    """Not one figure that noise can move is the same in two draws."""
    place = ("corner_distance", "restored", "spring", 0, 2001, "corner_mean_px")
    assert len({table[draw][place] for draw in (*RERUNS, *OF_FLOORS)}) == 30

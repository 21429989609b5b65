"""Times of flattening by method and size: which are taken, what they are compared with, and what failure does."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable

import numpy as np
import pytest

from deskew.types import Sheet
from experiments.reporting import Layout
from experiments.reporting.tables import table
from experiments.studies import flattening_times
from experiments.studies.flattening_times import time_flattening
from experiments.trials import Outcome, Recorder, TrialKey

COST = {"spring": 1.0, "arap": 4.0, "lscm": 2.0, "slim": 30.0}


def grid(size: int, seed: int = 0) -> Sheet:
    x, y = np.meshgrid(np.linspace(0, 216, size), np.linspace(0, -216, size))
    return Sheet(np.stack([x, y, 10 * np.cos(x / 30 + seed % 1)], axis=-1))


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, int, bool]]:
    """Methods as stand-ins on a clock of our own: seconds in proportion to the vertices a side."""
    now, calls = [0.0], []
    monkeypatch.setattr(flattening_times.time, "process_time", lambda: now[0])
    monkeypatch.setattr(flattening_times, "_grid", grid)

    def work(method: str, sheet: Sheet) -> Callable[[], object]:
        size = len(sheet.vertices) if sheet.faces is None else round(len(sheet.vertices) ** 0.5)

        def run() -> None:
            calls.append((method, size, sheet.faces is not None))
            now[0] += COST[method] * size / 1000

        return run

    monkeypatch.setattr(flattening_times, "_work", work)
    return calls


def timed(n: int) -> tuple[Outcome, dict[tuple[str, str], dict[str, float]]]:
    record = Recorder(TrialKey("speed"))
    time_flattening(record, np.random.default_rng(1), n)
    found: dict[tuple[str, str], dict[str, float]] = defaultdict(dict)
    outcome = record.outcome()
    for row in outcome.timings:
        found[row.condition, row.method][row.metric] = row.value
    found.pop(("-", "-"))
    return outcome, found


def test_every_size_is_timed_by_the_methods_that_are_fast_enough(asked: list[tuple[str, int, bool]]) -> None:
    _, found = timed(2)
    grids = {"spring": (45, 100, 200, 400, 1000), "arap": (45, 100, 200, 400), "lscm": (45, 100, 200)}
    grids["slim"] = grids["lscm"]
    wanted = {(str(size), method) for method, sizes in grids.items() for size in sizes}
    wanted |= {(f"mesh/{size}", method) for size in (45, 100, 200) for method in ("spring", "arap")}
    assert set(found) == wanted
    for (condition, method), times in found.items():
        size = int(condition.removeprefix("mesh/"))
        assert times["seconds_flatten"] == pytest.approx(COST[method] * size / 1000)
        assert times["peak_mb"] > 0
        if condition == "1000":
            assert "ratio_to_arap" not in times
        else:
            assert times["ratio_to_arap"] == pytest.approx(COST[method] / 4.0)


def test_each_is_warmed_up_and_what_is_slow_is_not_repeated(asked: list[tuple[str, int, bool]]) -> None:
    timed(5)
    assert [call[:2] for call in asked[:4]] == [(method, 45) for method in COST]
    assert asked[4:].count(("spring", 100, False)) == 5
    assert asked.count(("slim", 200, False)) == 1  # 6 s
    assert asked.count(("slim", 100, False)) == 2  # 3 s each


def test_a_method_that_is_not_there_fails_its_own_rows(
    asked: list[tuple[str, int, bool]], monkeypatch: pytest.MonkeyPatch
) -> None:
    real = flattening_times._work

    def work(method: str, sheet: Sheet) -> Callable[[], object]:
        if method == "arap":
            raise ModuleNotFoundError("No module named 'igl'")
        return real(method, sheet)

    monkeypatch.setattr(flattening_times, "_work", work)
    outcome, found = timed(1)
    assert {(row.condition, row.metric) for row in outcome.rows} == {
        (condition, "failed") for condition in ("45", "100", "200", "400", "mesh/45", "mesh/100", "mesh/200")
    }
    assert all("igl" in failure.reason and failure.method == "arap" for failure in outcome.failures)
    assert "seconds_flatten" in found["45", "spring"]
    assert not any("ratio_to_arap" in times for times in found.values())


def test_the_table_goes_from_small_to_large(asked: list[tuple[str, int, bool]]) -> None:
    outcome, _ = timed(1)
    text = table(Layout("Speed", "N", (), times=(flattening_times.TIMES,)), [], [], outcome.timings)
    lines = [line for line in text.splitlines() if "| spring |" in line]
    conditions = [line.split("|")[1].strip() for line in lines]
    assert conditions == ["45", "100", "200", "400", "1000", "mesh/45", "mesh/100", "mesh/200"]
    assert "| 45 | spring | 0.0450 | 0.250 |" in text
    assert "| 1000 | spring | 1.0000 | – |" in text


def test_the_rival_starts_conformally_and_ends_as_long_as_the_surface() -> None:
    pytest.importorskip("igl")
    flat = flattening_times._work("arap", grid(15))()
    assert isinstance(flat, np.ndarray)
    surface = grid(15).vertices
    length = np.linalg.norm(np.diff(surface[0], axis=0), axis=1).sum()
    ends = np.linalg.norm(flat.reshape(15, 15, 2)[:, -1] - flat.reshape(15, 15, 2)[:, 0], axis=-1)
    assert ends == pytest.approx(length, rel=0.01)

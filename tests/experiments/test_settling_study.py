"""The study of settling: what counts as an ending, where energy alone would stop, and what every setting does."""

from __future__ import annotations

import csv
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

from deskew.types import Flattened, Status
from experiments.program import main
from experiments.studies.courses import spread_slope
from experiments.studies.endings import ENDS, STOPS, ending, energy_stop

TINY = [
    "experiment=settling",
    "budget=smoke",
    "engine=serial",
    "out=out",
    "mesh.rows=15",
    "mesh.columns=15",
    "settling.restitutions=[0.1,1.0]",
    "settling.stiffer=[20.0]",
    "settling.pushes=[0.0001,0.5]",
    "settling.max_steps=3000",
]


def run(
    status: Status, *, steps: float = 1000.0, folded: float = 0.0, heights: object = (0.0,), energies: object = ()
) -> Flattened:
    history = {"height_max_mm": np.array(heights, float), "spring_energy_uj": np.array(energies, float)}
    counters = {"steps": steps, "step_collapsed": 0.0, "folded_quads": folded}
    return Flattened(np.zeros((2, 2, 3)), status, "", counters, history=history)


@pytest.mark.parametrize(
    ("status", "steps", "ended"),
    [
        (Status.AT_REST, 3000, "flat"),
        (Status.FOLDED, 3000, "folded"),
        (Status.DIVERGED, 200, "diverged"),
        (Status.LOCKED, 1000, "locked"),
        (Status.LOCKED, 3000, "unfinished"),
    ],
)
def test_a_run_has_one_ending(status: Status, steps: float, ended: str) -> None:
    assert ending(run(status, steps=steps), 3000) == ended
    assert ended in ENDS


def test_a_step_that_collapsed_is_unfinished_however_few_they_were() -> None:
    result = run(Status.LOCKED, steps=23)
    result.counters["step_collapsed"] = 1.0
    assert ending(result, 3000) == "unfinished"


@pytest.mark.parametrize(
    ("heights", "energies", "folded", "kind", "ratio"),
    [
        ((9, 5, 0.01, 0.01), (0, 3, 2, 2), 0, "stop_flat", 1.0),
        ((9, 5, 3, 3), (0, 1, 0.5, 0.5), 0, "stop_locked_less", 0.25),
        ((9, 5, 3, 3), (0, 1, 2.5, 2.5), 0, "stop_locked_more", 1.25),
        ((9, 5, 0.01, 0.01), (0, 1, 3, 3), 2, "stop_folded", 1.5),
        ((9, 5, 0.01, 0.01), (0, 4, 3, 2), 0, "stop_never", None),
        ((9, 5, np.nan, np.nan), (0, 4, np.inf, np.nan), 0, "stop_never", None),
        # It stops at the first still look, though the page would have lain flat at the last.
        ((9, 5, 5, 0.01), (0, 1, 1, 2), 0, "stop_locked_less", 0.5),
    ],
)
def test_energy_alone_stops_at_the_first_look_that_saw_no_change(
    heights: object, energies: object, folded: float, kind: str, ratio: float | None
) -> None:
    stop = energy_stop(run(Status.LOCKED, folded=folded, heights=heights, energies=energies), 2.0)
    assert (stop.kind, stop.energy_ratio) == (kind, ratio)
    assert stop.kind in STOPS


@pytest.mark.parametrize("n", [5, 10, 50])
def test_slopes_are_spread_evenly_however_many_there_are(n: int) -> None:
    slopes = np.sort([spread_slope(trial) for trial in range(n)])
    assert 15.0 < slopes[0] < slopes[-1] < 40.0
    gaps = np.diff(np.concatenate([[15.0], slopes, [40.0]]))
    assert gaps.max() < 2.0 * 25.0 / (n + 1)


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, float]]:
    folder = tmp_path_factory.mktemp("settling")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert main(TINY) == 0
    rows: dict[str, dict[str, float]] = defaultdict(dict)
    with (folder / "out" / "results.csv").open() as file:
        for row in csv.DictReader(file):
            rows[row["condition"]][row["metric"]] = float(row["value"])
    assert (folder / "out" / "figures" / "energy_alone.png").stat().st_size > 5_000
    return rows


def test_every_run_ends_once_and_every_energy_stops_once(found: dict[str, dict[str, float]]) -> None:
    runs = {condition: figures for condition, figures in found.items() if condition != "page"}
    assert len(runs) == 2 + 4 + 2 + 2
    assert all(sum(figures[end] for end in ENDS) == 1.0 for figures in runs.values())
    for push in ("0.0001", "0.5"):
        assert sum(found[f"energy/push={push}"][stop] for stop in STOPS) == 1.0


def test_the_usual_settings_end_flat_and_the_wrong_ones_as_they_must(found: dict[str, dict[str, float]]) -> None:
    for condition in ("restitution/k_r=0.1", "halving/working", "stiffer/own_step/times=20", "energy/push=0.5"):
        assert found[condition]["flat"] == 1.0
        assert found[condition]["energy_over_flat"] == pytest.approx(1.0, abs=1e-3)
        assert found[condition]["error_mm"] < 0.01 < found["page"]["discretisation_mm"]
    assert found["energy/push=0.5"]["stop_flat"] == 1.0
    assert found["energy/push=0.0001"]["flat"] == 0.0
    assert found["stiffer/same_step/times=20"]["diverged"] == found["halving/long_step"]["diverged"] == 1.0
    assert found["halving/literal"]["unfinished"] == found["restitution/k_r=1"]["unfinished"] == 1.0


def test_penetration_is_kept_to_eps_by_halving_alone(found: dict[str, dict[str, float]]) -> None:
    depths = {name: found[f"halving/{name}"]["penetration_mm"] for name in ("literal", "working", "none")}
    assert depths["literal"] == 0.0 < depths["working"] <= 0.05 < 1.0 < depths["none"]


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("method=spring", "`method` must be of paper_euler, paper_rk4 in this experiment, got spring"),
        ("sheet=physical", "`sheet.kind` must be left out"),
        ("settling.restitutions=[1.5]", "`settling.restitutions` must be a list of different numbers in [0, 1]"),
        ("settling.max_steps=10", "`settling.max_steps` must be a whole number in [200, 1000000]"),
    ],
)
def test_what_it_cannot_do_is_refused(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], override: str, message: str
) -> None:
    assert main([*TINY, override, f"out={tmp_path / 'no'}"]) == 2
    assert message in capfd.readouterr().err
    assert not (tmp_path / "no").exists()

"""The comparison of integrators: its problems have the answers that they are said to have, and its rows say so."""

from __future__ import annotations

import csv
import json
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

from deskew.flattening.schemes import INTEGRATORS
from deskew.types import Flattened, Floats, Sheet, Status
from experiments.program import main
from experiments.studies import courses, flights
from experiments.studies.integrator_tests import fitted_order

Figures = dict[tuple[str, str], dict[str, float]]
TINY = [
    "experiment=integrators",
    "budget=smoke",
    "engine=serial",
    "out=out",
    "mesh.rows=15",
    "mesh.columns=15",
    "integrators.damping_ratios=[0.8]",
    "integrators.stiffness=[1.0,100.0]",
    "integrators.pushes=[0.0001,0.5]",
    "integrators.mapped=[euler]",
]


def read(path: Path) -> Figures:
    found: Figures = defaultdict(dict)
    with path.open() as file:
        for row in csv.DictReader(file):
            found[row["condition"], row["method"]][row["metric"]] = float(row["value"])
    return found


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One small run of explicit and symplectic Euler, and of an integrator from outside that is nonsense."""
    folder = tmp_path_factory.mktemp("integrators")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        methods = "method=[euler,symplectic_euler,tests.experiments.flatteners:stand_still]"
        assert main([*TINY, methods]) == 0
    return folder / "out"


def test_orders_and_stable_steps_stand_beside_their_theory(report: Path) -> None:
    found = read(report / "results.csv")
    for method in ("euler", "symplectic_euler"):
        assert abs(found["free_flight", method]["order"] - found["free_flight", method]["order_theory"]) < 0.1
        assert abs(found["contact/bounce", method]["order"] - 1) < 0.1
        for condition in ("stability/zeta=0.8", "stability/ks=100"):
            assert 0.9 < found[condition, method]["stable_dt_ratio"] < 1.1
    assert 0 < found["free_flight", "-"]["reference_floor_mm"] < 1e-9
    slow, fast = (found[f"stability/ks={k_s}", "euler"]["stable_dt_s"] for k_s in (1, 100))
    assert slow / fast == pytest.approx(10, rel=0.01)


def test_flattening_rows_tell_cost_and_distance_and_what_the_chords_cost_anyway(report: Path) -> None:
    found, times = (read(report / name) for name in ("results.csv", "timings.csv"))
    place = "flattening/zeta=0.8", "euler"
    assert found[place]["at_rest"] == 1.0
    assert 0 < found[place]["evaluations_to_residual"] < found[place]["force_evaluations"]
    assert 0 < times[place]["seconds_to_residual"] < times[place]["seconds_flatten"]
    assert 0 < found[place]["error_mm"] < 0.01 < found[place[0], "-"]["discretisation_mm"]


def test_outcomes_add_up_and_a_push_too_weak_locks(report: Path) -> None:
    found = read(report / "results.csv")
    for push in ("0.0001", "0.5"):
        ends = found[f"outcomes/push={push}", "euler"]
        assert sum(ends[end] for end in ("flat", "locked", "folded", "diverged")) == 1.0
    assert found["outcomes/push=0.0001", "euler"]["locked"] == 1.0
    assert found["outcomes/push=0.5", "euler"]["flat"] == 1.0


def test_what_explodes_or_stands_still_is_listed_and_never_dropped(report: Path) -> None:
    found = read(report / "results.csv")
    assert found["energy/dt=0.4", "euler"]["failed"] == 1.0
    assert found["free_flight", "tests.experiments.flatteners:stand_still"]["failed"] == 1.0
    reasons = [failure["reason"] for failure in json.loads((report / "run.json").read_text())["failures"]]
    assert any("the energy grew" in reason for reason in reasons)


def test_every_figure_is_drawn(report: Path) -> None:
    for name in ("work_precision", "stable_steps", "flattening", "outcomes"):
        assert (report / "figures" / f"{name}.png").stat().st_size > 10_000


def test_unknown_integrator_is_refused_before_anything_runs(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert main([*TINY, "method=paper_euler", f"out={tmp_path / 'no'}"]) == 2
    assert "`integrator` must be one of euler" in capfd.readouterr().err


def test_bouncing_balls_have_bounced_once_and_are_above_the_plane() -> None:
    heights = flights.bounced(flights.bouncing_balls())
    assert (heights > 0).all()
    assert (heights <= 0.5**2 * 1.5).all()  # k_r^2 of the height that it fell from
    exact = flights.fly(flights.bouncing_balls(), INTEGRATORS["rk4"], flights.BOUNCE_S, 20_000).x[2]
    np.testing.assert_allclose(heights, exact, atol=1e-3)


def test_flying_leaves_the_start_as_it_was() -> None:
    flight = flights.thrown_sheet(np.random.default_rng(0), 0.5)
    before = flight.x.copy(), flight.v.copy()
    flights.fly(flight, INTEGRATORS["euler"], flight.unit_s, 4)
    assert np.array_equal(flight.x, before[0])
    assert np.array_equal(flight.v, before[1])


def test_fitted_order_is_the_slope() -> None:
    assert fitted_order([0.1, 0.2, 0.4], [3e-3, 1.2e-2, 4.8e-2]) == pytest.approx(2.0)


def course(heights: list[float], energies: list[float]) -> Flattened:
    n = len(heights)
    history: dict[str, Floats] = {
        "force_evaluations": 10.0 * np.arange(n),
        "height_max_mm": np.array(heights),
        "spring_energy_uj": np.array(energies),
        "kinetic_energy_uj": np.zeros(n),
    }
    return Flattened(np.zeros((2, 2, 3)), Status.AT_REST, history=history)


def test_residual_counts_only_once_it_is_kept() -> None:
    grid = np.zeros((2, 2, 3))
    grid[..., 0], grid[..., 1] = [[0, 1], [0, 1]], [[0, 0], [-1, -1]]
    page = courses.Page(Sheet(grid), grid[..., :2], grid, 2.0, 20.0, 10.0)
    passing = course([9, 0, 0, 9, 0, 0], [2, 2, 2, 2, 2, 2])
    assert courses.evaluations_to_residual(page, passing, 1.0) == 40.0
    assert courses.evaluations_to_residual(page, course([9, 0, 0], [2, 9, 2.01]), 1.0) == 20.0
    assert courses.evaluations_to_residual(page, course([9, 0, 0], [2, 9, 2.01]), 0.5) is None
    assert courses.evaluations_to_residual(page, course([9, 0, 1], [2, 2, 2]), 1.0) is None

from __future__ import annotations

import numpy as np
import pytest

from deskew.flattening.contact import NOWHERE
from deskew.flattening.forces import spring_energy, system
from deskew.flattening.integrators import Pace, advance, start
from deskew.flattening.schemes import INTEGRATORS
from deskew.flattening.settings import SpringSettings
from deskew.flattening.springs import grid_springs
from deskew.flattening.stability import largest_stable_step, stiffest_mode
from deskew.types import Sheet
from tests.flattening.bent_sheets import flat_grid


def test_stiffest_mode_is_the_largest_eigenvalue_of_the_dense_matrix() -> None:
    rng = np.random.default_rng(0)
    vertices = flat_grid() + rng.normal(0, 0.3, (9, 11, 3))
    springs = grid_springs(Sheet(vertices, stiffness=rng.uniform(0.2, 1.0, (8, 10))), SpringSettings(1.0))
    points, matrix = vertices.reshape(-1, 3), np.zeros((99, 3, 99, 3))
    for a, b, _, k in zip(*springs.pairs(), strict=True):
        axis = (points[a] - points[b]) / np.linalg.norm(points[a] - points[b])
        block = k * np.outer(axis, axis)
        matrix[a, :, a] += block
        matrix[b, :, b] += block
        matrix[a, :, b] -= block
        matrix[b, :, a] -= block
    largest = np.linalg.eigvalsh(matrix.reshape(297, 297))[-1] / 0.5
    found = stiffest_mode(np.ascontiguousarray(points.T), system(springs, beta=0, mass=0.5, gravity=1, drag=1))
    assert 0.97 * largest < found <= largest * (1 + 1e-12)


def test_stiffest_mode_of_a_large_square_grid_is_eight_k_over_m() -> None:
    vertices = flat_grid((40, 40), (39.0, 39.0))
    physics = system(grid_springs(Sheet(vertices), SpringSettings(3.0)), beta=0, mass=0.5, gravity=0, drag=0)
    assert stiffest_mode(np.ascontiguousarray(vertices.reshape(-1, 3).T), physics) == pytest.approx(8 * 6, rel=0.01)


@pytest.mark.parametrize("ratio", [0.15, 0.4, 0.7, 1.0])
def test_explicit_euler_may_step_as_far_as_its_damping_says(ratio: float) -> None:
    lam = 9.0
    limit = largest_stable_step(INTEGRATORS["euler"], lam, 2 * ratio / 3.0, 0.0)
    assert limit == pytest.approx(2 * ratio / 3.0, rel=1e-3)


def test_undamped_explicit_euler_has_no_stable_step() -> None:
    assert largest_stable_step(INTEGRATORS["euler"], 9.0, 0.0, 0.0) == 0.0


def test_undamped_rk4_is_stable_to_two_root_two() -> None:
    assert largest_stable_step(INTEGRATORS["rk4"], 9.0, 0.0, 0.0) == pytest.approx(2 * np.sqrt(2) / 3, rel=1e-3)


def test_undamped_leapfrogs_are_stable_to_two() -> None:
    for integrator in ("symplectic_euler", "verlet"):
        assert largest_stable_step(INTEGRATORS[integrator], 9.0, 0.0, 0.0) == pytest.approx(2 / 3, rel=1e-3)


def test_implicit_euler_has_no_longest_step() -> None:
    assert largest_stable_step(INTEGRATORS["implicit_euler"], 9.0, 0.1, 0.0) == np.inf


@pytest.mark.parametrize("integrator", [name for name in INTEGRATORS if name != "implicit_euler"])
@pytest.mark.parametrize("ratio", [0.3, 0.8])
def test_measured_limit_is_the_predicted_one(integrator: str, ratio: float) -> None:
    rest = flat_grid((8, 8))
    x = np.ascontiguousarray(rest.reshape(-1, 3).T)
    still = system(grid_springs(Sheet(rest), SpringSettings(1.0)), beta=0, mass=1.0, gravity=0.0, drag=0.02)
    lam = stiffest_mode(x, still)
    physics = still._replace(beta=2 * ratio / np.sqrt(lam))
    limit = largest_stable_step(INTEGRATORS[integrator], lam, physics.beta, 0.02)
    energies = {}
    for share in (0.96, 1.04):
        run = start(
            rest + np.random.default_rng(0).normal(0, 1e-6, rest.shape) * [1, 1, 0], INTEGRATORS[integrator], limit
        )
        dt = share * limit
        run.clock[:] = dt, 0.0, dt
        before = spring_energy(run.x, physics)
        advance(run, INTEGRATORS[integrator], physics, NOWHERE, Pace(dt, dt, 1e9), 1200)
        energies[share] = spring_energy(run.x, physics) / before
    assert energies[0.96] < 1e-2
    assert not energies[1.04] < 1e3  # NaN where it overflowed

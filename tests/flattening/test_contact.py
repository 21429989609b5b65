from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from deskew.flattening.contact import Plane, collide, deepest, sunk
from deskew.flattening.integrators import CONTACTS, REJECTED, Pace, Run, advance, start
from deskew.flattening.schemes import INTEGRATORS
from tests.flattening.bent_sheets import free_particles


@pytest.mark.parametrize("k_r", [0.0, 0.1, 0.6, 1.0])
def test_restitution_scales_the_normal_velocity_and_nothing_else(k_r: float) -> None:
    z, v = np.array([-0.01, 0.02, 0.2, 0.01]), np.array([-50.0, -50.0, -50.0, 50.0])
    strikes = collide(z, v, Plane(0.05, k_r, False), 10.0, 1e-3)
    assert strikes == 2
    np.testing.assert_allclose(v, [50.0 * k_r, 50.0 * k_r, -50.0, 50.0])
    assert z.tolist() == [0.0, 0.02, 0.2, 0.01]


def test_particle_slower_than_five_steps_of_gravity_rests() -> None:
    z, v = np.array([0.0, 0.0]), np.array([-0.049, -0.051])
    assert collide(z, v, Plane(0.05, 1.0, False), 10.0, 1e-3) == 1
    assert v.tolist() == [0.0, 0.051]


def test_only_particles_below_eps_have_the_step_halved() -> None:
    z = np.array([-0.06, -0.04, 0.0, 1.0])
    assert sunk(z, Plane(0.05, 0.1, False)) == 1
    assert sunk(z, Plane(0.05, 0.1, True)) == 2


def test_the_deepest_height_is_kept_and_no_number_is_passed_over() -> None:
    z = np.array([0.5, -0.02, np.nan, -0.3, 1.0])
    assert deepest(z, 0.0) == -0.3
    assert deepest(z, -0.4) == -0.4
    assert deepest(np.array([np.nan, 0.2]), 0.0) == 0.0


@pytest.mark.parametrize("integrator", ["euler", "rk4"])
@pytest.mark.parametrize("k_r", [0.3, 0.8])
def test_ball_rebounds_to_k_r_squared_of_its_height(
    k_r: float, integrator: str, make_steps: Callable[..., Run]
) -> None:
    gravity, height = 10.0, 2.0
    fall = np.sqrt(2 * height / gravity)
    top = fall * (1 + k_r)
    vertices = np.array([[0.0, 0.0, height]])
    physics, plane = free_particles(1, gravity), Plane(1e-6, k_r, False)
    run = make_steps(vertices, np.array([[4.0, 0.0, 0.0]]), physics, plane, integrator, top / 40_000, 40_000)
    assert run.x[2, 0] == pytest.approx(k_r**2 * height, rel=2e-3)
    assert abs(run.v[2, 0]) < 1e-2
    assert run.v[0, 0] == 4.0  # tangential velocity passes untouched
    assert run.counts[CONTACTS] == 1


def fallen_balls(literal: bool, eps: float, n_steps: int) -> tuple[bool, Run]:
    """Let two balls fall on the plane with halving allowed down to 1e-12 of the step."""
    scheme, dt = INTEGRATORS["euler"], 0.05
    run = start(np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.4]]), scheme, dt)
    goes_on = advance(
        run, scheme, free_particles(2, 10.0, 0.5), Plane(eps, 0.1, literal), Pace(dt, 1e-12 * dt), n_steps
    )
    return bool(goes_on), run


def test_literal_halving_collapses() -> None:
    goes_on, run = fallen_balls(True, 0.0, 2_000)
    assert not goes_on
    assert run.clock[0] < 1e-12
    assert 0.2 < run.clock[1] < 0.6  # time stops soon after the first landing, at .28 s


def test_working_halving_brings_the_same_balls_to_rest() -> None:
    goes_on, run = fallen_balls(False, 0.05, 200)
    assert goes_on
    assert run.counts[REJECTED] > 0
    assert run.clock[2] < run.clock[0] == 0.05
    assert not run.v.any()
    assert ((run.x[2] >= 0) & (run.x[2] < 0.05)).all()


def test_rejected_step_leaves_the_state_and_halves() -> None:
    scheme = INTEGRATORS["euler"]
    run = start(np.array([[0.0, 0.0, 1.0]]), scheme, 1.0)
    run.v[2] = -1.6
    advance(run, scheme, free_particles(1, 0.0), Plane(0.05, 0.1, False), Pace(1.0, 1e-3), 1)
    assert run.counts[REJECTED] == 1
    assert run.clock[2] == 0.5
    assert run.x[2, 0] == pytest.approx(0.2)

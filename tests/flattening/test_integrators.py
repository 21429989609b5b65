from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numba.core.runtime import _nrt_python as _nrt
from numba.core.runtime import rtsys
from scipy.integrate import solve_ivp

from deskew.flattening.contact import NOWHERE, Plane
from deskew.flattening.forces import System, accelerate, scratch, spring_energy, system
from deskew.flattening.integrators import EVALUATIONS, REJECTED, STEPS, Pace, Run, advance, start
from deskew.flattening.schemes import INTEGRATORS, runge_kutta
from deskew.flattening.settings import SpringSettings
from deskew.flattening.springs import Springs, grid_springs
from deskew.flattening.stability import stiffest_mode
from deskew.types import Array, Sheet
from tests.flattening.bent_sheets import flat_grid, free_particles

Steps = Callable[..., Run]


def thrown_sheet() -> tuple[Array, Array, System]:
    """A strained, moving sheet in the air, with every force in play."""
    rng = np.random.default_rng(7)
    springs = grid_springs(Sheet(flat_grid((4, 5))), SpringSettings(1.0))
    vertices = flat_grid((4, 5)) + rng.normal(0, 0.5, (4, 5, 3))
    return vertices, rng.normal(0, 3.0, (20, 3)), system(springs, beta=0.2, mass=1.0, gravity=9.0, drag=0.1)


def reference(vertices: Array, velocities: Array, physics: System, duration: float) -> Array:
    """Positions (3, V) by scipy's DOP853 at 1e-12."""
    work, out = scratch(), np.empty((3, vertices.size // 3))

    def derivative(_: float, y: Array) -> Array:
        x, v = y.reshape(2, 3, -1)
        accelerate(np.ascontiguousarray(x), np.ascontiguousarray(v), physics, work, out)
        return np.concatenate([v.ravel(), out.ravel()])

    y0 = np.concatenate([vertices.reshape(-1, 3).T.ravel(), velocities.T.ravel()])
    return solve_ivp(derivative, (0, duration), y0, "DOP853", rtol=1e-12, atol=1e-12).y[:, -1].reshape(2, 3, -1)[0]


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_converges_at_its_order(integrator: str, make_steps: Steps) -> None:
    vertices, velocities, physics = thrown_sheet()
    exact = reference(vertices, velocities, physics, 4.0)
    order = INTEGRATORS[integrator].order
    n = np.array([64, 128, 256, 512]) * (16 if order == 1 else 1)
    # A tolerance that every step keeps makes an embedded pair step equally.
    errors = [
        np.abs(make_steps(vertices, velocities, physics, NOWHERE, integrator, 4.0 / m, int(m)).x - exact).max()
        for m in n
    ]
    assert abs(-np.polyfit(np.log(n), np.log(errors), 1)[0] - order) < 0.1


def test_embedded_pair_keeps_the_tolerance_that_it_is_given() -> None:
    vertices, velocities, physics = thrown_sheet()
    exact = reference(vertices, velocities, physics, 4.0)
    scheme, errors, steps = INTEGRATORS["bogacki_shampine"], [], []
    for tolerance in (1e-3, 1e-6):
        run = start(vertices, scheme, 1e-3)
        run.v[:] = velocities.T
        pace = Pace(0.5, 1e-9, tolerance)
        while run.clock[1] < 4.0 - 1e-9:
            run.clock[0] = min(run.clock[0], 4.0 - run.clock[1])
            advance(run, scheme, physics, NOWHERE, pace, 1)
        errors.append(np.abs(run.x - exact).max())
        steps.append(int(run.counts[STEPS]))
    # A step's error is kept, and some tens of steps add up; a third of the digits cost a factor of ten in steps.
    assert 1e-5 < errors[0] < 3e-2
    assert 1e-8 < errors[1] < 1e-4
    assert 4 < steps[1] / steps[0] < 16


def test_embedded_pair_rejects_a_step_that_is_far_too_long() -> None:
    vertices, velocities, physics = thrown_sheet()
    scheme = INTEGRATORS["bogacki_shampine"]
    run = start(vertices, scheme, 1.0)
    run.v[:] = velocities.T
    advance(run, scheme, physics, NOWHERE, Pace(1.0, 1e-9, 1e-4), 1)
    assert run.counts[REJECTED] >= 1
    assert run.clock[1] < 0.2


def test_implicit_euler_stays_stable_far_beyond_the_explicit_limit() -> None:
    vertices, velocities, physics = thrown_sheet()
    scheme = INTEGRATORS["implicit_euler"]
    falling = physics._replace(gravity=0.0)
    longest = 2.0 / np.sqrt(stiffest_mode(np.ascontiguousarray(vertices.reshape(-1, 3).T), falling))
    run = start(vertices, scheme, 50 * longest)
    run.v[:] = velocities.T
    before = spring_energy(run.x, falling)
    advance(run, scheme, falling, NOWHERE, Pace(50 * longest, 50 * longest), 40)
    assert spring_energy(run.x, falling) < 0.05 * before


def test_implicit_step_solves_its_linear_system_as_a_dense_solver_does() -> None:
    # Eq. 15 of Baraff and Witkin written out, with derivatives by central differences of the forces themselves.
    vertices, velocities, physics = thrown_sheet()
    vertices = 1.25 * vertices  # every spring is stretched, so that no stiffness is dropped
    x, v = (np.ascontiguousarray(rows.reshape(-1, 3).T) for rows in (vertices, velocities))
    h, n = 0.3, x.size

    def force(x: Array, v: Array, beta: float) -> Array:
        out = np.empty_like(x)
        accelerate(x, v, physics._replace(beta=beta), scratch(), out)
        return out.ravel()

    def jacobian(of: Callable[[Array], Array], at: Array) -> Array:
        return np.stack([(of(at + e) - of(at - e)) / 2e-5 for e in 1e-5 * np.eye(n)], axis=1)

    by_place = jacobian(lambda at: force(at.reshape(3, -1), v, 0.0), x.ravel())
    by_motion = jacobian(lambda at: force(x, at.reshape(3, -1), physics.beta), v.ravel())
    right = h * (force(x, v, physics.beta) + h * by_place @ v.ravel())
    dv = np.linalg.solve(np.eye(n) - h * by_motion - h * h * by_place, right)
    run = start(vertices, INTEGRATORS["implicit_euler"], h)
    run.v[:] = v
    advance(run, INTEGRATORS["implicit_euler"], physics, NOWHERE, Pace(h, h), 1)
    np.testing.assert_allclose(run.v.ravel(), v.ravel() + dv, atol=1e-3 * np.abs(dv).max())


def test_agrees_with_scipy_dop853_before_contact(make_steps: Steps) -> None:
    vertices, velocities, physics = thrown_sheet()
    run = make_steps(vertices, velocities, physics, NOWHERE, "rk4", 1e-3, 4000)
    np.testing.assert_allclose(run.x, reference(vertices, velocities, physics, 4.0), atol=1e-9)


SWING = {"euler": 2e-3, "symplectic_euler": 2e-3, "implicit_euler": 2e-3, "verlet": 1e-6, "bogacki_shampine": 1e-8}


@pytest.mark.parametrize(("integrator", "tolerance"), [*SWING.items(), ("rk4", 1e-10)])
def test_two_particles_swing_as_a_damped_oscillator(integrator: str, tolerance: float, make_steps: Steps) -> None:
    k_s, k_d, mass, rest, stretched = 3.0, 0.2, 0.7, 10.0, 11.0
    springs = Springs(np.array([[[rest, 0.0]]] + 3 * [[[0.0, 0.0]]]), np.array([[[k_s, 0.0]]] + 3 * [[[0.0, 0.0]]]))
    physics = system(springs, beta=k_d / k_s, mass=mass, gravity=0.0, drag=0.0)
    ends = np.array([[-stretched / 2, 0.0, 0.0], [stretched / 2, 0.0, 0.0]])
    duration, n = 5.0, 20_000
    run = make_steps(ends, np.zeros((2, 3)), physics, NOWHERE, integrator, duration / n, n)
    # The distance obeys s'' = -(2 / m) (k_s (s - r) + k_d s').
    gamma, omega = k_d / mass, np.sqrt(2 * k_s / mass - (k_d / mass) ** 2)
    swing = np.exp(-gamma * duration) * (np.cos(omega * duration) + gamma / omega * np.sin(omega * duration))
    exact = rest + (stretched - rest) * swing
    assert abs(run.x[0, 1] - run.x[0, 0] - exact) < tolerance
    assert abs(exact - rest) > 0.05
    assert abs(run.x[0].sum()) < 1e-12


FALL = {"euler": 0.05, "symplectic_euler": 0.05, "implicit_euler": 0.05, "verlet": 1e-4, "bogacki_shampine": 1e-6}


@pytest.mark.parametrize(("integrator", "tolerance"), [*FALL.items(), ("rk4", 1e-8)])
def test_falls_with_drag_as_the_closed_form_says(integrator: str, tolerance: float, make_steps: Steps) -> None:
    gravity, drag, duration, n = 9.0, 0.8, 3.0, 3000
    physics = free_particles(1, gravity, drag)
    run = make_steps(np.zeros((1, 3)), np.zeros((1, 3)), physics, NOWHERE, integrator, duration / n, n)
    terminal = gravity / drag
    exact = -terminal * (duration - (1 - np.exp(-drag * duration)) / drag)
    assert abs(run.x[2, 0] - exact) < tolerance
    assert abs(run.v[2, 0] + terminal * (1 - np.exp(-drag * duration))) < tolerance


def bounce_errors(integrator: str, n: int, make_steps: Steps) -> float:
    """RMS error of 64 balls a while after their only bounce, at n equal steps."""
    gravity, k_r, duration = 10.0, 0.5, 0.85
    height = np.linspace(1.0, 1.5, 64)
    vertices = np.stack([np.zeros(64), np.zeros(64), height], axis=1)
    plane = Plane(1e-12, k_r, False)
    physics = free_particles(64, gravity)
    run = make_steps(vertices, np.zeros((64, 3)), physics, plane, integrator, duration / n, n)
    landing = np.sqrt(2 * height / gravity)
    after = duration - landing
    exact = k_r * gravity * landing * after - gravity * after**2 / 2
    assert (exact > 0).all()
    return float(np.sqrt(np.mean((run.x[2] - exact) ** 2)))


def test_contact_lowers_rk4_to_first_order(make_steps: Steps) -> None:
    n = np.array([200, 400, 800, 1600])
    errors = [bounce_errors("rk4", int(m), make_steps) for m in n]
    assert 0.8 < -np.polyfit(np.log(n), np.log(errors), 1)[0] < 1.2


STAGES = {"euler": 1, "rk4": 4, "symplectic_euler": 1, "verlet": 1, "bogacki_shampine": 3}


@pytest.mark.parametrize(("integrator", "stages"), STAGES.items())
def test_every_force_evaluation_is_counted(integrator: str, stages: int, make_steps: Steps) -> None:
    vertices, velocities, physics = thrown_sheet()
    run = make_steps(vertices, velocities, physics, NOWHERE, integrator, 1e-3, 50)
    # What is reused has to be evaluated once.
    assert run.counts[EVALUATIONS] == 50 * stages + INTEGRATORS[integrator].reuses
    assert INTEGRATORS[integrator].stages == stages


DRIFT = {"symplectic_euler": 0.05, "verlet": 0.01, "rk4": 1e-4}


@pytest.mark.parametrize(("integrator", "drift"), DRIFT.items())
def test_energy_drifts_no_further_than_its_integrator_allows(integrator: str, drift: float, make_steps: Steps) -> None:
    vertices, velocities, physics = thrown_sheet()
    free = physics._replace(beta=0.0, gravity=0.0, drag=0.0)

    def energy(run: Run) -> float:
        return float(spring_energy(run.x, free) + 0.5 * free.mass * (run.v**2).sum())

    before, *later = [
        energy(make_steps(vertices, velocities, free, NOWHERE, integrator, 0.02, n)) for n in (1, 2000, 4000, 6000)
    ]
    assert max(abs(after / before - 1) for after in later) < drift
    exploded = energy(make_steps(vertices, velocities, free, NOWHERE, "euler", 0.02, 2000))
    assert not exploded < 2 * before


def test_butcher_table_becomes_its_nystrom_form() -> None:
    scheme = runge_kutta([[0.0, 0.0], [0.5, 0.0]], [0.0, 1.0], 2)  # midpoint
    assert scheme.c.tolist() == [0.0, 0.5]
    assert scheme.b_x.tolist() == [0.5, 0.0]
    assert not scheme.A_x.any()


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_stepping_allocates_nothing(integrator: str, make_steps: Steps) -> None:
    vertices, velocities, physics = thrown_sheet()
    _nrt.memsys_enable_stats()
    try:
        allocations = []
        for n in (1, 500):
            before = rtsys.get_allocation_stats().alloc
            make_steps(vertices, velocities, physics, NOWHERE, integrator, 1e-3, n)
            allocations.append(rtsys.get_allocation_stats().alloc - before)
    finally:
        _nrt.memsys_disable_stats()
    assert allocations[0] == allocations[1]

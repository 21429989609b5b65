from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numba.core.runtime import _nrt_python as _nrt
from numba.core.runtime import rtsys
from scipy.integrate import solve_ivp

from deskew.flattening.contact import Plane
from deskew.flattening.forces import System, accelerate, scratch, system
from deskew.flattening.integrators import EVALUATIONS, Run, runge_kutta
from deskew.flattening.settings import SpringSettings
from deskew.flattening.springs import Springs, grid_springs
from deskew.types import Array, Sheet
from tests.flattening.bent_sheets import flat_grid, free_particles

Steps = Callable[..., Run]
FAR_BELOW = Plane(-1e9, 0.1, False)
ORDER = {"euler": 1, "rk4": 4}


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


@pytest.mark.parametrize("integrator", ["euler", "rk4"])
def test_converges_at_its_order(integrator: str, make_steps: Steps) -> None:
    vertices, velocities, physics = thrown_sheet()
    exact = reference(vertices, velocities, physics, 4.0)
    n = np.array([64, 128, 256, 512]) * (16 if integrator == "euler" else 1)
    errors = [
        np.abs(make_steps(vertices, velocities, physics, FAR_BELOW, integrator, 4.0 / m, int(m)).x - exact).max()
        for m in n
    ]
    order = -np.polyfit(np.log(n), np.log(errors), 1)[0]
    assert abs(order - ORDER[integrator]) < 0.1


def test_agrees_with_scipy_dop853_before_contact(make_steps: Steps) -> None:
    vertices, velocities, physics = thrown_sheet()
    run = make_steps(vertices, velocities, physics, FAR_BELOW, "rk4", 1e-3, 4000)
    np.testing.assert_allclose(run.x, reference(vertices, velocities, physics, 4.0), atol=1e-9)


@pytest.mark.parametrize(("integrator", "tolerance"), [("euler", 2e-3), ("rk4", 1e-10)])
def test_two_particles_swing_as_a_damped_oscillator(integrator: str, tolerance: float, make_steps: Steps) -> None:
    k_s, k_d, mass, rest, stretched = 3.0, 0.2, 0.7, 10.0, 11.0
    springs = Springs(np.array([[[rest, 0.0]]] + 3 * [[[0.0, 0.0]]]), np.array([[[k_s, 0.0]]] + 3 * [[[0.0, 0.0]]]))
    physics = system(springs, beta=k_d / k_s, mass=mass, gravity=0.0, drag=0.0)
    ends = np.array([[-stretched / 2, 0.0, 0.0], [stretched / 2, 0.0, 0.0]])
    duration, n = 5.0, 20_000
    run = make_steps(ends, np.zeros((2, 3)), physics, FAR_BELOW, integrator, duration / n, n)
    # The distance obeys s'' = -(2 / m) (k_s (s - r) + k_d s').
    gamma, omega = k_d / mass, np.sqrt(2 * k_s / mass - (k_d / mass) ** 2)
    swing = np.exp(-gamma * duration) * (np.cos(omega * duration) + gamma / omega * np.sin(omega * duration))
    exact = rest + (stretched - rest) * swing
    assert abs(run.x[0, 1] - run.x[0, 0] - exact) < tolerance
    assert abs(exact - rest) > 0.05
    assert abs(run.x[0].sum()) < 1e-12


@pytest.mark.parametrize(("integrator", "tolerance"), [("euler", 0.05), ("rk4", 1e-8)])
def test_falls_with_drag_as_the_closed_form_says(integrator: str, tolerance: float, make_steps: Steps) -> None:
    gravity, drag, duration, n = 9.0, 0.8, 3.0, 3000
    physics = free_particles(1, gravity, drag)
    run = make_steps(np.zeros((1, 3)), np.zeros((1, 3)), physics, FAR_BELOW, integrator, duration / n, n)
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


@pytest.mark.parametrize(("integrator", "stages"), [("euler", 1), ("rk4", 4)])
def test_every_force_evaluation_is_counted(integrator: str, stages: int, make_steps: Steps) -> None:
    vertices, velocities, physics = thrown_sheet()
    run = make_steps(vertices, velocities, physics, FAR_BELOW, integrator, 1e-3, 50)
    assert run.counts[EVALUATIONS] == 50 * stages


def test_butcher_table_becomes_its_nystrom_form() -> None:
    scheme = runge_kutta([[0.0, 0.0], [0.5, 0.0]], [0.0, 1.0])  # midpoint
    assert scheme.c.tolist() == [0.0, 0.5]
    assert scheme.b_x.tolist() == [0.5, 0.0]
    assert not scheme.A_x.any()


@pytest.mark.parametrize("integrator", ["euler", "rk4"])
def test_stepping_allocates_nothing(integrator: str, make_steps: Steps) -> None:
    vertices, velocities, physics = thrown_sheet()
    _nrt.memsys_enable_stats()
    try:
        allocations = []
        for n in (1, 500):
            before = rtsys.get_allocation_stats().alloc
            make_steps(vertices, velocities, physics, FAR_BELOW, integrator, 1e-3, n)
            allocations.append(rtsys.get_allocation_stats().alloc - before)
    finally:
        _nrt.memsys_disable_stats()
    assert allocations[0] == allocations[1]

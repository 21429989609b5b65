from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from deskew.flattening.forces import CHUNK, accelerate, scratch, spring_energy, system
from deskew.flattening.settings import SpringSettings
from deskew.flattening.springs import Springs, grid_springs
from deskew.types import Array, Sheet
from tests.flattening.bent_sheets import flat_grid


def equation_1(x: Array, v: Array, springs: Springs, beta: float, sign: float = -1.0) -> Array:
    """Eqs. 1 and 2 over a plain list of springs; `sign` = 1 is the equation as printed, brackets added. (V, 3)."""
    a, b, rest, k_s = springs.pairs()
    d, dv = x[a] - x[b], v[a] - v[b]
    length = np.linalg.norm(d, axis=1)
    f = k_s * (length - rest) + k_s * beta * np.einsum("ij,ij->i", dv, d) / length
    f_a = sign * (f / length)[:, None] * d
    total = np.zeros_like(x)
    np.add.at(total, a, f_a)
    np.add.at(total, b, -f_a)
    return total


def crumpled(seed: int, shape: tuple[int, int] = (9, 11)) -> tuple[Springs, Array, Array]:
    """Springs of mixed stiffness, and a moved shape and velocities (V, 3) that strain them."""
    rng = np.random.default_rng(seed)
    stiffness = rng.uniform(0.5, 2.0, (shape[0] - 1, shape[1] - 1))
    springs = grid_springs(
        Sheet(flat_grid(shape) + rng.normal(0, 0.5, (*shape, 3)), stiffness=stiffness), SpringSettings(1.0)
    )
    x = flat_grid(shape) + rng.normal(0, 0.8, (*shape, 3))
    return springs, x.reshape(-1, 3), rng.normal(0, 10.0, (shape[0] * shape[1], 3))


def forces(x: Array, v: Array, springs: Springs, beta: float, gravity: float = 0.0, drag: float = 0.0) -> Array:
    """Compiled forces at mass 2 kg, (V, 3) [mN]."""
    out = np.empty((3, len(x)))
    physics = system(springs, beta=beta, mass=2.0, gravity=gravity, drag=drag)
    accelerate(np.ascontiguousarray(x.T), np.ascontiguousarray(v.T), physics, scratch(), out)
    return 2.0 * out.T


@pytest.mark.parametrize("shape", [(2, 2), (2, 7), (7, 2), (9, 11), (31, 37)])
def test_agrees_with_equation_1_over_a_list_of_springs(shape: tuple[int, int]) -> None:
    springs, x, v = crumpled(3, shape)
    expected = equation_1(x, v, springs, 0.3) - 0.7 * v - [0.0, 0.0, 2.0 * 9.0]
    np.testing.assert_allclose(forces(x, v, springs, 0.3, gravity=9.0, drag=0.7), expected, atol=1e-11)


def test_grid_of_more_springs_than_a_chunk_is_whole() -> None:
    springs, x, v = crumpled(5, (40, 40))
    assert len(x) > 3 * CHUNK
    np.testing.assert_allclose(forces(x, v, springs, 0.1), equation_1(x, v, springs, 0.1), atol=1e-11)


def test_equation_1_as_printed_would_push_a_stretched_spring_further_apart() -> None:
    springs, x, v = crumpled(1)
    still = np.zeros_like(v)
    ours, printed = forces(x, still, springs, 0.0), equation_1(x, still, springs, 0.0, sign=1.0)
    gradient = energy_gradient(springs, x)
    assert np.vdot(ours, gradient) < 0 < np.vdot(printed, gradient)


def energy_gradient(springs: Springs, x: Array, step: float = 1e-5) -> Array:
    """Central differences of the spring energy, (V, 3)."""
    physics = system(springs, beta=0.0, mass=1.0, gravity=0.0, drag=0.0)
    gradient = np.empty_like(x)
    for i in np.ndindex(*x.shape):
        ends = []
        for sign in (1, -1):
            moved = x.copy()
            moved[i] += sign * step
            ends.append(spring_energy(np.ascontiguousarray(moved.T), physics))
        gradient[i] = (ends[0] - ends[1]) / (2 * step)
    return gradient


def test_undamped_force_is_minus_the_gradient_of_the_energy() -> None:
    springs, x, v = crumpled(2, (5, 6))
    np.testing.assert_allclose(forces(x, 0 * v, springs, 0.3), -energy_gradient(springs, x), atol=1e-7)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**31), beta=st.floats(0.0, 2.0))
def test_spring_forces_sum_to_zero_and_exert_no_torque(seed: int, beta: float) -> None:
    springs, x, v = crumpled(seed)
    f = forces(x, v, springs, beta)
    scale = np.abs(f).sum()
    assert scale > 1.0
    assert np.abs(f.sum(axis=0)).max() < 1e-13 * scale
    assert np.abs(np.cross(x, f).sum(axis=0)).max() < 1e-13 * scale * np.abs(x).max()


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**31))
def test_damping_only_takes_energy(seed: int) -> None:
    springs, x, v = crumpled(seed)
    power = np.vdot(forces(x, v, springs, 0.5) - forces(x, v, springs, 0.0), v)
    assert power < 0


@pytest.mark.parametrize("motion", ["shift", "spin"])
def test_rigid_motion_is_not_damped(motion: str) -> None:
    springs, x, _ = crumpled(4)
    v = np.broadcast_to([1.0, -2.0, 3.0], x.shape) if motion == "shift" else np.cross([1.0, -2.0, 3.0], x)
    np.testing.assert_allclose(forces(x, v, springs, 0.5), forces(x, 0 * v, springs, 0.5), atol=1e-11)


def test_sheet_at_its_rest_lengths_exerts_exactly_no_force() -> None:
    vertices = flat_grid() + np.random.default_rng(0).normal(0, 1, (9, 11, 3))
    x = vertices.reshape(-1, 3)
    assert not forces(x, np.zeros_like(x), grid_springs(Sheet(vertices), SpringSettings(3.0)), 0.3).any()


def test_stiffer_quad_changes_forces_at_its_corners_alone() -> None:
    springs, x, v = crumpled(6)
    k_s = springs.k_s.copy()
    k_s[2:, 3, 4] *= 5.0  # the quad's own diagonals
    changed = np.abs(forces(x, v, replace(springs, k_s=k_s), 0.1) - forces(x, v, springs, 0.1)).max(axis=1) > 0
    assert changed.reshape(9, 11).nonzero()[0].tolist() == [3, 3, 4, 4]
    assert changed.reshape(9, 11).nonzero()[1].tolist() == [4, 5, 4, 5]

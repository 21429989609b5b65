from __future__ import annotations

import numpy as np
import pytest

from deskew.flattening.anderson import accelerate
from deskew.types import Array

N = 40
RNG = np.random.default_rng(0)
TURN = np.linalg.qr(RNG.normal(size=(N, N)))[0]
A = TURN @ np.diag(np.linspace(0.0, 0.98, N)) @ TURN.T  # contracts, some directions slowly
FIXED = RNG.normal(size=(N // 2, 2))


def linear(x: Array) -> Array:
    return FIXED + (A @ (x - FIXED).ravel()).reshape(x.shape)


def plain(tolerance: float) -> int:
    x, n, change = np.zeros_like(FIXED), 0, np.inf
    while change > tolerance:
        image = linear(x)
        x, n, change = image, n + 1, np.abs(image - x).max()
    return n


@pytest.mark.parametrize("memory", [1, 4, 8])
def test_finds_the_fixed_point_of_a_linear_map_sooner_than_plain_iteration(memory: int) -> None:
    found = accelerate(linear, np.zeros_like(FIXED), 1e-10, 2000, memory)
    assert found.converged
    assert 0 < np.abs(found.x - FIXED).max() < 1e-8
    assert 2 < found.n_iterations < 0.5 * plain(1e-10)


def test_a_fixed_point_is_left_at_once_and_as_it_is() -> None:
    found = accelerate(linear, FIXED, 1e-12, 10)
    assert (found.n_iterations, found.converged) == (1, True)
    assert np.array_equal(found.x, linear(FIXED))


def test_too_few_iterations_do_not_count_as_converged() -> None:
    found = accelerate(linear, np.zeros_like(FIXED), 1e-10, 3)
    assert (found.n_iterations, found.converged) == (3, False)
    assert found.residual > 1e-10


def test_nonlinear_map_converges_from_afar() -> None:
    found = accelerate(np.cos, np.full((3, 1), 40.0), 1e-12, 100)
    assert found.converged
    assert np.allclose(found.x, 0.7390851332151607, rtol=0, atol=1e-10)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_not_finite_has_not_converged(value: float) -> None:
    found = accelerate(lambda x: np.full_like(x, value), np.ones((2, 2)), 1e-6, 10)
    assert (found.n_iterations, found.converged) == (1, False)

from __future__ import annotations

import sys
from collections.abc import Iterator
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from deskew.errors import InputError, StepError
from deskew.flattening import flatten
from deskew.flattening.outside import Acceleration, Outside
from deskew.flattening.schemes import INTEGRATORS
from deskew.flattening.stability import largest_stable_step
from deskew.types import Array, Sheet, Status
from tests.flattening.bent_sheets import flat_grid, mirror_folds


def leapfrog(x: Array, v: Array, acceleration: Acceleration, dt: float) -> tuple[Array, Array]:
    """Symplectic Euler, as somebody would write it."""
    v = v + dt * acceleration(x, v)
    return x + dt * v, v


@pytest.fixture
def plugin() -> Iterator[str]:
    """Return a module of integrators, good and bad."""
    module = ModuleType("own_integrators")
    odd: dict[str, Any] = {
        "leapfrog": leapfrog,
        "alone": lambda x, v, acceleration, dt: x,
        "wrong_shape": lambda x, v, acceleration, dt: (x.T, v),
        "no_arrays": lambda x, v, acceleration, dt: (x.tolist(), v),
        "breaks": lambda x, v, acceleration, dt: 1 / 0,
        "a_number": 3,
    }
    for name, value in odd.items():
        setattr(module, name, value)
    sys.modules["own_integrators"] = module
    yield "own_integrators"
    del sys.modules["own_integrators"]


def test_integrator_from_outside_ends_where_the_built_in_one_does(plugin: str) -> None:
    sheet = Sheet(mirror_folds(5, (13, 16), n_folds=2)[0])
    own = flatten(sheet, method="particles", integrator=f"{plugin}:leapfrog")
    built_in = flatten(sheet, method="particles", integrator="symplectic_euler")
    assert own.status is built_in.status is Status.AT_REST
    for name in ("steps", "steps_rejected", "force_evaluations"):
        assert own.counters[name] == pytest.approx(built_in.counters[name], rel=0.1)
    assert own.counters["dt"] == pytest.approx(built_in.counters["dt"], rel=1e-6)
    np.testing.assert_allclose(own.vertices, built_in.vertices, atol=1e-3)


def test_stable_step_of_an_integrator_from_outside_is_found_by_trying_it() -> None:
    limit = largest_stable_step(Outside("own:leapfrog", leapfrog), 9.0, 0.1, 0.02)
    assert limit == pytest.approx(largest_stable_step(INTEGRATORS["symplectic_euler"], 9.0, 0.1, 0.02), rel=1e-9)


@pytest.mark.parametrize(
    ("function", "said"),
    [
        ("alone", r"must return two arrays of shape \(3, 48\), got ndarray"),
        ("wrong_shape", r"must return two arrays of shape \(3, 48\), got \(48, 3\), \(3, 48\)"),
        ("no_arrays", r"must return two arrays of shape \(3, 48\), got list, \(3, 48\)"),
        ("breaks", "failed: ZeroDivisionError: division by zero"),
    ],
)
def test_integrator_that_returns_rubbish_is_named(plugin: str, function: str, said: str) -> None:
    with pytest.raises(StepError, match=f"A step by `{plugin}:{function}` {said}"):
        flatten(Sheet(flat_grid()), method="particles", integrator=f"{plugin}:{function}")


@pytest.mark.parametrize("name", ["heun", "own_integrators:", "own_integrators:a_number", "no_such_module:step", 4])
def test_unknown_integrator_is_refused(plugin: str, name: Any) -> None:
    with pytest.raises(InputError, match="`integrator` must"):
        flatten(Sheet(flat_grid()), method="particles", integrator=name)

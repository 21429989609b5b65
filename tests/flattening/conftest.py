"""A run of equal steps, for tests of the stepping loop alone."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from deskew.flattening.contact import Plane
from deskew.flattening.forces import System
from deskew.flattening.integrators import STEPS, Pace, Run, advance, start
from deskew.flattening.schemes import INTEGRATORS
from deskew.types import Array


@pytest.fixture(scope="session")
def make_steps() -> Callable[..., Run]:
    """Advance particles by a fixed number of equal steps and return the run."""

    def advanced(
        vertices: Array, velocities: Array, physics: System, plane: Plane, integrator: str, dt: float, n: int
    ) -> Run:
        scheme = INTEGRATORS[integrator]
        run = start(vertices, scheme, dt)
        run.v[:] = velocities.reshape(-1, 3).T
        assert advance(run, scheme, physics, plane, Pace(dt, dt, 1e9), n)
        assert run.counts[STEPS] == n
        return run

    return advanced

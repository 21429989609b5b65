"""Integrators from outside: a function that makes one step, under the same contact and halving as the built-in ones."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from deskew.errors import StepError, in_one_line
from deskew.flattening.contact import Plane, sunk
from deskew.flattening.forces import System, accelerate
from deskew.flattening.integrators import EVALUATIONS, STEPS, Pace, Run, finish, reject
from deskew.types import Array

Acceleration = Callable[[Array, Array], Array]
Step = Callable[[Array, Array, Acceleration, float], tuple[Array, Array]]


@dataclass(frozen=True, slots=True)
class Outside:
    """An integrator that somebody else wrote.

    Attributes
    ----------
    name : str
        `package.module:function`.
    step : callable
        ``step(x, v, acceleration, dt)`` returns positions and velocities after `dt`; all are (3, N) arrays and
        ``acceleration(x, v)`` gives one, too. It may call that as often as it likes, and keep nothing.
    """

    name: str
    step: Step

    def __call__(self, x: Array, v: Array, acceleration: Acceleration, dt: float) -> tuple[Array, Array]:
        """Make a step and check what comes back.

        Raises
        ------
        StepError
            If the function raises, or returns something else than two arrays of numbers of the shape of `x`.
        """
        try:
            result: Any = self.step(x.copy(), v.copy(), acceleration, dt)
        except (Exception, SystemExit) as error:
            raise StepError(f"A step by `{self.name}` failed: {in_one_line(error)}.") from error
        pair = result if isinstance(result, tuple) else ()
        arrays = [part for part in pair if isinstance(part, np.ndarray) and part.dtype.kind in "fiu"]
        if len(pair) != 2 or len(arrays) != 2 or any(part.shape != x.shape for part in arrays):
            got = ", ".join(str(getattr(part, "shape", type(part).__name__)) for part in pair) or type(result).__name__
            raise StepError(f"A step by `{self.name}` must return two arrays of shape {x.shape}, got {got}.")
        return arrays[0].astype(np.float64), arrays[1].astype(np.float64)


def advance_outside(run: Run, integrator: Outside, physics: System, plane: Plane, pace: Pace, n_steps: int) -> bool:
    """Make `n_steps` accepted steps; arguments and result as of :func:`.integrators.advance`."""

    def acceleration(x: Array, v: Array) -> Array:
        out = np.empty_like(run.x)
        x, v = (np.ascontiguousarray(rows, dtype=np.float64).reshape(out.shape) for rows in (x, v))
        accelerate(x, v, physics, run.work, out)
        run.counts[EVALUATIONS] += 1
        return out

    target = run.counts[STEPS] + n_steps
    while run.counts[STEPS] < target:
        h = float(run.clock[0])
        x, v = integrator(run.x, run.v, acceleration, h)
        if sunk(np.ascontiguousarray(x[2]), plane) > 0:
            if h > pace.dt_min:
                reject(run, h / 2, pace)
                continue
            if plane.literal:
                return False
        run.x[:], run.v[:] = x, v
        finish(run, physics, plane, pace, h, 0.0)
    return True

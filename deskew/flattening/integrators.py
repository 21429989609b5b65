"""Integrators as tables of coefficients, and the one loop that steps them all (section 3.4).

Every explicit scheme for x'' = a(x, x') that keeps only accelerations has the Runge-Kutta-Nystrom form

    X_i = x + c_i h v + h^2 sum_j A_x[i, j] a_j        V_i = v + h sum_j A_v[i, j] a_j        a_i = a(X_i, V_i)
    x'  = x +     h v + h^2 sum_j b_x[j] a_j           v'  = v + h sum_j b_v[j] a_j

so a new integrator is a new table. A Runge-Kutta method (A, b) is the table with A_x = A A, b_x = b A, c = A 1.

References
----------
.. [1] Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, section II.14.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, uintp

from deskew.flattening.contact import GOOD_STEPS, collide, sunk
from deskew.flattening.forces import accelerate, scratch
from deskew.types import Array


class Scheme(NamedTuple):
    """An explicit integrator of S stages.

    Attributes
    ----------
    c : (S,) array
        When each stage is evaluated, in steps.
    A_x, A_v : (S, S) arrays
        Strictly lower triangular weights of earlier accelerations in a stage's position and velocity.
    b_x, b_v : (S,) arrays
        Weights of the accelerations in the new position and velocity.
    """

    c: Array
    A_x: Array
    A_v: Array
    b_x: Array
    b_v: Array


def runge_kutta(butcher: list[list[float]], weights: list[float]) -> Scheme:
    """Make the scheme of an explicit Runge-Kutta method with Butcher coefficients A : (S, S) and weights b : (S,)."""
    A, b = np.array(butcher), np.array(weights)
    return Scheme(A.sum(axis=1), A @ A, A, b @ A, b)


INTEGRATORS = {
    "euler": runge_kutta([[0.0]], [1.0]),
    "rk4": runge_kutta(
        [[0.0, 0.0, 0.0, 0.0], [0.5, 0.0, 0.0, 0.0], [0.0, 0.5, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]],
        [1 / 6, 1 / 3, 1 / 3, 1 / 6],
    ),
}


class Run(NamedTuple):
    """A run in progress; the arrays are changed in place by `advance`.

    Attributes
    ----------
    x, v : (3, V) arrays
        Positions [mm] and velocities [mm/s].
    clock : (3,) array
        Step in use, time since the start, smallest step made [s].
    counts : (5,) int array
        Steps, steps rejected, force evaluations, contacts, good steps since the last halving.
    accelerations : (S, 3, V) array
        Of the stages [mm/s^2].
    stage : (2, 3, V) array
        Position and velocity of the stage under way.
    work : (12, CHUNK) array
        Scratch of the force pass.
    """

    x: Array
    v: Array
    clock: Array
    counts: Array
    accelerations: Array
    stage: Array
    work: Array


STEPS, REJECTED, EVALUATIONS, CONTACTS, GOOD = range(5)


def start(vertices: Array, scheme: Scheme, dt: float) -> Run:
    """Make the arrays of a run that begins at rest at `vertices` : (..., 3) [mm] with step `dt` [s]."""
    x = np.ascontiguousarray(vertices.reshape(-1, 3).T, dtype=np.float64)
    accelerations = np.zeros((len(scheme.c), *x.shape))
    clock = np.array([dt, 0.0, dt])
    return Run(x, np.zeros_like(x), clock, np.zeros(5, np.int64), accelerations, np.zeros((2, *x.shape)), scratch())


@njit(cache=True, error_model="numpy")
def _sum(rows, weight, terms, out):  # type: ignore[no-untyped-def]
    """Write rows + weight * terms into out, all (3, V); out may be rows itself."""
    for axis in range(3):
        for i in range(uintp(rows.shape[1])):
            out[axis, i] = rows[axis, i] + weight * terms[axis, i]


@njit(cache=True, error_model="numpy")
def _copy(rows, out):  # type: ignore[no-untyped-def]
    """Copy rows into out, both (3, V); a slice assignment takes seconds longer to compile."""
    for axis in range(3):
        for i in range(uintp(rows.shape[1])):
            out[axis, i] = rows[axis, i]


@njit(cache=True, error_model="numpy")
def _stages(run, scheme, physics, h, first):  # type: ignore[no-untyped-def]
    """Evaluate the accelerations of stages first, first + 1, ...; stage 0 is the state itself."""
    for i in range(first, scheme.c.shape[0]):
        X, V = run.x, run.v
        if i > 0:
            X, V = run.stage[0], run.stage[1]
            _sum(run.x, scheme.c[i] * h, run.v, X)
            _sum(run.v, scheme.A_v[i, 0] * h, run.accelerations[0], V)
            for j in range(i):
                if scheme.A_x[i, j] != 0.0:
                    _sum(X, scheme.A_x[i, j] * h * h, run.accelerations[j], X)
                if scheme.A_v[i, j] != 0.0 and j > 0:
                    _sum(V, scheme.A_v[i, j] * h, run.accelerations[j], V)
        accelerate(X, V, physics, run.work, run.accelerations[i])
        run.counts[EVALUATIONS] += 1


@njit(cache=True, error_model="numpy")
def advance(run, scheme, physics, plane, dt_max, dt_min, n_steps):  # type: ignore[no-untyped-def]
    """Make `n_steps` accepted steps.

    Parameters
    ----------
    run : Run
        Changed in place.
    scheme : Scheme
        The integrator.
    physics : System
        What exerts force.
    plane : Plane
        What the particles collide with.
    dt_max, dt_min : float
        The step is halved from `dt_max` but not below `dt_min` [s].
    n_steps : int
        Steps to accept.

    Returns
    -------
    bool
        False if literal halving collapsed: the step fell under `dt_min` and no step was acceptable.
    """
    X = run.stage[0]
    first = 0
    target = run.counts[STEPS] + n_steps
    while run.counts[STEPS] < target:
        h = run.clock[0]
        _stages(run, scheme, physics, h, first)
        first = 1  # stage 0 does not depend on the step: a rejected one does not void it
        _sum(run.x, h, run.v, X)
        for j in range(scheme.c.shape[0]):
            if scheme.b_x[j] != 0.0:
                _sum(X, scheme.b_x[j] * h * h, run.accelerations[j], X)
        if sunk(X[2], plane) > 0:
            if h > dt_min:
                run.clock[0] = h / 2
                run.counts[REJECTED] += 1
                run.counts[GOOD] = 0
                continue
            if plane.literal:
                return False
        _copy(X, run.x)
        for j in range(scheme.c.shape[0]):
            _sum(run.v, scheme.b_v[j] * h, run.accelerations[j], run.v)
        run.counts[CONTACTS] += collide(run.x[2], run.v[2], plane, physics.gravity, h)
        first = 0
        run.counts[STEPS] += 1
        run.counts[GOOD] += 1
        run.clock[1] += h
        run.clock[2] = min(run.clock[2], h)
        if h < dt_max and run.counts[GOOD] >= GOOD_STEPS and not plane.literal:
            run.clock[0] = min(2 * h, dt_max)
            run.counts[GOOD] = 0
    return True

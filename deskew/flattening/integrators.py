"""The one loop that steps every integrator: stages, error control, contact, step halving (sections 3.3.2 and 3.4)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, uintp

from deskew.flattening.contact import GOOD_STEPS, collide, deepest, sunk
from deskew.flattening.forces import accelerate, scratch
from deskew.flattening.implicit import N_KRYLOV, implicit_euler
from deskew.flattening.schemes import Scheme
from deskew.types import Array

# What the next step of an embedded pair may be, in units of this one, and how cautiously it is aimed at (Hairer, II.4).
_SHRINK, _GROW, _CAUTION = 0.2, 5.0, 0.9


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
    lowest : (1,) array
        Lowest height that a step made has brought a particle to, before contact lifted it [mm].
    accelerations : (S, 3, V) array
        Of the stages [mm/s^2].
    stage : (2, 3, V) array
        Position and velocity of the stage under way.
    krylov : (N, 3, V) array
        Vectors of the implicit solve; V is 0 for an explicit scheme.
    work : (12, CHUNK) array
        Scratch of the force pass.
    """

    x: Array
    v: Array
    clock: Array
    counts: Array
    lowest: Array
    accelerations: Array
    stage: Array
    krylov: Array
    work: Array


class Pace(NamedTuple):
    """Which steps a run may take.

    Attributes
    ----------
    dt_max, dt_min : float
        The step is halved from `dt_max`, but not below `dt_min` [s].
    tolerance : float
        Estimated error that a step may make in any coordinate [mm], and in velocity times step; of an embedded pair.
    """

    dt_max: float
    dt_min: float
    tolerance: float = 1.0


STEPS, REJECTED, EVALUATIONS, CONTACTS, GOOD = range(5)


def start(vertices: Array, scheme: Scheme, dt: float) -> Run:
    """Make the arrays of a run that begins at rest at `vertices` : (..., 3) [mm] with step `dt` [s]."""
    x = np.array(vertices.reshape(-1, 3).T, dtype=np.float64, order="C")
    accelerations = np.zeros((len(scheme.c), *x.shape))
    krylov = np.zeros((N_KRYLOV, 3, x.shape[1] if scheme.implicit else 0))
    clock, counts, lowest = np.array([dt, 0.0, dt]), np.zeros(5, np.int64), np.zeros(1)
    v, stage = np.zeros_like(x), np.zeros((2, *x.shape))
    return Run(x, v, clock, counts, lowest, accelerations, stage, krylov, scratch())


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
def _estimated_error(run, scheme, h):  # type: ignore[no-untyped-def]
    """Largest difference to the embedded method in any coordinate, and in velocity times step [mm]."""
    largest = 0.0
    for axis in range(3):
        for i in range(run.x.shape[1]):
            in_place, in_motion = 0.0, 0.0  # of the acceleration
            for j in range(scheme.c.shape[0]):
                in_place += scheme.e_x[j] * run.accelerations[j, axis, i]
                in_motion += scheme.e_v[j] * run.accelerations[j, axis, i]
            error = h * h * max(abs(in_place), abs(in_motion))
            if not error <= largest:  # NaN is an error, too
                largest = error
    return largest


@njit(cache=True, error_model="numpy")
def _propose(run, scheme, physics, plane, h, first):  # type: ignore[no-untyped-def]
    """Write the new positions into stage[0]; those of an implicit step with the new velocities in stage[1]."""
    if scheme.implicit:
        run.counts[EVALUATIONS] += implicit_euler(run, physics, plane, h)
        return
    _stages(run, scheme, physics, h, first)
    X = run.stage[0]
    _sum(run.x, h, run.v, X)
    for j in range(scheme.c.shape[0]):
        if scheme.b_x[j] != 0.0:
            _sum(X, scheme.b_x[j] * h * h, run.accelerations[j], X)


@njit(cache=True, error_model="numpy")
def _accept(run, scheme, h):  # type: ignore[no-untyped-def]
    """Make the proposed state the state."""
    _copy(run.stage[0], run.x)
    if scheme.implicit:
        _copy(run.stage[1], run.v)
        return
    for j in range(scheme.c.shape[0]):
        if scheme.b_v[j] != 0.0:
            _sum(run.v, scheme.b_v[j] * h, run.accelerations[j], run.v)


@njit(cache=True, error_model="numpy")
def reject(run, dt, pace):  # type: ignore[no-untyped-def]
    """Have the step made again in `dt` [s]."""
    run.clock[0] = max(dt, pace.dt_min)
    run.counts[REJECTED] += 1
    run.counts[GOOD] = 0


@njit(cache=True, error_model="numpy")
def finish(run, physics, plane, pace, h, growth):  # type: ignore[no-untyped-def]
    """Collide with the plane, count the step of `h` [s], choose the next; return how many particles struck.

    An error estimate lets the next step be `growth` times this one; 0 stands for none: halved steps double again.
    """
    run.lowest[0] = deepest(run.x[2], run.lowest[0])
    struck = collide(run.x[2], run.v[2], plane, physics.gravity, h)
    run.counts[CONTACTS] += struck
    run.counts[STEPS] += 1
    run.counts[GOOD] += 1
    run.clock[1] += h
    run.clock[2] = min(run.clock[2], h)
    may_grow = run.counts[GOOD] >= GOOD_STEPS and not plane.literal
    if growth > 0.0:
        run.clock[0] = min(h * min(growth, _GROW if may_grow else 1.0), pace.dt_max)
    elif h < pace.dt_max and may_grow:
        run.clock[0] = min(2 * h, pace.dt_max)
        run.counts[GOOD] = 0
    return struck


@njit(cache=True, error_model="numpy")
def advance(run, scheme, physics, plane, pace, n_steps):  # type: ignore[no-untyped-def]
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
    pace : Pace
        Limits of the step.
    n_steps : int
        Steps to accept.

    Returns
    -------
    bool
        False if literal halving collapsed: the step fell under `dt_min` and no step was acceptable.
    """
    first = 0
    target = run.counts[STEPS] + n_steps
    while run.counts[STEPS] < target:
        h = run.clock[0]
        _propose(run, scheme, physics, plane, h, first)
        first = 1  # stage 0 does not depend on the step: a rejected one does not void it
        growth = 0.0
        if scheme.estimate > 0:
            error = _estimated_error(run, scheme, h) / pace.tolerance
            growth = _SHRINK
            if error >= 0.0:
                growth = max(_SHRINK, _CAUTION * max(error, 1e-12) ** (-1.0 / (scheme.estimate + 1)))
            if not error <= 1.0 and h > pace.dt_min:
                reject(run, h * growth, pace)
                continue
        if sunk(run.stage[0][2], plane) > 0:
            if h > pace.dt_min:
                reject(run, h / 2, pace)
                continue
            if plane.literal:
                return False
        _accept(run, scheme, h)
        struck = finish(run, physics, plane, pace, h, growth)
        first = 0
        if scheme.reuses and struck == 0:
            _copy(run.accelerations[scheme.c.shape[0] - 1], run.accelerations[0])
            first = 1
    return True

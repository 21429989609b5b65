"""Implicit Euler for large steps, after Baraff and Witkin (the paper's reference [1]), on the springs of a grid.

A step solves, linearised about its beginning and divided by the mass,

    (1 - h da/dv - h^2 da/dx) dv = h (a + h da/dx v),        v' = v + dv,        x' = x + h v'

by conjugate gradients. Of a spring's stiffness the part across it is dropped while it is compressed, which would make
the matrix indefinite (Choi and Ko, Stable but responsive cloth, SIGGRAPH 2002). Where the plane is in the way, a
particle's height is no unknown: it ends on the plane, and the search's directions are filtered of it (section 5.3 of
their paper).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from deskew.flattening.forces import accelerate, spring_offsets

N_KRYLOV = 5
_RESIDUAL, _N_PRODUCTS = 1e-5, 500
# Searches for which particles end on the plane; those that still sink then are left to step halving.
_N_CONTACT = 4


@njit(cache=True, error_model="numpy")
def _stiffen(x, p, physics, along, across, out):  # type: ignore[no-untyped-def]
    """Add the springs' K / m times p : (3, V), its part along each spring times `along`, that across times `across`."""
    n = x.shape[1]
    for family in range(len(physics.k_s)):
        tail, head = spring_offsets(family, physics.columns)
        for i in range(n - max(tail, head)):
            k_s = physics.k_s[family, i]
            if k_s <= 0.0:
                continue
            a, b = i + tail, i + head
            dx, dy, dz = x[0, b] - x[0, a], x[1, b] - x[1, a], x[2, b] - x[2, a]
            squared = dx * dx + dy * dy + dz * dz
            px, py, pz = p[0, b] - p[0, a], p[1, b] - p[1, a], p[2, b] - p[2, a]
            slack = max(0.0, 1.0 - physics.rest[family, i] / np.sqrt(squared)) * across
            turned = (along - slack) * (dx * px + dy * py + dz * pz) / squared
            unit = k_s / physics.mass
            fx, fy, fz = (
                unit * (turned * dx + slack * px),
                unit * (turned * dy + slack * py),
                unit * (turned * dz + slack * pz),
            )
            out[0, a], out[0, b] = out[0, a] - fx, out[0, b] + fx
            out[1, a], out[1, b] = out[1, a] - fy, out[1, b] + fy
            out[2, a], out[2, b] = out[2, a] - fz, out[2, b] + fz


@njit(cache=True, error_model="numpy")
def _product(run, physics, h, p, out):  # type: ignore[no-untyped-def]
    """Write (1 - h da/dv - h^2 da/dx) p into out, both (3, V)."""
    slowed = 1.0 + h * physics.drag / physics.mass
    for axis in range(3):
        for i in range(p.shape[1]):
            out[axis, i] = slowed * p[axis, i]
    _stiffen(run.x, p, physics, h * (physics.beta + h), h * h, out)


@njit(cache=True, error_model="numpy")
def _filtered_dot(a, b, landed):  # type: ignore[no-untyped-def]
    """Scalar product of two (3, V) fields without the heights of particles that have landed."""
    total = 0.0
    for i in range(a.shape[1]):
        total += a[0, i] * b[0, i] + a[1, i] * b[1, i]
        if landed[i] == 0.0:
            total += a[2, i] * b[2, i]
    return total


@njit(cache=True, error_model="numpy")
def _solve(run, physics, h, right, landed):  # type: ignore[no-untyped-def]
    """Improve dv = krylov[0] by conjugate gradients; return the products with the matrix that it took."""
    dv, residual, direction, product = run.krylov[0], run.krylov[1], run.krylov[2], run.krylov[3]
    _product(run, physics, h, dv, product)
    for axis in range(3):
        for i in range(dv.shape[1]):
            residual[axis, i] = right[axis, i] - product[axis, i]
            direction[axis, i] = residual[axis, i] if axis < 2 or landed[i] == 0.0 else 0.0
    size = _filtered_dot(residual, residual, landed)
    enough = _RESIDUAL**2 * _filtered_dot(right, right, landed)
    n_products = 1
    while size > enough and n_products < _N_PRODUCTS:
        _product(run, physics, h, direction, product)
        n_products += 1
        step = size / _filtered_dot(direction, product, landed)
        for axis in range(3):
            for i in range(dv.shape[1]):
                dv[axis, i] += step * direction[axis, i]
                residual[axis, i] -= step * product[axis, i]
        before, size = size, _filtered_dot(residual, residual, landed)
        for axis in range(3):
            for i in range(dv.shape[1]):
                free = axis < 2 or landed[i] == 0.0
                direction[axis, i] = residual[axis, i] + size / before * direction[axis, i] if free else 0.0
    return n_products


@njit(cache=True, error_model="numpy")
def _land(run, plane, h, landed):  # type: ignore[no-untyped-def]
    """Stop at the plane the particles that dv takes below it; return how many are new: none under literal halving."""
    dv, new = run.krylov[0], 0
    if plane.literal or plane.eps < 0.0:
        return new
    for i in range(dv.shape[1]):
        if landed[i] == 0.0 and run.x[2, i] + h * (run.v[2, i] + dv[2, i]) < 0.0:
            landed[i] = 1.0
            dv[2, i] = -run.v[2, i] - run.x[2, i] / h
            new += 1
    return new


@njit(cache=True, error_model="numpy")
def implicit_euler(run, physics, plane, h):  # type: ignore[no-untyped-def]
    """Propose one step: new positions to stage[0], new velocities to stage[1].

    Parameters
    ----------
    run : Run
        Its `krylov`, `stage` and `accelerations` are changed.
    physics : System
        What exerts force.
    plane : Plane
        What particles land on.
    h : float
        Step [s].

    Returns
    -------
    int
        Force evaluations and products with the stiffness, which cost as much.
    """
    a, right = run.accelerations[0], run.stage[0]
    dv, landed = run.krylov[0], run.krylov[4, 0]
    accelerate(run.x, run.v, physics, run.work, a)
    for axis in range(3):
        for i in range(dv.shape[1]):
            right[axis, i] = 0.0
    _stiffen(run.x, run.v, physics, h * h, h * h, right)
    for axis in range(3):
        for i in range(dv.shape[1]):
            right[axis, i] = h * a[axis, i] - right[axis, i]
            dv[axis, i] = 0.0
            landed[i] = 0.0
    n_evaluations = 2
    for _ in range(_N_CONTACT):
        n_evaluations += _solve(run, physics, h, right, landed)
        if _land(run, plane, h, landed) == 0:
            break
    for axis in range(3):
        for i in range(dv.shape[1]):
            run.stage[1][axis, i] = run.v[axis, i] + dv[axis, i]
            run.stage[0][axis, i] = run.x[axis, i] + h * run.stage[1][axis, i]
    return n_evaluations

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
from numba import njit, uintp

from deskew.flattening.forces import CHUNK, accelerate, hand_out, spring_offsets

N_KRYLOV = 5
_RESIDUAL, _N_PRODUCTS = 1e-5, 500
# Searches for which particles end on the plane; those that still sink then are left to step halving.
_N_CONTACT = 4


@njit(cache=True, error_model="numpy", inline="always")
def _stiff_pull(x, p, k_s, rest, along, across, tail, head, start, stop, pulls, slot):  # type: ignore[no-untyped-def]
    """Write what a displacement p of springs start..stop does to their tails, against it, into three rows of pulls."""
    for j in range(uintp(stop - start)):
        i = j + uintp(start)
        a, b = i + uintp(tail), i + uintp(head)
        dx, dy, dz = x[0, b] - x[0, a], x[1, b] - x[1, a], x[2, b] - x[2, a]
        px, py, pz = p[0, b] - p[0, a], p[1, b] - p[1, a], p[2, b] - p[2, a]
        squared = dx * dx + dy * dy + dz * dz
        sideways = across * k_s[i] * max(0.0, 1.0 - rest[i] / np.sqrt(squared))
        lengthways = (along * k_s[i] - sideways) * (dx * px + dy * py + dz * pz) / squared
        there = k_s[i] > 0.0
        pulls[slot, j] = -(lengthways * dx + sideways * px) if there else 0.0
        pulls[slot + 1, j] = -(lengthways * dy + sideways * py) if there else 0.0
        pulls[slot + 2, j] = -(lengthways * dz + sideways * pz) if there else 0.0


@njit(cache=True, error_model="numpy")
def _stiffen(x, p, physics, along, across, work, out):  # type: ignore[no-untyped-def]
    """Add K / m times p : (3, V), each spring's part along itself times `along`, the one across times `across`."""
    n, columns, k_s, rest = x.shape[1], physics.columns, physics.k_s, physics.rest
    along, across = along / physics.mass, across / physics.mass
    for start in range(0, n, CHUNK):
        row = max(start, min(start + CHUNK, n - 1))
        down = max(start, min(start + CHUNK, n - columns))
        shear = max(start, min(start + CHUNK, n - columns - 1))
        _stiff_pull(x, p, k_s[0], rest[0], along, across, 0, 1, start, row, work, 0)
        _stiff_pull(x, p, k_s[1], rest[1], along, across, 0, columns, start, down, work, 3)
        _stiff_pull(x, p, k_s[2], rest[2], along, across, 0, columns + 1, start, shear, work, 6)
        _stiff_pull(x, p, k_s[3], rest[3], along, across, columns, 1, start, shear, work, 9)
        hand_out(work, start, row - start, down - start, shear - start, columns, out)
    for family in range(4, len(k_s)):
        tail, head = spring_offsets(family, columns)
        for i in range(n - max(tail, head)):
            _stiff_pull(x, p, k_s[family], rest[family], along, across, tail, head, i, i + 1, work, 0)
            for axis in range(3):
                out[axis, i + tail] += work[axis, 0]
                out[axis, i + head] -= work[axis, 0]


@njit(cache=True, error_model="numpy")
def _product(run, physics, h, p, out):  # type: ignore[no-untyped-def]
    """Write (1 - h da/dv - h^2 da/dx) p into out, both (3, V)."""
    slowed = 1.0 + h * physics.drag / physics.mass
    for axis in range(3):
        for i in range(p.shape[1]):
            out[axis, i] = slowed * p[axis, i]
    _stiffen(run.x, p, physics, h * (physics.beta + h), h * h, run.work, out)


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
def _clear(rows):  # type: ignore[no-untyped-def]
    """Set (3, V) to 0."""
    for axis in range(3):
        for i in range(uintp(rows.shape[1])):
            rows[axis, i] = 0.0


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
    a, right, dv, landed = run.accelerations[0], run.stage[0], run.krylov[0], run.krylov[4, 0]
    accelerate(run.x, run.v, physics, run.work, a)
    _clear(right)
    _stiffen(run.x, run.v, physics, h * h, h * h, run.work, right)
    for axis in range(3):
        for i in range(dv.shape[1]):
            right[axis, i] = h * a[axis, i] - right[axis, i]
    _clear(run.krylov[0])
    _clear(run.krylov[4])
    n_evaluations = 2
    for _ in range(_N_CONTACT):
        n_evaluations += _solve(run, physics, h, right, landed)
        if _land(run, plane, h, landed) == 0:
            break
    X, V = run.stage[0], run.stage[1]
    for axis in range(3):
        for i in range(dv.shape[1]):
            V[axis, i] = run.v[axis, i] + dv[axis, i]
            X[axis, i] = run.x[axis, i] + h * V[axis, i]
    for i in range(dv.shape[1]):
        if landed[i] != 0.0:  # it strikes the plane as fast as it would have without one: restitution is for `collide`
            V[2, i] = min(run.v[2, i] + h * a[2, i], 0.0)
    return n_evaluations

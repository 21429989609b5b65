"""Forces on the particles: springs (eqs. 1 and 2), downward force and drag (section 3.3.1).

Equation 1 as printed lacks two things. The scalar product needs brackets, and the whole needs a leading minus sign: as
printed, a stretched spring would push its ends further apart and the system would explode. What is meant, and done:

    f_a = -[ k_s (|x_a - x_b| - r) + k_d ((v_a - v_b) . (x_a - x_b)) / |x_a - x_b| ] (x_a - x_b) / |x_a - x_b|

Positions, velocities and accelerations are structures of arrays, (3, V) with V = R C vertices row after row. A spring
family joins vertex i to vertex i + a constant, so the pass runs straight through memory in vector instructions; the
springs that would wrap from a row's end to the next row's start have k_s = 0 and are masked. A spring is evaluated
once: a chunk of forces stays in the first-level cache until both ends have had their share.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, uintp

from deskew.flattening.springs import Springs
from deskew.types import Array

# Springs of each family that are held before they are handed out: 12 rows of this many doubles fill 48 KB.
CHUNK = 512


class System(NamedTuple):
    """What exerts force: the springs and the surroundings, as plain arrays and numbers for the compiled passes.

    Attributes
    ----------
    rest, k_s : (F, V) arrays
        Rest lengths [mm] and spring constants [kg/s^2], by family, as in `Springs`; F is 4 or 8.
    columns : int
        Vertices in a row of the grid.
    beta : float
        Spring damping over spring constant, k_d / k_s [s]: a softer spring of a mixed sheet is damped less.
    mass : float
        Of one particle [kg].
    gravity : float
        Downward acceleration [mm/s^2].
    drag : float
        Viscous drag mu_d [kg/s].
    """

    rest: Array
    k_s: Array
    columns: int
    beta: float
    mass: float
    gravity: float
    drag: float


def system(springs: Springs, *, beta: float, mass: float, gravity: float, drag: float) -> System:
    """Lay springs out for the compiled passes; units as in `System`."""
    rest = np.ascontiguousarray(springs.rest, dtype=np.float64).reshape(len(springs.rest), -1)
    k_s = np.ascontiguousarray(springs.k_s, dtype=np.float64).reshape(rest.shape)
    return System(rest, k_s, springs.grid[1], float(beta), float(mass), float(gravity), float(drag))


def scratch() -> Array:
    """Work array that `accelerate` needs, to be made once for a whole run."""
    return np.zeros((12, CHUNK))


@njit(cache=True, error_model="numpy", inline="always")
def _pull(x, v, k_s, rest, beta, inverse_mass, tail, head, start, stop, pulls, slot):  # type: ignore[no-untyped-def]
    """Write what springs start..stop do to their tails into pulls[slot : slot + 3] (eq. 1, over the mass)."""
    for j in range(uintp(stop - start)):
        i = j + uintp(start)
        a = i + uintp(tail)
        b = i + uintp(head)
        dx = x[0, b] - x[0, a]
        dy = x[1, b] - x[1, a]
        dz = x[2, b] - x[2, a]
        squared = dx * dx + dy * dy + dz * dz
        length = np.sqrt(squared)
        closing = (v[0, b] - v[0, a]) * dx + (v[1, b] - v[1, a]) * dy + (v[2, b] - v[2, a]) * dz
        # length - rest is formed first: an unmoved spring must exert exactly nothing.
        scale = k_s[i] * ((length - rest[i]) * length + beta * closing) / squared * inverse_mass
        scale = scale if k_s[i] > 0.0 else 0.0
        pulls[slot, j] = scale * dx
        pulls[slot + 1, j] = scale * dy
        pulls[slot + 2, j] = scale * dz


@njit(cache=True, error_model="numpy", inline="always")
def hand_out(pulls, start, n_row, n_down, n_shear, columns, out):  # type: ignore[no-untyped-def]
    """Add a chunk's pulls to its tails and subtract them from its heads (eq. 2)."""
    # In the last rows the downward families end earlier than the rows do.
    pulls[3:6, n_down:n_row] = 0.0
    pulls[6:12, n_shear:n_row] = 0.0
    for axis in range(3):
        row, down = pulls[axis], pulls[3 + axis]
        falling, rising = pulls[6 + axis], pulls[9 + axis]
        for j in range(uintp(n_row)):
            out[axis, j + uintp(start)] += row[j] + down[j] + falling[j]
        for j in range(uintp(n_row)):
            out[axis, j + uintp(start + 1)] -= row[j] + rising[j]
        for j in range(uintp(n_down)):
            out[axis, j + uintp(start + columns)] += rising[j] - down[j]
        for j in range(uintp(n_shear)):
            out[axis, j + uintp(start + columns + 1)] -= falling[j]


@njit(cache=True, error_model="numpy", inline="always")
def spring_offsets(family, columns):  # type: ignore[no-untyped-def]
    """Return where a family's springs begin and end, counted in vertices from the one that they are stored at."""
    steps = 1 if family < 4 else 2
    tail = steps * columns if family % 4 == 3 else 0
    head = steps * (1, columns, columns + 1, 1)[family % 4]
    return tail, head


@njit(cache=True, error_model="numpy")
def _pull_far(x, v, physics, inverse_mass, out):  # type: ignore[no-untyped-def]
    """Add what the springs of two steps do (eqs. 1 and 2); few use them, so they take the plain way."""
    for family in range(4, len(physics.k_s)):
        tail, head = spring_offsets(family, physics.columns)
        for i in range(x.shape[1] - max(tail, head)):
            k_s = physics.k_s[family, i]
            if k_s > 0.0:
                a, b = i + tail, i + head
                squared, closing = 0.0, 0.0
                for axis in range(3):
                    squared += (x[axis, b] - x[axis, a]) ** 2
                    closing += (v[axis, b] - v[axis, a]) * (x[axis, b] - x[axis, a])
                length = np.sqrt(squared)
                scale = k_s * ((length - physics.rest[family, i]) * length + physics.beta * closing) / squared
                for axis in range(3):
                    pull = scale * inverse_mass * (x[axis, b] - x[axis, a])
                    out[axis, a] += pull
                    out[axis, b] -= pull


@njit(cache=True, error_model="numpy", inline="always")
def _begin(v, physics, inverse_mass, start, stop, out):  # type: ignore[no-untyped-def]
    """Write drag and downward acceleration of vertices start..stop."""
    slowing = physics.drag * inverse_mass
    for j in range(uintp(stop - start)):
        i = j + uintp(start)
        out[0, i] = -slowing * v[0, i]
        out[1, i] = -slowing * v[1, i]
        out[2, i] = -slowing * v[2, i] - physics.gravity


@njit(cache=True, error_model="numpy")
def accelerate(x, v, physics, work, out):  # type: ignore[no-untyped-def]
    """Acceleration of every particle, f / m of eq. 5.

    Parameters
    ----------
    x, v : (3, V) arrays
        Positions [mm] and velocities [mm/s].
    physics : System
        What exerts force.
    work : (12, CHUNK) array
        From `scratch`.
    out : (3, V) array
        Receives the accelerations [mm/s^2].
    """
    n, columns = x.shape[1], physics.columns
    rest, k_s, beta = physics.rest, physics.k_s, physics.beta
    inverse = 1.0 / physics.mass
    begun = 0
    for start in range(0, n, CHUNK):
        # Only now, so that what the chunk adds to is still in the cache.
        reach = min(n, start + CHUNK + columns + 1)
        _begin(v, physics, inverse, begun, reach, out)
        begun = reach
        row = max(start, min(start + CHUNK, n - 1))
        down = max(start, min(start + CHUNK, n - columns))
        shear = max(start, min(start + CHUNK, n - columns - 1))
        _pull(x, v, k_s[0], rest[0], beta, inverse, 0, 1, start, row, work, 0)
        _pull(x, v, k_s[1], rest[1], beta, inverse, 0, columns, start, down, work, 3)
        _pull(x, v, k_s[2], rest[2], beta, inverse, 0, columns + 1, start, shear, work, 6)
        _pull(x, v, k_s[3], rest[3], beta, inverse, columns, 1, start, shear, work, 9)
        hand_out(work, start, row - start, down - start, shear - start, columns, out)
    if len(k_s) > 4:
        _pull_far(x, v, physics, inverse, out)


@njit(cache=True, error_model="numpy")
def spring_energy(x, physics):  # type: ignore[no-untyped-def]
    """Energy stored in the springs, the sum of k_s (|x_a - x_b| - r)^2 / 2 [kg mm^2/s^2 = uJ].

    Parameters
    ----------
    x : (3, V) array
        Positions [mm].
    physics : System
        The springs.
    """
    n, columns = x.shape[1], physics.columns
    energy = 0.0
    for family in range(len(physics.k_s)):
        tail, head = spring_offsets(family, columns)
        for i in range(n - max(tail, head)):
            k_s = physics.k_s[family, i]
            if k_s > 0.0:
                dx = x[0, i + head] - x[0, i + tail]
                dy = x[1, i + head] - x[1, i + tail]
                dz = x[2, i + head] - x[2, i + tail]
                stretch = np.sqrt(dx * dx + dy * dy + dz * dz) - physics.rest[family, i]
                energy += 0.5 * k_s * stretch * stretch
    return energy

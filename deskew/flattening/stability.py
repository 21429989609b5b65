"""The largest stable step, from the stiffness, the damping and the integrator's own table.

Linearised about a sheet at rest, each mode of the springs obeys q'' = -lam q - (beta lam + mu / m) q', for eigenvalues
lam of K / m up to `stiffest_mode`. An integrator multiplies (q, h q') by a fixed matrix a step, and is stable while no
mode's matrix has an eigenvalue outside the unit circle. For explicit Euler on an underdamped mode that says
h <= beta + mu / (m lam): without damping it is unstable at every step, and its limit is longest, 2 / sqrt(lam), where
the stiffest mode is damped critically. Implicit Euler has no limit.
"""

from __future__ import annotations

import numpy as np

from deskew.flattening.forces import System, accelerate, scratch
from deskew.flattening.outside import Outside
from deskew.flattening.schemes import Scheme
from deskew.types import Array

_POWER_STEPS = 80
_MODES = 48
_BISECTIONS = 40
# Steps beyond these, in units of 1 / sqrt(lam_max), are unlimited ones.
_LONGEST, _UNLIMITED = 8.0, 1e4


def stiffest_mode(x: Array, physics: System) -> float:
    """Largest eigenvalue of K / m at a given shape, by power iteration [1/s^2].

    It is 8 k_s / m for a large grid of square cells, more for long cells, and at most 12 k_s / m.

    Parameters
    ----------
    x : (3, V) array
        The shape [mm].
    physics : System
        Springs and mass; damping, gravity and drag do not enter.
    """
    # Equation 1 damps along the springs, so with beta = 1 the damping force of a velocity field is K times it.
    still = physics._replace(beta=1.0, gravity=0.0, drag=0.0)
    columns = physics.columns
    index = np.arange(x.shape[1])
    # The stiffest mode alternates from vertex to vertex; a start that does so, a little unevenly, converges soon.
    across, along = (-1.0) ** (index % columns), (-1.0) ** (index // columns)
    mode = np.stack([across + 0.1 * across * along, along + 0.07 * across * along, 0.05 * across * along])
    work, rest, pull = scratch(), np.empty_like(x), np.empty_like(x)
    accelerate(x, np.zeros_like(x), still, work, rest)
    value = 0.0
    for _ in range(_POWER_STEPS):
        mode /= np.linalg.norm(mode)
        accelerate(x, mode, still, work, pull)
        product = rest - pull
        value = float(np.vdot(mode, product))
        mode = product
    return value


def amplification(integrator: Scheme | Outside, h: float, lam: Array, damping: Array) -> Array:
    """Matrices by which one step takes (q, h q') of q'' = -lam q - damping q' to its next value.

    Parameters
    ----------
    integrator : Scheme or Outside
        The integrator.
    h : float
        Step [s].
    lam, damping : (n,) arrays
        Of each mode [1/s^2] and [1/s].

    Returns
    -------
    (n, 2, 2) array, or (n, 3, 3)
        Dimensionless; of an integrator that reuses its last stage for (q, h q', h^2 q'') with that stage's q''.
    """
    if isinstance(integrator, Outside):
        return _amplification_outside(integrator, h, lam, damping)
    if integrator.implicit:
        kept = 1.0 / (1.0 + h * damping + h * h * lam)
        pulled = h * h * lam * kept
        return np.stack([np.stack([1.0 - pulled, kept], axis=-1), np.stack([-pulled, kept], axis=-1)], axis=1)
    n_states = 2 + integrator.reuses
    state = np.broadcast_to(np.eye(n_states)[:, None], (n_states, len(lam), n_states))
    pulls = np.zeros((len(integrator.c), len(lam), n_states))  # h^2 times each stage's acceleration
    for i, c in enumerate(integrator.c):
        if i == 0 and integrator.reuses:
            pulls[0] = state[2]
            continue
        position = state[0] + c * state[1] + np.tensordot(integrator.A_x[i], pulls, 1)
        velocity = state[1] + np.tensordot(integrator.A_v[i], pulls, 1)
        pulls[i] = -h * h * lam[:, None] * position - h * damping[:, None] * velocity
    q = state[0] + state[1] + np.tensordot(integrator.b_x, pulls, 1)
    hv = state[1] + np.tensordot(integrator.b_v, pulls, 1)
    return np.stack([q, hv, pulls[-1]][:n_states], axis=1)


def _amplification_outside(integrator: Outside, h: float, lam: Array, damping: Array) -> Array:
    """Find the matrices by stepping both basis vectors of every mode, a mode a particle."""
    columns = []
    for q, v in ((1.0, 0.0), (0.0, 1.0 / h)):
        x, y = integrator(
            np.full((3, len(lam)), q),
            np.full((3, len(lam)), v),
            lambda x, v: -lam * np.asarray(x) - damping * np.asarray(v),
            h,
        )
        columns.append(np.stack([x[0], h * y[0]], axis=-1))
    return np.stack(columns, axis=-1)


def largest_stable_step(integrator: Scheme | Outside, lam_max: float, beta: float, mu_over_m: float) -> float:
    """Largest step at which no mode up to `lam_max` grows [s]; 0 if every step is unstable, infinity if none is.

    Parameters
    ----------
    integrator : Scheme or Outside
        The integrator.
    lam_max : float
        Stiffest mode [1/s^2].
    beta : float
        k_d / k_s [s].
    mu_over_m : float
        Drag over mass [1/s].
    """
    lam = lam_max * np.geomspace(1e-4, 1.0, _MODES)
    damping = beta * lam + mu_over_m

    def is_stable(h: float) -> bool:
        matrices = amplification(integrator, h, lam, damping)
        return bool(np.isfinite(matrices).all() and np.abs(np.linalg.eigvals(matrices)).max() <= 1.0 + 1e-12)

    if is_stable(_UNLIMITED / np.sqrt(lam_max)):
        return float(np.inf)
    longest = _LONGEST / np.sqrt(lam_max)
    low, high = 0.0, longest
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        low, high = (middle, high) if is_stable(middle) else (low, middle)
    # An unstable scheme still passes steps so short that their growth drowns in rounding.
    return low if low > 1e-5 * longest else 0.0

"""Two ways down an energy on the plane: local and global steps, and Newton's method.

References
----------
Liu et al., A local/global approach to mesh parameterization, SGP 2008.
Peng et al., Anderson acceleration for geometry optimization and physics simulation, ACM TOG 37(4), 2018.
Teran et al., Robust quasistatic finite elements and flesh simulation, SCA 2005 (the positive part of the Hessian).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array, csc_array, kron

from deskew.flattening.anderson import accelerate
from deskew.flattening.energies import Energy
from deskew.flattening.laplace import Laplacian, factor
from deskew.types import Floats

_RIDGE = 1e-9  # of the Laplacian's diagonal: neither moving nor turning the whole sheet costs anything
_SHORTEST_STEP = 1e-6
_PATIENCE = 300  # local and global steps after which Newton's method may have a try
_LAST_STEPS = 20


class Descent(NamedTuple):
    """Where a descent came to.

    Attributes
    ----------
    x : (V, 2) array
        [mm].
    n_iterations : int
        Steps taken.
    converged : bool
        Whether the last step changed no coordinate by more than was asked for, or none could lower the energy.
    """

    x: Floats
    n_iterations: int
    converged: bool


def minimise(
    model: Energy, system: Laplacian, start: Floats, step_mm: float, max_iterations: int, *, uneven: bool = False
) -> Descent:
    """Go down an energy until no coordinate changes by more than `step_mm` in a step.

    Parameters
    ----------
    model : Energy
        What to minimise.
    system : Laplacian
        Of the model's edges and weights.
    start : (V, 2) array
        [mm].
    step_mm : float
        Largest change of a coordinate that counts as none [mm].
    max_iterations : int
        Steps after which to give up; from 300 on, Newton's method may add 20.
    uneven : bool
        Whether the stiffness varies so strongly that only Newton's method will do.
    """
    if uneven:
        return newton(model, system, start, step_mm, max_iterations)
    found = local_global(model, system, start, step_mm, max_iterations)
    if found.converged or max_iterations < _PATIENCE or not np.isfinite(found.x).all():
        return found
    # Parts that are squeezed keep the steps circling; a line search does not circle.
    last = newton(model, system, found.x, step_mm, _LAST_STEPS)
    return last._replace(n_iterations=found.n_iterations + last.n_iterations)


def local_global(model: Energy, system: Laplacian, start: Floats, step_mm: float, max_iterations: int) -> Descent:
    """Find the edges' best vectors, then the best places for them, until no coordinate changes by more than `step_mm`.

    The system is factored once; every step solves it once.
    """
    found = accelerate(lambda x: system.solve(model.pull(x)), start, step_mm, max_iterations)
    return Descent(found.x, found.n_iterations, found.converged)


def newton(model: Energy, system: Laplacian, start: Floats, step_mm: float, max_iterations: int) -> Descent:
    """Newton's method on the positive part of the Hessian, with a line search, until a step is below `step_mm`.

    Unlike local and global steps it does not mind a stiff part in a soft sheet, which turns as a whole.
    """
    L = system.matrix
    both = kron(L, np.eye(2), format="csc")
    x, value = start, model.value(start)
    for n in range(1, max_iterations + 1):
        gradient = L @ x - model.pull(x)
        move = _newton_move(model, both, x, gradient)
        slope = float((gradient * move).sum())
        length = 1.0
        while (there := model.value(x + length * move)) > value + 1e-4 * length * slope + 1e-13 * abs(value):
            length /= 2
            if length < _SHORTEST_STEP:
                return Descent(x, n, slope > -1e-9 * abs(value))
        x, value = x + length * move, there
        if float(np.abs(move).max()) <= step_mm:
            return Descent(x, n, True)
    return Descent(x, max_iterations, False)


def _newton_move(model: Energy, both: csc_array, x: Floats, gradient: Floats) -> Floats:
    """Solve for the step (V, 2); `both` is the Laplacian of x and y, interleaved."""
    vertices, terms = model.softening(x)
    unknowns = 2 * vertices[:, :, None] + np.arange(2)
    unknowns = unknowns.reshape(len(vertices), -1)
    g = terms.reshape(len(vertices), -1)
    width = unknowns.shape[1]
    rows, columns = np.repeat(unknowns, width, axis=1).ravel(), np.tile(unknowns, width).ravel()
    outer = (g[:, :, None] * g[:, None, :]).ravel()
    hessian = csc_array(both - csc_array(coo_array((outer, (rows, columns)), shape=both.shape)))
    hessian.setdiag(hessian.diagonal() + _RIDGE * both.diagonal())
    move = -factor(hessian).solve(gradient.ravel()).reshape(-1, 2)
    return np.asarray(move - move.mean(axis=0))

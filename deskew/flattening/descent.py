"""Two ways down an energy on the plane: local and global steps, and Newton's method.

References
----------
Liu et al., A local/global approach to mesh parameterization, SGP 2008.
Peng et al., Anderson acceleration for geometry optimization and physics simulation, ACM TOG 37(4), 2018.
Teran et al., Robust quasistatic finite elements and flesh simulation, SCA 2005 (the positive part of the Hessian).
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csc_array, kron

from deskew.flattening.anderson import Iterated, accelerate
from deskew.flattening.energies import Energy
from deskew.flattening.laplace import Laplacian, factor
from deskew.types import Floats

_RIDGE = 1e-9  # of the Laplacian's diagonal: neither moving nor turning a whole piece costs anything
_SHORTEST_STEP = 1e-6
_PATIENCE = 300  # local and global steps after which Newton's method may have a try
_LAST_STEPS = 40


def minimise(
    model: Energy, system: Laplacian, start: Floats, step_mm: float, max_iterations: int, *, uneven: bool = False
) -> Iterated:
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
        Steps after which to give up; where 300 are allowed and not enough, at most 40 of Newton's method end it.
    uneven : bool
        Whether the stiffness varies so strongly that only Newton's method will do.
    """
    if uneven:
        return newton(model, system.matrix, start, step_mm, max_iterations)
    # The best vectors of the edges, then the best places for them; the system was factored once.
    found = accelerate(lambda x: system.solve(model.pull(x)), start, step_mm, min(max_iterations, _PATIENCE))
    if found.converged or max_iterations < _PATIENCE or not np.isfinite(found.x).all():
        return found
    # Parts that are squeezed keep the steps circling; a line search does not circle.
    last = newton(model, system.matrix, found.x, step_mm, _LAST_STEPS)
    return last._replace(n_iterations=found.n_iterations + last.n_iterations)


def newton(model: Energy, matrix: csc_array, start: Floats, step_mm: float, max_iterations: int) -> Iterated:
    """Newton's method on the positive part of the Hessian, with a line search, until a step is below `step_mm`.

    Unlike local and global steps it does not mind a stiff part in a soft sheet, which turns as a whole. The sheet may
    be in pieces.

    Parameters
    ----------
    model : Energy
        What to minimise.
    matrix : (V, V) sparse array
        Laplacian of the model's edges and weights.
    start : (V, 2) array
        [mm].
    step_mm : float
        Largest change of a coordinate that counts as none [mm].
    max_iterations : int
        Steps after which to give up, each one factorisation.
    """
    both = kron(matrix, np.eye(2), format="csc")
    x, value, largest = start, model.value(start), np.inf
    for n in range(1, max_iterations + 1):
        gradient = matrix @ x - model.pull(x)
        move = _newton_move(model, both, x, gradient)
        largest = float(np.abs(move).max())
        if not np.isfinite(largest):
            return Iterated(x, n, largest, False)
        slope = float((gradient * move).sum())
        length = 1.0
        while (there := model.value(x + length * move)) > value + 1e-4 * length * slope + 1e-13 * abs(value):
            length /= 2
            if length < _SHORTEST_STEP:
                return Iterated(x, n, largest, slope > -1e-9 * abs(value) or largest <= step_mm)
        x, value = x + length * move, there
        if largest <= step_mm:
            return Iterated(x, n, largest, True)
    return Iterated(x, max_iterations, largest, False)


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
    ridge = both.diagonal()
    ridge[ridge == 0] = ridge.mean()  # a vertex without springs stays where it is
    hessian.setdiag(hessian.diagonal() + _RIDGE * ridge)
    move = -factor(hessian).solve(gradient.ravel()).reshape(-1, 2)
    return np.asarray(move - move.mean(axis=0))

"""Anderson acceleration of a fixed-point iteration x <- g(x), for the local-global solvers.

The next point is the affine combination of the last few images g(x) whose residuals g(x) - x cancel best. A step that
does not pay, because the residual grew, is forgotten: the iteration goes on from the last image, which for a
local-global map never raises the energy.

References
----------
Peng et al., Anderson acceleration for geometry optimization and physics simulation, ACM TOG 37(4), 2018.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from deskew.types import Floats

MEMORY = 5
_GROWTH = 1.0  # residuals may grow by this factor before the memory is thrown away


class Iterated(NamedTuple):
    """Where an iteration came to.

    Attributes
    ----------
    x : array
        The last image.
    n_iterations : int
        Evaluations of the map.
    residual : float
        Largest change of a coordinate in the last evaluation.
    converged : bool
        Whether `residual` fell to the tolerance.
    """

    x: Floats
    n_iterations: int
    residual: float
    converged: bool


def accelerate(
    g: Callable[[Floats], Floats], x: Floats, tolerance: float, max_iterations: int, memory: int = MEMORY
) -> Iterated:
    """Iterate x <- g(x) with Anderson acceleration until no coordinate changes by more than `tolerance`.

    Parameters
    ----------
    g : callable
        The map; it must return a new array of x's shape and leave its argument alone.
    x : array
        Start.
    tolerance : float
        Largest change of any coordinate that counts as none, in x's unit.
    max_iterations : int
        Evaluations of `g` after which to give up, at least 1.
    memory : int
        Differences kept, at least 1.
    """
    shape, size = x.shape, x.size
    d_residuals, d_images = np.empty((memory, size)), np.empty((memory, size))
    gram = np.zeros((memory, memory))
    kept, slot = 0, 0
    last_image: Floats = np.empty(0)
    last_residual: Floats = np.empty(0)
    last_norm = np.inf
    point = x
    for n in range(1, max_iterations + 1):
        image = g(point).ravel()
        residual = image - point.ravel()
        largest, norm = float(np.abs(residual).max()), float(residual @ residual)
        if largest <= tolerance or not np.isfinite(norm):
            return Iterated(image.reshape(shape), n, largest, largest <= tolerance)
        if norm > _GROWTH * last_norm:
            kept = slot = 0
            last_norm = np.inf
            point = last_image.reshape(shape)
            continue
        if last_residual.size:
            d_residuals[slot] = residual - last_residual
            d_images[slot] = image - last_image
            kept = min(kept + 1, memory)
            gram[slot, :kept] = gram[:kept, slot] = d_residuals[:kept] @ d_residuals[slot]
            slot = (slot + 1) % memory
        last_image, last_residual, last_norm = image, residual, norm
        point = image.reshape(shape)
        if kept:
            G = gram[:kept, :kept]
            ridge = 1e-12 * float(np.trace(G)) + 1e-300
            shares = np.linalg.solve(G + ridge * np.eye(kept), d_residuals[:kept] @ residual)
            point = (image - shares @ d_images[:kept]).reshape(shape)
    return Iterated(last_image.reshape(shape), max_iterations, largest, False)

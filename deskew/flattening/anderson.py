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
from numba import njit

from deskew.types import Floats

MEMORY = 4
_CHUNK = 2048  # entries of a vector worked on at a time


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
    last_image, last_residual = np.empty(size), np.empty(size)
    gram, products = np.zeros((memory, memory)), np.zeros(memory)
    kept = slot = 0
    last_norm, fresh, largest = np.inf, True, np.inf
    point = x.ravel()
    for n in range(1, max_iterations + 1):
        image = g(point.reshape(shape)).ravel()
        largest, norm = _distance(image, point)
        finite = bool(np.isfinite(norm))  # NaN is larger than nothing, `largest` included
        if largest <= tolerance or not finite:
            return Iterated(image.reshape(shape), n, largest, finite)
        if norm > last_norm:
            kept, slot, last_norm = 0, 0, np.inf
            point = last_image.copy()
            continue
        kept = 0 if fresh else min(kept + 1, memory)
        _remember(image, point, last_image, last_residual, d_residuals, d_images, slot, kept, gram, products)
        slot = slot if fresh else (slot + 1) % memory
        last_norm, fresh = norm, False
        if kept:
            G = gram[:kept, :kept]
            ridge = 1e-12 * float(np.trace(G)) + 1e-300
            shares = np.linalg.solve(G + ridge * np.eye(kept), products[:kept])
            point = _combined(image, d_images, shares)
        else:
            point = image
    return Iterated(last_image.reshape(shape), max_iterations, largest, False)


@njit(cache=True, error_model="numpy")
def _distance(image: Floats, point: Floats) -> tuple[float, float]:
    """Largest and summed squared difference of two vectors."""
    largest, norm = 0.0, 0.0
    for i in range(len(image)):
        d = abs(image[i] - point[i])
        largest = max(largest, d)
        norm += d * d
    return largest, norm


@njit(cache=True, error_model="numpy")
def _remember(image, point, last_image, last_residual, d_residuals, d_images, slot, kept, gram, products):  # type: ignore[no-untyped-def]
    """Take the differences to the last evaluation into row `slot`, and every product that the next step needs.

    One pass in chunks that stay in the cache, since what it costs is memory. With nothing `kept` only the evaluation
    itself is noted.
    """
    gram_row = np.zeros(len(gram))
    products[:] = 0.0
    for start in range(0, len(image), _CHUNK):
        stop = min(start + _CHUNK, len(image))
        for i in range(start, stop):
            residual = image[i] - point[i]
            if kept > 0:
                d_residuals[slot, i] = residual - last_residual[i]
                d_images[slot, i] = image[i] - last_image[i]
            last_residual[i] = residual
            last_image[i] = image[i]
        for k in range(kept):
            a = np.dot(d_residuals[k, start:stop], d_residuals[slot, start:stop])
            b = np.dot(d_residuals[k, start:stop], last_residual[start:stop])
            gram_row[k] += a
            products[k] += b
    for k in range(kept):
        gram[slot, k] = gram_row[k]
        gram[k, slot] = gram_row[k]


@njit(cache=True, error_model="numpy")
def _combined(image, d_images, shares):  # type: ignore[no-untyped-def]
    """Return the image less the shares of the differences."""
    point = image.copy()
    for k in range(len(shares)):
        for i in range(len(image)):
            point[i] -= shares[k] * d_images[k, i]
    return point

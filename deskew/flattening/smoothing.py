"""Take a scanner's noise off a mesh and leave its folds sharp.

Paper is smooth but for creases: almost everywhere the slope hardly changes from triangle to triangle, and along a few
lines it jumps. The offsets h along the noise's directions minimise

    sum over vertices h^2 / sigma^2  +  (2 s / sigma) sum over hinges |e| rho(jump),

first with the convex rho(t) = sqrt(t^2 + eps^2), which finds the creases, then with rho(t) = (k / 2) log(t^2 + eps^2),
which stops to pull at them: the convex one alone rounds every fold off and shortens the sheet. Both are minimised by a
few reweighted least-squares passes, each solved by conjugate gradients without a matrix.

References
----------
Candes, Wakin & Boyd, Enhancing sparsity by reweighted l1 minimization, J. Fourier Anal. Appl. 14, 2008 (the log).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from deskew.errors import require
from deskew.flattening.directions import noise_directions
from deskew.flattening.hinges import Hinges, hinges_of
from deskew.types import Array, Floats

_STRENGTH = 0.75  # s above
_CONVEX_PASSES, _SHARP_PASSES = 4, 6
# Jumps of slope below eps are smoothed, those above are creases. Times the root of sigma over the mean edge: paper
# bends as it does whatever the noise, but what can be told from noise grows with it.
_CONVEX_EPS, _SHARP_EPS = 0.04, 0.06
_SHARPNESS = 0.125  # k above, times the same root
_REGULAR = 12  # hinges that touch an inner vertex with six neighbours
_RESIDUAL = 0.02  # root mean square of the linear solver's residual, in units of sigma
_MAX_ITERATIONS = 200


def denoise(vertices: Floats, faces: Array, sigma_mm: float) -> Floats:
    """Remove noise from a mesh without rounding its folds.

    Parameters
    ----------
    vertices : (V, 3) array
        Noisy positions [mm].
    faces : (F, 3) int array
        Triangles.
    sigma_mm : float
        Standard deviation of the noise [mm], >= 0; with 0 nothing moves.

    Returns
    -------
    (V, 3) array
        Positions [mm], moved along :func:`deskew.flattening.directions.noise_directions` alone.

    Raises
    ------
    InputError
        If `sigma_mm` is negative or not finite.
    """
    require(0.0 <= sigma_mm < np.inf, "sigma_mm", "be finite and not negative [mm]", sigma_mm)
    if sigma_mm == 0.0:
        return np.array(vertices, dtype=np.float64)
    directions = noise_directions(vertices, faces)
    hinges = hinges_of(vertices, faces, directions)
    offsets = smooth(hinges, np.zeros(len(vertices)), sigma_mm)
    return np.asarray(vertices + offsets[:, None] * directions)


def smooth(hinges: Hinges, noisy: Floats, sigma_mm: float) -> Floats:
    """Find the smooth offsets behind noisy ones.

    Parameters
    ----------
    hinges : Hinges
        Of the mesh at offset 0.
    noisy : (V,) array
        Offsets that were measured [mm]; 0 for the mesh as it is.
    sigma_mm : float
        Their standard deviation [mm], > 0.

    Returns
    -------
    (V,) array
        Offsets [mm].
    """
    if not len(hinges.lengths):  # a single face
        return noisy.copy()
    root = np.sqrt(sigma_mm / float(hinges.lengths.mean()))
    convex, sharp = (_CONVEX_EPS * root) ** 2, (_SHARP_EPS * root) ** 2
    scale = _STRENGTH * sigma_mm * _importance(hinges, len(noisy))
    tolerance = (_RESIDUAL * sigma_mm) ** 2 * len(noisy)
    offsets = noisy.copy()
    for n in range(_CONVEX_PASSES + _SHARP_PASSES):
        squares = (hinges.jumps + (hinges.stencils * offsets[hinges.vertices]).sum(axis=1)) ** 2
        if n < _CONVEX_PASSES:
            stiffness = scale / np.sqrt(squares + convex)
        else:
            stiffness = scale * (_SHARPNESS * root) / (squares + sharp)
        _solve(hinges.vertices, hinges.stencils, hinges.jumps, stiffness, noisy, offsets, tolerance, _MAX_ITERATIONS)
    return offsets


def _importance(hinges: Hinges, n_vertices: int) -> Floats:
    """Length of each hinge's edge, more where one of its vertices has few hinges, (M,) [mm].

    Three hinges do not hold a border vertex as twelve hold an inner one, and the log would leave it where noise put it.
    """
    hinges_at = np.bincount(hinges.vertices.ravel(), minlength=n_vertices)
    fewest = hinges_at[hinges.vertices].min(axis=1)
    return np.asarray(hinges.lengths * np.maximum(_REGULAR / fewest, 1.0))


@njit(cache=True)
def _solve(
    corners: Array,
    stencils: Floats,
    jumps: Floats,
    stiffness: Floats,
    noisy: Floats,
    x: Floats,
    tolerance: float,
    max_iterations: int,
) -> int:
    """Minimise |x - noisy|^2 + sum of stiffness (jump + stencil . x)^2 by conjugate gradients, in place.

    Jacobi-preconditioned; stops when the squared residual falls to `tolerance`. Returns the iterations.
    """
    residual, diagonal, image = np.empty_like(x), np.empty_like(x), np.empty_like(x)
    _downhill(corners, stencils, jumps, stiffness, noisy, x, residual, diagonal)
    direction = residual / diagonal
    descent = float(np.sum(residual * direction))
    for n in range(max_iterations):
        _curve(corners, stencils, stiffness, direction, image)
        curvature, size, next_descent = 0.0, 0.0, 0.0
        for v in range(len(x)):
            curvature += direction[v] * image[v]
        if curvature <= 0.0:
            return n
        step = descent / curvature
        for v in range(len(x)):
            x[v] += step * direction[v]
            residual[v] -= step * image[v]
            size += residual[v] ** 2
            next_descent += residual[v] ** 2 / diagonal[v]
        if size <= tolerance:
            return n + 1
        for v in range(len(x)):
            direction[v] = residual[v] / diagonal[v] + next_descent / descent * direction[v]
        descent = next_descent
    return max_iterations


@njit(cache=True)
def _downhill(
    corners: Array,
    stencils: Floats,
    jumps: Floats,
    stiffness: Floats,
    noisy: Floats,
    x: Floats,
    residual: Floats,
    diagonal: Floats,
) -> None:
    """Fill `residual` with minus half the gradient at x and `diagonal` with the matrix's."""
    for v in range(len(x)):
        residual[v], diagonal[v] = noisy[v] - x[v], 1.0
    for m in range(len(corners)):
        t = jumps[m]
        for k in range(4):
            t += stencils[m, k] * x[corners[m, k]]
        for k in range(4):
            residual[corners[m, k]] -= stiffness[m] * t * stencils[m, k]
            diagonal[corners[m, k]] += stiffness[m] * stencils[m, k] ** 2


@njit(cache=True)
def _curve(corners: Array, stencils: Floats, stiffness: Floats, x: Floats, image: Floats) -> None:
    """Multiply x by the matrix, into `image`."""
    image[:] = x
    for m in range(len(corners)):
        i, j, c, d = corners[m, 0], corners[m, 1], corners[m, 2], corners[m, 3]
        t = stencils[m, 0] * x[i] + stencils[m, 1] * x[j] + stencils[m, 2] * x[c] + stencils[m, 3] * x[d]
        t *= stiffness[m]
        image[i] += t * stencils[m, 0]
        image[j] += t * stencils[m, 1]
        image[c] += t * stencils[m, 2]
        image[d] += t * stencils[m, 3]

"""Levenberg-Marquardt descent of a sheet's energy, with a banded Cholesky factor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import LinAlgError, cho_solve_banded, cholesky_banded

from data_synth.plate import Plate, band_width, derivatives, energy, normals, yielded
from deskew.types import Floats

_DAMPING = 1e-6  # first one, in units of the membrane's stiffness
_LEAST_DAMPING = 1e-9  # keeps the rigid motions, which cost no energy, out of the factor
_TRIES = 8


def relax(x: Floats, plate: Plate, iterations: int, tolerance_mm: float = 1e-3) -> Floats:
    """Lower a sheet's energy.

    Parameters
    ----------
    x : (n, m, 3) array
        Start [mm], the longer axis first.
    plate : Plate
        Material and pulls.
    iterations : int
        Most steps.
    tolerance_mm : float
        A step that moves no vertex farther ends the descent [mm].

    Returns
    -------
    (n, m, 3) array
        Of no higher energy.
    """
    band = np.empty((x.size, band_width((x.shape[0], x.shape[1]))))
    damping = _DAMPING
    for _ in range(iterations):
        at = normals(x)
        before = energy(x, plate, at)
        for _ in range(_TRIES):
            step = _step(x, plate, at, damping, band)
            if step is not None and energy(x + step, plate, at) < before:
                break
            damping *= 10
        else:
            return x
        x = x + step
        damping = max(damping / 4, _LEAST_DAMPING)
        if np.abs(step).max() < tolerance_mm:
            break
    return x


def _step(x: Floats, plate: Plate, at: tuple[Floats, Floats], damping: float, band: Floats) -> Floats | None:
    """Solve ``(H + damping) step = -gradient``; None if rounding left the matrix indefinite."""
    gradient = derivatives(x, plate, at, band)
    a, b = plate.spacing_mm
    band[:, 0] += damping * a * b
    try:
        factor = cholesky_banded(band.T, overwrite_ab=True, lower=True, check_finite=False)
    except LinAlgError:
        return None
    return np.asarray(cho_solve_banded((factor, True), -gradient, check_finite=False).reshape(x.shape))


def relax_plastically(
    x: Floats, plate: Plate, yield_curvature: float, rounds: int, iterations: int
) -> tuple[Floats, Plate]:
    """Alternate descent and plastic flow.

    Parameters
    ----------
    x : (n, m, 3) array
        Start [mm].
    plate : Plate
        Material, rest curvature and pulls.
    yield_curvature : float
        Largest elastic curvature [1/mm].
    rounds, iterations : int
        Descents, and the most steps of each.

    Returns
    -------
    (n, m, 3) array, Plate
        The sheet, and the plate with the rest curvature that is left in it.
    """
    for _ in range(rounds):
        x = relax(x, plate, iterations)
        plate = replace(plate, rest=yielded(x, plate, yield_curvature))
    return x, plate

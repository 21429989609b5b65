"""Non-linear least squares for a bundle of views: thousands of residuals, a few dozen parameters."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from deskew.errors import StepError
from deskew.types import Floats

_ITERATIONS = 100
_RESTS = 1e-6  # gain of a step, in noise variances: no parameter then moves by a 1000th of its deviation


def levenberg_marquardt(
    residuals: Callable[[Floats], Floats], jacobian: Callable[[Floats], Floats], start: Floats
) -> tuple[Floats, int]:
    """Least squares by damped normal equations, each parameter in its own scale (Marquardt 1963).

    A few dozen parameters against thousands of residuals: forming ``J^T J`` costs a tenth of factoring ``J``, and what
    its squared condition loses in a step the next step regains.

    Parameters
    ----------
    residuals, jacobian : callables of (P,)
        (N,) residuals in units of their noise, and their (N, P) derivatives.
    start : (P,) array
        Where to begin.

    Returns
    -------
    (P,) array and int
        The parameters at rest, and the steps taken.

    Raises
    ------
    StepError
        If the cost still falls after `_ITERATIONS` steps, or is not finite.
    """
    x: Floats = start
    r = residuals(x)
    damping = 1e-6
    if not np.isfinite(r @ r):
        raise StepError("calibration: the bundle adjustment starts from no finite residuals; add poses.")
    for taken in range(_ITERATIONS):
        J = jacobian(x)
        scale = np.linalg.norm(J, axis=0)
        scale[scale == 0] = 1.0
        J /= scale
        normal, gradient = J.T @ J, J.T @ r
        while damping < 1e8:
            step = np.asarray(-np.linalg.lstsq(normal + damping * np.eye(len(x)), gradient, rcond=None)[0] / scale)
            tried = residuals(x + step)
            if tried @ tried <= r @ r:
                break
            damping *= 10.0
        else:
            if not np.isfinite(tried @ tried):
                raise StepError("calibration: the bundle adjustment met no finite residuals; add poses.")
            return x, taken  # no direction lowers the cost any more: it rests to rounding
        gained = r @ r - tried @ tried
        x, r, damping = x + step, tried, max(0.1 * damping, 1e-12)
        if gained < _RESTS:
            return x, taken + 1
    raise StepError(
        f"calibration: the bundle adjustment did not converge in {_ITERATIONS} steps; check the board's shape and "
        "add poses."
    )

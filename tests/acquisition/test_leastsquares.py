"""The bundle's own least squares against SciPy's."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from deskew.acquisition import leastsquares
from deskew.acquisition.leastsquares import levenberg_marquardt
from deskew.errors import StepError

TIMES = np.linspace(0.0, 4.0, 200)
TRUE = np.array([3.0, 0.7, 1e-3, 250.0])  # scales that differ by a million


def model(p):
    return p[0] * np.exp(-p[1] * TIMES) + 1e3 * p[2] * TIMES + 1e-3 * p[3] * np.sin(3 * TIMES)


def jacobian(p):
    decay = np.exp(-p[1] * TIMES)
    return np.stack([decay, -p[0] * TIMES * decay, 1e3 * TIMES, 1e-3 * np.sin(3 * TIMES)], axis=-1)


@pytest.mark.parametrize("seed", range(3))
def test_the_minimum_is_scipy_s(seed):
    rng = np.random.default_rng(seed)
    noise = 0.01
    data = model(TRUE) + noise * rng.standard_normal(len(TIMES))
    start = TRUE * rng.uniform(0.4, 1.8, 4)
    found, steps = levenberg_marquardt(lambda p: (model(p) - data) / noise, lambda p: jacobian(p) / noise, start)
    oracle = least_squares(
        lambda p: (model(p) - data) / noise, start, x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-14
    )
    deviation = np.sqrt(np.diag(np.linalg.inv(oracle.jac.T @ oracle.jac)))
    assert np.abs((found - oracle.x) / deviation).max() < 2e-3
    assert 2 <= steps < 40


def test_a_start_at_the_minimum_rests_at_once():
    found, steps = levenberg_marquardt(lambda p: model(p) - model(TRUE), jacobian, TRUE)
    assert np.array_equal(found, TRUE)
    assert steps <= 1


def test_a_parameter_that_nothing_depends_on_stays_where_it_is():
    found, _ = levenberg_marquardt(
        lambda p: model(p[:4]) - model(TRUE),
        lambda p: np.pad(jacobian(p[:4]), ((0, 0), (0, 1))),
        np.append(TRUE * 1.1, 7.0),
    )
    assert found[4] == 7.0
    assert np.allclose(found[:4], TRUE, rtol=1e-3)


def test_what_does_not_rest_is_a_failed_step(monkeypatch):
    monkeypatch.setattr(leastsquares, "_ITERATIONS", 2)
    with pytest.raises(StepError, match="did not converge in 2 steps"):
        levenberg_marquardt(lambda p: (model(p) - model(TRUE)) / 1e-3, lambda p: jacobian(p) / 1e-3, TRUE * 1.8)


@pytest.mark.parametrize("broken_after", [0, 1])
def test_residuals_that_are_not_finite_are_a_failed_step(broken_after):
    calls = []

    def residuals(p):
        calls.append(p)
        return (model(p) - model(TRUE)) * (1.0 if len(calls) <= broken_after else np.nan)

    with pytest.raises(StepError, match="no finite residuals"):
        levenberg_marquardt(residuals, jacobian, TRUE * 1.1)

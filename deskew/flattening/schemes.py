"""Integrators as tables of coefficients (section 3.4); one loop steps them all (:mod:`.integrators`).

Every explicit scheme for x'' = a(x, x') that keeps only accelerations has the Runge-Kutta-Nystrom form

    X_i = x + c_i h v + h^2 sum_j A_x[i, j] a_j        V_i = v + h sum_j A_v[i, j] a_j        a_i = a(X_i, V_i)
    x'  = x +     h v + h^2 sum_j b_x[j] a_j           v'  = v + h sum_j b_v[j] a_j

so a new integrator is a new table. A Runge-Kutta method (A, b) is the table with A_x = A A, b_x = b A, c = A 1.

References
----------
.. [1] Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, sections II.4 and II.14.
.. [2] Bogacki, Shampine, A 3(2) pair of Runge-Kutta formulas, Appl. Math. Lett. 2 (1989).
.. [3] Baraff, Witkin, Large steps in cloth simulation, SIGGRAPH 1998: reference [1] of the paper.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from deskew.types import Array


class Scheme(NamedTuple):
    """An integrator of S stages.

    Attributes
    ----------
    c : (S,) array
        When each stage is evaluated, in steps.
    A_x, A_v : (S, S) arrays
        Strictly lower triangular weights of earlier accelerations in a stage's position and velocity.
    b_x, b_v : (S,) arrays
        Weights of the accelerations in the new position and velocity.
    e_x, e_v : (S,) arrays
        The same minus those of an embedded method of order `estimate`, whose difference estimates a step's error.
    order, estimate : int
        Order of convergence; that of the embedded method, 0 where there is none and steps are equal.
    reuses : bool
        Whether the last stage is taken for the first of the next step, unless a collision has changed the state.
    implicit : bool
        Stepped by :func:`.implicit.implicit_euler` instead of the table.
    """

    c: Array
    A_x: Array
    A_v: Array
    b_x: Array
    b_v: Array
    e_x: Array
    e_v: Array
    order: int
    estimate: int = 0
    reuses: bool = False
    implicit: bool = False

    @property
    def stages(self) -> int:
        """Accelerations that a step evaluates, without those that it is handed."""
        return len(self.c) - self.reuses


def nystrom(A_x: list[list[float]], A_v: list[list[float]], b_x: list[float], b_v: list[float], order: int) -> Scheme:
    """Make a scheme of equal steps whose stages lie where A_v, summed over its rows, says."""
    in_place, in_motion = np.array(A_x), np.array(A_v)
    nothing = np.zeros(len(b_v))
    return Scheme(in_motion.sum(axis=1), in_place, in_motion, np.array(b_x), np.array(b_v), nothing, nothing, order)


def runge_kutta(
    butcher: list[list[float]], weights: list[float], order: int, embedded: list[float] | None = None
) -> Scheme:
    """Make the scheme of an explicit Runge-Kutta method.

    Parameters
    ----------
    butcher, weights : (S, S) and (S,) lists
        Butcher coefficients A and weights b.
    order : int
        Of the method.
    embedded : (S,) list, optional
        Weights of a method one order lower, for the choice of the step.
    """
    A, b = np.array(butcher, dtype=np.float64), np.array(weights, dtype=np.float64)
    e = np.zeros(len(b)) if embedded is None else b - np.array(embedded)
    last = bool(len(b) > 1 and np.array_equal(A[-1], b))  # its last stage is the new state itself
    return Scheme(A.sum(axis=1), A @ A, A, b @ A, b, e @ A, e, order, 0 if embedded is None else order - 1, last)


INTEGRATORS = {
    # The paper's two.
    "euler": runge_kutta([[0.0]], [1.0], 1),
    "rk4": runge_kutta(
        [[0.0, 0.0, 0.0, 0.0], [0.5, 0.0, 0.0, 0.0], [0.0, 0.5, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]],
        [1 / 6, 1 / 3, 1 / 3, 1 / 6],
        4,
    ),
    # The new velocity moves the particles: x' = x + h v'.
    "symplectic_euler": nystrom([[0.0]], [[0.0]], [1.0], [1.0], 1),
    # Damping asks for a velocity at the new place: v + h a_1 keeps the second order.
    "verlet": nystrom([[0.0, 0.0], [0.5, 0.0]], [[0.0, 0.0], [1.0, 0.0]], [0.5, 0.0], [0.5, 0.5], 2)._replace(
        reuses=True
    ),
    "bogacki_shampine": runge_kutta(
        [[0.0, 0.0, 0.0, 0.0], [1 / 2, 0.0, 0.0, 0.0], [0.0, 3 / 4, 0.0, 0.0], [2 / 9, 1 / 3, 4 / 9, 0.0]],
        [2 / 9, 1 / 3, 4 / 9, 0.0],
        3,
        [7 / 24, 1 / 4, 1 / 3, 1 / 8],
    ),
    "implicit_euler": nystrom([[0.0]], [[0.0]], [1.0], [1.0], 1)._replace(implicit=True),
}

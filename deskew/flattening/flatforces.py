"""Forces and energy of a grid's springs once the sheet lies in the plane: what the static solver brings to zero.

Places are framed as in `multigrid`, (2, R + 2, C + 2): each coordinate by itself, one empty vertex all around. The
passes run along rows, so that a compiler can use vector instructions.
"""

from __future__ import annotations

import numpy as np
from numba import njit, uintp


@njit(cache=True, error_model="numpy", inline="always")
def _pull_row(x, rest, k_s, tail, head, offset, pull):  # type: ignore[no-untyped-def]
    """Write what one row's springs of a family do to their tails into pull (2, C).

    `tail` and `head` are the framed rows that the springs begin and end in, `offset` the columns in between. A spring
    of column c begins at framed column c + 1; of the rising family, whose `offset` is -1, at c + 2 to end at c + 1.
    """
    first = 2 if offset < 0 else 1
    for c in range(uintp(k_s.shape[0])):
        a = c + uintp(first)
        b = c + uintp(first + offset)
        dx = x[0, head, b] - x[0, tail, a]
        dy = x[1, head, b] - x[1, tail, a]
        scale = k_s[c] * (1.0 - rest[c] / np.sqrt(dx * dx + dy * dy + 1e-300))
        pull[0, c] = scale * dx
        pull[1, c] = scale * dy


@njit(cache=True, error_model="numpy", inline="always")
def _hand_over(pull, tail, head, offset, force):  # type: ignore[no-untyped-def]
    first = 2 if offset < 0 else 1
    for k in range(2):
        for c in range(uintp(pull.shape[1])):
            force[k, tail, c + uintp(first)] += pull[k, c]
        for c in range(uintp(pull.shape[1])):
            force[k, head, c + uintp(first + offset)] -= pull[k, c]


@njit(cache=True, error_model="numpy")
def flat_forces(x, rest, k_s, pull, force):  # type: ignore[no-untyped-def]
    """Force of all springs on every vertex (eqs. 1 and 2 without damping), in the plane.

    Parameters
    ----------
    x : (2, R + 2, C + 2) array
        Places [mm], framed.
    rest, k_s : (4, R, C) arrays
        Rest lengths [mm] and constants [kg/s^2], by family as in `Springs`, both 0 where there is no spring.
    pull : (2, C) array
        Work.
    force : (2, R + 2, C + 2) array
        Receives the forces [mN].
    """
    force[:] = 0.0
    for r in range(rest.shape[1]):
        _pull_row(x, rest[0, r], k_s[0, r], r + 1, r + 1, 1, pull)
        _hand_over(pull, r + 1, r + 1, 1, force)
        _pull_row(x, rest[1, r], k_s[1, r], r + 1, r + 2, 0, pull)
        _hand_over(pull, r + 1, r + 2, 0, force)
        _pull_row(x, rest[2, r], k_s[2, r], r + 1, r + 2, 1, pull)
        _hand_over(pull, r + 1, r + 2, 1, force)
        # A rising spring begins below and ends above to the right: told from its upper end, it ends below to the left.
        _pull_row(x, rest[3, r], k_s[3, r], r + 1, r + 2, -1, pull)
        _hand_over(pull, r + 1, r + 2, -1, force)


@njit(cache=True)
def flat_energy(xy, rest, k_s):  # type: ignore[no-untyped-def]
    """Energy of all springs, the sum of k_s (|x_a - x_b| - r)^2 / 2 [uJ], at places (R, C, 2) [mm], not framed."""
    rows, columns = rest.shape[1], rest.shape[2]
    energy = 0.0
    for family in range(4):
        for r in range(rows):
            for c in range(columns):
                k = k_s[family, r, c]
                if k > 0.0:
                    tail = 1 if family == 3 else 0
                    down = 1 if family == 1 or family == 2 else 0
                    right = 0 if family == 1 else 1
                    dx = xy[r + down, c + right, 0] - xy[r + tail, c, 0]
                    dy = xy[r + down, c + right, 1] - xy[r + tail, c, 1]
                    stretch = np.sqrt(dx * dx + dy * dy) - rest[family, r, c]
                    energy += 0.5 * k * stretch * stretch
    return energy


@njit(cache=True)
def count_folded(xy, cut, n_up):  # type: ignore[no-untyped-def]
    """Count the quads of an (R, C, 2) grid that are not convex, or turned over against `n_up` = 1 or -1.

    Quads that are `cut`, (R - 1, C - 1), do not count.
    """
    count = 0
    for r in range(xy.shape[0] - 1):
        for c in range(xy.shape[1] - 1):
            if cut[r, c]:
                continue
            bad = False
            for top in range(2):
                ax = xy[r + top, c + 1, 0] - xy[r + top, c, 0]
                ay = xy[r + top, c + 1, 1] - xy[r + top, c, 1]
                for left in range(2):
                    bx = xy[r + 1, c + left, 0] - xy[r, c + left, 0]
                    by = xy[r + 1, c + left, 1] - xy[r, c + left, 1]
                    bad |= n_up * (ax * by - ay * bx) <= 0.0
            count += bad
    return count

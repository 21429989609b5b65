"""Forces and energy of a grid's springs once the sheet lies in the plane: what the static solver brings to zero.

Places are framed as in `multigrid`: (R + 2, C + 2, 2), one empty vertex all around.
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, error_model="numpy")
def flat_forces(x, rest, k_s, force):  # type: ignore[no-untyped-def]
    """Force of all springs on every vertex (eqs. 1 and 2 without damping), in the plane.

    Parameters
    ----------
    x : (R + 2, C + 2, 2) array
        Places [mm], framed.
    rest, k_s : (4, R, C) arrays
        Rest lengths [mm] and constants [kg/s^2], by family as in `Springs`.
    force : (R + 2, C + 2, 2) array
        Receives the forces [mN]; its frame stays 0.
    """
    rows, columns = rest.shape[1], rest.shape[2]
    force[:] = 0.0
    for r in range(rows):
        for c in range(columns):
            here_x, here_y = x[r + 1, c + 1, 0], x[r + 1, c + 1, 1]
            sum_x, sum_y = 0.0, 0.0
            for family in range(3):
                k = k_s[family, r, c]
                if k > 0.0:
                    i, j = r + 1 + (family != 0), c + 1 + (family != 1)
                    dx, dy = x[i, j, 0] - here_x, x[i, j, 1] - here_y
                    scale = k * (1.0 - rest[family, r, c] / np.sqrt(dx * dx + dy * dy + 1e-300))
                    sum_x += scale * dx
                    sum_y += scale * dy
                    force[i, j, 0] -= scale * dx
                    force[i, j, 1] -= scale * dy
            k = k_s[3, r, c]
            if k > 0.0:
                dx = x[r + 1, c + 2, 0] - x[r + 2, c + 1, 0]
                dy = x[r + 1, c + 2, 1] - x[r + 2, c + 1, 1]
                scale = k * (1.0 - rest[3, r, c] / np.sqrt(dx * dx + dy * dy + 1e-300))
                force[r + 2, c + 1, 0] += scale * dx
                force[r + 2, c + 1, 1] += scale * dy
                force[r + 1, c + 2, 0] -= scale * dx
                force[r + 1, c + 2, 1] -= scale * dy
            force[r + 1, c + 1, 0] += sum_x
            force[r + 1, c + 1, 1] += sum_y


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

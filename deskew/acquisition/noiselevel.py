"""The noise level of a depth map from itself, pixel by pixel: dark ink is ten times noisier than white paper.

Second differences of the inverse depth vanish on a plane. Their median absolute deviation over a small window overlooks
a fold that crosses it, and is blind to an even curvature, which moves the median alone.
"""

from __future__ import annotations

import numba
import numpy as np

from deskew.types import Floats

_STRIDE = 2  # of the lattice that the level is estimated on
_SHARE = 0.5  # of a window that must have second differences: beside a gap they miss what is wrong with its rim
_GAUSS = 1.4826  # standard deviation of a normal variable over its median absolute deviation
# On white noise the larger of both axes' estimates, and of the lattice points around a pixel, reads high by this median
# factor, for a window of 5 x 5, 7 x 7, 9 x 9 (measured on a million pixels).
_READS_HIGH = {2: 1.218, 3: 1.148, 4: 1.111}
# The level where it cannot be estimated: lone pixels deserve little trust.
_UNKNOWN_QUANTILE = 0.9


@numba.njit(cache=True)
def _median(values: Floats, n: int) -> float:
    """Upper median of the first `n` values, by selection in place."""
    k, low, high = n // 2, 0, n - 1
    while low < high:
        pivot, i, j = values[(low + high) // 2], low, high
        while i <= j:
            while values[i] < pivot:
                i += 1
            while values[j] > pivot:
                j -= 1
            if i <= j:
                values[i], values[j] = values[j], values[i]
                i, j = i + 1, j - 1
        if k <= j:
            high = j
        elif k >= i:
            low = i
        else:
            break
    return float(values[k])


@numba.njit(cache=True)
def _along(f: Floats, y: int, x: int, radius: int, dy: int, dx: int, buffer: Floats) -> float:
    """Noise level around pixel (x, y) from second differences along (dx, dy); infinite if there are too few."""
    n, places = 0, 0
    for i in range(max(dy, y - radius), min(f.shape[0] - dy, y + radius + 1)):
        for j in range(max(dx, x - radius), min(f.shape[1] - dx, x + radius + 1)):
            places += 1
            second = f[i - dy, j - dx] - 2.0 * f[i, j] + f[i + dy, j + dx]
            if not np.isnan(second):
                buffer[n] = second
                n += 1
    if n == 0 or n < _SHARE * places:
        return np.inf
    middle = _median(buffer, n)
    for k in range(n):
        buffer[k] = abs(buffer[k] - middle)
    return float(_GAUSS * _median(buffer, n) / np.sqrt(6.0))


@numba.njit(cache=True)
def _on_lattice(f: Floats, radius: int, out: Floats) -> None:
    """Fill `out` with the larger of both axes' levels at every second pixel; infinite where one is unknown.

    Ink biases a whole edge at once: only the axis across it sees that.
    """
    buffer = np.empty((2 * radius + 1) ** 2)
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            y, x = i * _STRIDE, j * _STRIDE
            out[i, j] = max(_along(f, y, x, radius, 1, 0, buffer), _along(f, y, x, radius, 0, 1, buffer))


@numba.njit(cache=True)
def _spread(lattice: Floats, out: Floats) -> None:
    """Give every pixel the largest level of the lattice points beside it, infinite where one is unknown."""
    rows, columns = lattice.shape
    for y in range(out.shape[0]):
        i0, i1 = y // _STRIDE, min((y + _STRIDE - 1) // _STRIDE, rows - 1)
        for x in range(out.shape[1]):
            j0, j1 = x // _STRIDE, min((x + _STRIDE - 1) // _STRIDE, columns - 1)
            out[y, x] = max(max(lattice[i0, j0], lattice[i0, j1]), max(lattice[i1, j0], lattice[i1, j1]))


def noise_level(f: Floats, radius_px: int) -> Floats:
    """Estimate the standard deviation of white noise on a piecewise smooth map, locally.

    Parameters
    ----------
    f : (height, width) array
        The map; NaN where nothing was measured.
    radius_px : int
        Half-width of the square window, in {2, 3, 4}.

    Returns
    -------
    (height, width) array
        The level in the unit of `f`, NaN where `f` is. Beside large gaps, where it cannot be known, it is the map's 0.9
        quantile; 0 if it is known nowhere.
    """
    values = np.ascontiguousarray(f, dtype=np.float64)
    lattice = np.empty(((f.shape[0] + 1) // _STRIDE, (f.shape[1] + 1) // _STRIDE))
    level = np.empty(f.shape)
    _on_lattice(values, radius_px, lattice)
    _spread(lattice, level)
    measured = ~np.isnan(values)
    known = measured & np.isfinite(level)
    level[~known] = np.quantile(level[known], _UNKNOWN_QUANTILE) if known.any() else 0.0
    level[~measured] = np.nan
    return level / _READS_HIGH[radius_px]

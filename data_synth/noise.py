"""Sensor noise that is a pure function of (seed, frame, pixel), so frames may be rendered in any order.

Sixteen neighbouring pixels share one hash, which picks where in a shuffled table of normal quantiles their noise is
read. The table holds 65,536 equally likely values, so its mean and variance are exact and its tails end at 4.3 sigma.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import numpy.typing as npt
from numba import njit
from scipy.special import ndtri

from deskew.types import Floats

RUN = 16
"""Pixels that share a hash."""

_BITS = 16


@cache
def quantile_table() -> Floats:
    """Return shuffled standard normal quantiles, with the first `RUN` repeated at the end: float32."""
    n = 1 << _BITS
    quantiles = ndtri((np.arange(n) + 0.5) / n)
    quantiles *= 1 / quantiles.std()
    # The order is a constant of the rig; seeds act through the hash.
    shuffled = np.random.Generator(np.random.PCG64(20010709)).permutation(quantiles).astype(np.float32)
    table = np.concatenate([shuffled, shuffled[:RUN]])
    table.flags.writeable = False
    return table


def redrawn(seed: int, draw: int) -> int:
    """Return the noise seed of a draw, in [0, 2**63): the seed itself for draw 0, for others a number of their own."""
    return seed if draw == 0 else int(np.random.SeedSequence([seed, draw]).generate_state(1, np.uint64)[0]) >> 1


@njit(cache=True)
def run_start(key: int, frame: int, run: int) -> int:
    """Place in the table where the noise of run number `run` of a frame begins: splitmix64's finaliser."""
    z = (
        np.uint64(key)
        + np.uint64(frame) * np.uint64(0x9E3779B97F4A7C15)
        + np.uint64(run) * np.uint64(0xD1342543DE82EF95)
    )
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return int((z ^ (z >> np.uint64(31))) & np.uint64((1 << _BITS) - 1))


@njit(cache=True)
def deviation(signal: float, read_variance: float, shot: float) -> float:
    """Return the noise's standard deviation at a signal: variance = read + shot * signal [grey levels]."""
    return float(np.sqrt(np.float32(read_variance) + np.float32(shot) * max(np.float32(signal), np.float32(0.0))))


@njit(cache=True)
def deviations(mean: Floats, read_variance: float, shot: float) -> Floats:
    """Apply :func:`deviation` to the mean (N,) float32 of every pixel: (N,) float32."""
    sigma = np.empty_like(mean)
    for i in range(len(mean)):
        sigma[i] = deviation(mean[i], read_variance, shot)
    return sigma


@njit(cache=True)
def digitised(value: float) -> int:
    """Round to an 8-bit grey level, clipped at both ends."""
    return int(min(max(np.float32(value) + np.float32(0.5), np.float32(0.0)), np.float32(255.0)))


@njit(cache=True)
def expose(mean: Floats, sigma: Floats, table: Floats, key: int, frame: int, image: npt.NDArray[np.uint8]) -> None:
    """Fill a flat 8-bit image with its mean and noise.

    Parameters
    ----------
    mean, sigma : (N,) float32 arrays
        Mean and standard deviation of every pixel [grey levels].
    table : array
        From :func:`quantile_table`.
    key, frame : int
        Seed and frame number.
    image : (N,) array
        Written.
    """
    n = len(mean)
    for run in range((n + RUN - 1) // RUN):
        start, first = run_start(key, frame, run), run * RUN
        for k in range(min(RUN, n - first)):
            image[first + k] = digitised(mean[first + k] + sigma[first + k] * table[start + k])

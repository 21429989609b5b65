"""The steps of one fringe: phase by least squares, the noise of it, and what is no sine."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np
from scipy import fft
from scipy.special import gammaincinv

from deskew.acquisition.framenoise import noise_at, variance_by_level
from deskew.acquisition.projectorcheck import FringeFit, bright_pixels, fit_overtones
from deskew.types import Array, Floats, Fringe

_FITTED = 20_000  # pixels that the overtones are fitted to


@dataclass(frozen=True, slots=True)
class FringeImage:
    """One fringe as the camera saw it, all arrays (height, width).

    Attributes
    ----------
    fringe : Fringe
        Period and steps.
    place : array
        Projector coordinate within the period, in [0, period) [px].
    modulation : array
        Amplitude of the sine [grey levels].
    noise : array
        Standard deviation of one frame [grey levels].
    highest : array
        Brightest of the frames [grey levels].
    second, stray : float
        Second harmonic over the first, and light that belongs to another frame; of the bright pixels.
    """

    fringe: Fringe
    place: Floats
    modulation: Floats
    noise: Floats
    highest: Floats
    second: float
    stray: float

    @property
    def modulation_sigma(self) -> Floats:
        """Standard deviation of the modulation that noise makes [grey levels]."""
        return np.asarray(np.sqrt(2 / self.fringe.n_steps) * self.noise)

    @property
    def place_sigma(self) -> Floats:
        """Standard deviation of `place` that noise makes [px]: ``period / (2 pi) sqrt(2 / N) noise / modulation``."""
        return np.asarray(
            self.fringe.period_px / (2 * np.pi) * self.modulation_sigma / np.maximum(self.modulation, 1e-6)
        )


def read_fringe(frames: Iterator[Array], fringe: Fringe, judged: Floats) -> FringeImage:
    """Read the frames of one fringe and fit a sine to each pixel (least squares over N even steps: bin 1 of a DFT).

    Harmonic k of a projector or camera that is not linear biases the phase only if k + 1 or k - 1 is a multiple of N:
    N steps cancel the harmonics 2 to N - 2.

    Parameters
    ----------
    frames : iterator of (height, width) arrays
        The next N are taken.
    fringe : Fringe
        Period and steps N.
    judged : (height, width) array
        White - black where it is not clipped, else 0 [grey levels]: overtones are fitted to the bright pixels.
    """
    n = fringe.n_steps
    steps = np.stack([frame.astype(np.float32) for frame in islice(frames, n)])
    bins = fft.rfft(steps, axis=0)
    mean = bins[0].real / n
    first = bins[1] * (2 / n)
    over = bins[2:] * (2 / n)
    if n % 2 == 0:
        over[-1] /= 2
    fit = _overtones(over, first, judged, n)
    noise = _noise(over - fit.explained, mean, n)
    place = np.mod(-np.angle(first) * (fringe.period_px / (2 * np.pi)), fringe.period_px)
    return FringeImage(fringe, place, np.abs(first), noise, steps.max(axis=0), fit.second, fit.stray)


def _overtones(over: Array, first: Array, judged: Floats, n_steps: int) -> FringeFit:
    """Fit the overtones of all pixels by those that are bright, or as many of them as it takes."""
    bright = np.flatnonzero(bright_pixels(judged))
    chosen = np.zeros(judged.size, dtype=bool)
    chosen[bright[:: max(1, len(bright) // _FITTED)]] = True
    fit = fit_overtones(over.reshape(len(over), -1), first.ravel(), chosen, n_steps)
    return FringeFit(fit.explained.reshape(over.shape), fit.second, fit.stray)


def _noise(rest: Array, mean: Floats, n_steps: int) -> Floats:
    """Noise of one frame [grey levels] from what neither sine nor harmonics explain, (bins, height, width)."""
    power = np.abs(rest) ** 2 * (n_steps / 2)
    if n_steps % 2 == 0:
        power[-1] *= 2
    freedom = n_steps - 3
    median = 2 * float(gammaincinv(freedom / 2, 0.5)) / freedom  # of chi-squared over its mean
    return noise_at(variance_by_level(power.sum(axis=0) / freedom, mean, median), mean)

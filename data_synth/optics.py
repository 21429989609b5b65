"""Blur: the camera's point spread over sub-samples, and the profile of one lit projector line."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from scipy.special import ndtr

from data_synth.shading import SUBSAMPLES
from deskew.types import Floats

PROFILE_STEPS = 512
"""Entries of the line profile a projector pixel; linear interpolation between them errs by less than 1e-6."""


def psf_taps(sigma_px: float) -> Floats:
    """Weights of sub-samples in a pixel: the Gaussian spread, averaged over the pixel's own sub-samples.

    Parameters
    ----------
    sigma_px : float
        Standard deviation of the spread [camera px].

    Returns
    -------
    (2 n + 2,) float32 array
        Symmetric about the pixel's centre, sum 1; entry 0 belongs to the sub-sample n before the pixel's first one.
    """
    sigma = sigma_px * SUBSAMPLES
    n = math.ceil(3.5 * sigma)
    offsets = np.arange(-n, n + 2)
    taps = sum(np.exp(-0.5 * ((offsets - k) / sigma) ** 2) * (np.abs(offsets - k) <= n) for k in range(SUBSAMPLES))
    return np.asarray(taps / np.sum(taps), dtype=np.float32)


def margin_px(sigma_px: float) -> int:
    """Camera pixels beyond the image that reach into it through the spread."""
    return math.ceil((len(psf_taps(sigma_px)) // 2 - 1) / SUBSAMPLES)


def line_profile(sigma_px: float, width_px: int = 1) -> Floats:
    """Light at a distance from the middle of a lit stripe: a box blurred by a Gaussian; single lines add up to 1.

    Parameters
    ----------
    sigma_px : float
        Blur [projector px].
    width_px : int
        Lines that are lit together.

    Returns
    -------
    (n,) float32 array
        Light at distances 0, 1 / PROFILE_STEPS, ... up to where it ends, 4 sigma beyond the box.
    """
    half = width_px / 2
    reach = half + 4 * sigma_px
    distance = np.arange(math.ceil(reach * PROFILE_STEPS) + 2) / PROFILE_STEPS
    light = ndtr((distance + half) / sigma_px) - ndtr((distance - half) / sigma_px)
    light[-1] = 0.0
    return np.asarray(light, dtype=np.float32)


def frame_window(coordinate: Floats, extent: int, sigma_px: float) -> Floats:
    """Light of the whole frame along one axis: the sum of the profiles of all its lines, 1 well inside.

    Parameters
    ----------
    coordinate : array
        Projector coordinate along the axis [px].
    extent : int
        Lines of the frame.
    sigma_px : float
        Blur [projector px].
    """
    window = ndtr((coordinate + 0.5) / sigma_px) - ndtr((coordinate - (extent - 0.5)) / sigma_px)
    return np.asarray(window, dtype=np.float32)


@njit(cache=True)
def blurred(samples: Floats, taps: Floats) -> Floats:
    """Whole image from its sub-samples: the taps along both axes, one pixel every `SUBSAMPLES`.

    Parameters
    ----------
    samples : (rows, columns) float32 array
        Sub-samples with the margin that :func:`margin_px` asks for.
    taps : array
        From :func:`psf_taps`.

    Returns
    -------
    (height, width) float32 array
        Pixels, the margin gone.
    """
    margin = (len(taps) // 2 - 1 + SUBSAMPLES - 1) // SUBSAMPLES
    first = margin * SUBSAMPLES - (len(taps) // 2 - 1)
    height, width = samples.shape[0] // SUBSAMPLES - 2 * margin, samples.shape[1] // SUBSAMPLES - 2 * margin
    line = np.empty(samples.shape[1], dtype=np.float32)
    image = np.zeros((height, width), dtype=np.float32)
    for y in range(height):
        line[:] = 0.0
        for k in range(len(taps)):
            for x in range(len(line)):
                line[x] += taps[k] * samples[y * SUBSAMPLES + first + k, x]
        for x in range(width):
            total = np.float32(0.0)
            for k in range(len(taps)):
                total += taps[k] * line[x * SUBSAMPLES + first + k]
            image[y, x] = total
    return image

"""From the mean of an image to what the camera hands out: noise, rounding, and the average of several exposures."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from data_synth.noise import deviations, expose, quantile_table
from data_synth.rig import RigConfig
from deskew.types import Floats

_TO_16_BITS = 257  # 255 becomes 65535


def exposed(mean: Floats, config: RigConfig, key: int, number: int) -> npt.NDArray[np.unsignedinteger]:
    """Turn a mean image into an image.

    Parameters
    ----------
    mean : (height, width) float32 array
        Grey levels of 8 bits.
    config : RigConfig
        Noise and `exposures`.
    key, number : int
        Noise seed and the frame's number.

    Returns
    -------
    (height, width) array
        One exposure: uint8. The average of several: uint16, 257 to a grey level.
    """
    flat = mean.ravel()
    sigma = deviations(flat, *config.noise_variance)
    image = np.empty(flat.shape, dtype=np.uint8)
    if config.exposures == 1:
        expose(flat, sigma, quantile_table(), key, number, image)
        return image.reshape(mean.shape)
    total = np.zeros(flat.shape, dtype=np.uint32)
    for i in range(config.exposures):
        expose(flat, sigma, quantile_table(), key, number * config.exposures + i, image)
        total += image
    average = (total * _TO_16_BITS + config.exposures // 2) // config.exposures
    return average.astype(np.uint16).reshape(mean.shape)

"""The bench of the third experiment: one camera that scans in PAL and photographs at 1996 x 1450 (section 4).

Both pictures go through the same optics, but where one lies in the other nobody wrote down.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from data_synth.lights import Format, Light, standard_lights
from data_synth.rig import Rig, default_rig
from deskew.types import Size

PAL_SIZE: Size = (768, 576)
"""What the camera scans in: its video signal."""

KONTRON_SIZE: Size = (1996, 1450)
"""What it photographs in."""

_SCALE, _ASPECT, _SHIFT_PX = (0.92, 1.02), (0.95, 1.05), 40.0


def manuscript_rig(noise_scale: float = 1.0) -> Rig:
    """Return the default bench with a camera of 768 x 576 pixels behind the same lens: .4 mm a pixel on the bed.

    Parameters
    ----------
    noise_scale : float
        Multiplies the sensor's noise.
    """
    rig = default_rig(noise_scale)
    finer = PAL_SIZE[0] / rig.camera.size[0]
    # The sensor's corner, half a pixel before the first one's centre, stays where it is.
    corner = (finer - 1) / 2
    return replace(rig, camera=Format(PAL_SIZE, (finer, finer), (corner, corner)).camera(rig.camera))


def kontron_readout(rng: np.random.Generator, scan_size: Size = PAL_SIZE) -> Format:
    """Draw how the high resolution lies to the scan: its scale, aspect and crop are known to nobody.

    Parameters
    ----------
    rng : numpy Generator
        The only source of randomness.
    scan_size : (width, height)
        Pixels of the scan.
    """
    scale = KONTRON_SIZE[0] / scan_size[0] * float(rng.uniform(*_SCALE))
    both = (scale, scale * float(rng.uniform(*_ASPECT)))
    # What is left over of either picture, and where: a few per cent of the texture.
    x, y = (
        float((t - s * n) / 2 + rng.uniform(-_SHIFT_PX, _SHIFT_PX))
        for t, s, n in zip(KONTRON_SIZE, both, scan_size, strict=True)
    )
    return Format(KONTRON_SIZE, both, (x, y))


def kontron_light(rng: np.random.Generator) -> Light:
    """Return the reading-room lamp from above, photographed in the high resolution as :func:`kontron_readout` draws."""
    return replace(standard_lights(kontron_readout(rng))[0], name="kontron")

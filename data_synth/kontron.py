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

# The video shows a little less than the photograph: its picture over the largest that fits, and its aspect.
_SHARE, _ASPECT = (0.90, 0.96), (0.96, 1.04)


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


def kontron_readout(rng: np.random.Generator) -> Format:
    """Draw where the scan's picture lies in the photograph: all of it, at a scale, aspect and place known to nobody."""
    scale = min(fine / coarse for fine, coarse in zip(KONTRON_SIZE, PAL_SIZE, strict=True)) * rng.uniform(*_SHARE)
    both = float(scale), float(scale * rng.uniform(*_ASPECT))
    x, y = (
        float(rng.uniform(0.0, fine - across * coarse))
        for fine, across, coarse in zip(KONTRON_SIZE, both, PAL_SIZE, strict=True)
    )
    return Format(KONTRON_SIZE, both, (x, y))


def kontron_light(rng: np.random.Generator) -> Light:
    """Return the reading-room lamp from above, photographed in the high resolution as :func:`kontron_readout` draws."""
    return replace(standard_lights(kontron_readout(rng))[0], name="kontron")

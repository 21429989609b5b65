"""Which of its frames the projector shows while the camera exposes one: in step, only that one."""

from __future__ import annotations

import numpy as np

from data_synth.rig import RigConfig


def frames_in(config: RigConfig, key: int, number: int, index: int) -> tuple[tuple[int, float], ...]:
    """Frames that share the light of an exposure.

    Parameters
    ----------
    config : RigConfig
        `late_share_max` and `repeated_share`.
    key, number : int
        Noise seed and the frame's number in the noise's count: the fault is a function of them alone.
    index : int
        Frame of the sequence that the exposure is meant for; -1 is the black one before the first.

    Returns
    -------
    tuple of (index, share)
        Shares add up to 1.
    """
    if config.late_share_max == 0 and config.repeated_share == 0:
        return ((index, 1.0),)
    late, repeated = np.random.default_rng([key, number]).uniform(size=2)
    if repeated < config.repeated_share:
        return ((index - 1, 1.0),)
    late *= config.late_share_max
    return ((index, 1.0 - late), (index - 1, late))

"""Photograph a sheet on the bench: white, black and both sweeps, with the truth handed back apart."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from data_synth.lights import Light, under_lights
from data_synth.noise import exposed
from data_synth.optics import blurred, frame_window, margin_px, psf_taps
from data_synth.pages import Page
from data_synth.rig import Rig
from data_synth.shading import Samples, sample_scene
from data_synth.sheets import TrueSheet
from data_synth.sweep import Sweep
from data_synth.truth import Truth, true_sheet_seen
from deskew.errors import require
from deskew.types import Capture, Floats, PatternKind

_WHITE, _BLACK, _FIRST_LINE = 0, 1, 2


def render(
    rig: Rig, sheet: TrueSheet, page: Page, seed: int | np.random.Generator, *, lights: Sequence[Light] = ()
) -> tuple[Capture, Truth]:
    """Photograph a sheet.

    White and black are rendered at once; the sweeps' frames one by one as they are read, so a caller who needs the
    white image alone pays for nothing else.

    Parameters
    ----------
    rig : Rig
        The bench.
    sheet : TrueSheet
        The surface, in the world of the bed.
    page : Page
        What is printed on it.
    seed : int or numpy Generator
        Of the sensor's noise; a generator gives one 63-bit draw.
    lights : sequence of Light
        Of the capture's textures, rendered at once.

    Returns
    -------
    Capture
        Grey 8-bit images; `columns` and `rows` are restartable and the same bytes on every run.
    Truth
        True page coordinates and depth of every pixel, for metrics only.
    """
    return photograph(rig, sheet, page, seed, lights=lights), true_sheet_seen(sheet, rig.camera, lights)


def photograph(
    rig: Rig, sheet: TrueSheet, page: Page, seed: int | np.random.Generator, *, lights: Sequence[Light] = ()
) -> Capture:
    """Photograph a sheet without building its truth; parameters as in :func:`render`."""
    key = int(seed.integers(1 << 63)) if isinstance(seed, np.random.Generator) else seed
    require(0 <= key < 1 << 63, "seed", "be in [0, 2**63)", key)
    config = rig.config
    samples = sample_scene(rig, sheet, page, margin_px(config.camera_psf_sigma_px))
    window = _windows(rig, samples)
    light = np.float32(config.exposure_grey * config.lit) * samples.lit
    taps = psf_taps(config.camera_psf_sigma_px)
    dark = np.float32(config.exposure_grey) * (
        np.float32(config.ambient) * samples.sky + np.float32(config.leak) * samples.lit * window[0] * window[1]
    )
    black = blurred(dark, taps) + np.float32(config.pedestal_grey)
    white = black + blurred(light * window[0] * window[1], taps)
    width, height = rig.projector.size
    return Capture(
        white=exposed(config.noise_variance, white, key, _WHITE),
        black=exposed(config.noise_variance, black, key, _BLACK),
        projector_size=rig.projector.size,
        pattern=PatternKind.LINE_SWEEP,
        columns=Sweep(samples.column, light * window[1], black, width, config, key, _FIRST_LINE, upright=True),
        rows=Sweep(samples.row, light * window[0], black, height, config, key, _FIRST_LINE + width, upright=False),
        textures=under_lights(rig, sheet, page, lights, key),
    )


def _windows(rig: Rig, samples: Samples) -> tuple[Floats, Floats]:
    """Light of the projector's frame along its columns and along its rows."""
    blur = rig.config.projector_blur_sigma_px
    width, height = rig.projector.size
    return frame_window(samples.column, width, blur), frame_window(samples.row, height, blur)

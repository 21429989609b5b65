"""Photograph a sheet on the bench: white, black and the coded frames, with the truth handed back apart."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from data_synth.coded import Coded
from data_synth.exposure import exposed
from data_synth.lights import Light, under_lights
from data_synth.noise import redrawn
from data_synth.optics import blurred, frame_window, margin_px, psf_taps
from data_synth.pages import Page
from data_synth.patterns import default_fringes, projected_lines
from data_synth.rig import Rig
from data_synth.shading import Samples, sample_scene
from data_synth.sheets import TrueSheet
from data_synth.sweep import Sweep
from data_synth.truth import Truth, true_sheet_seen
from deskew.errors import require
from deskew.types import Capture, Floats, Frames, Fringes, PatternKind

_WHITE, _BLACK, _FIRST_FRAME = 0, 1, 2


def render(
    rig: Rig,
    sheet: TrueSheet,
    page: Page,
    seed: int | np.random.Generator,
    pattern: PatternKind = PatternKind.LINE_SWEEP,
    fringes: Fringes | None = None,
    *,
    lights: Sequence[Light] = (),
) -> tuple[Capture, Truth]:
    """Photograph a sheet.

    White and black are rendered at once; the coded frames one by one as they are read, so a caller who needs the
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
    pattern : PatternKind
        What the projector shows.
    fringes : tuple of Fringe, optional
        Of a phase pattern; :func:`data_synth.patterns.default_fringes` if not given.
    lights : sequence of Light
        Of the capture's textures, rendered at once.

    Returns
    -------
    Capture
        Grey images of 8 bits, 16 where exposures are averaged; `columns` and `rows` are restartable and the same bytes
        on every run.
    Truth
        True page coordinates and depth of every pixel, for metrics only.
    """
    capture = photograph(rig, sheet, page, seed, pattern, fringes, lights=lights)
    return capture, true_sheet_seen(sheet, rig.camera, lights)


def photograph(
    rig: Rig,
    sheet: TrueSheet,
    page: Page,
    seed: int | np.random.Generator,
    pattern: PatternKind = PatternKind.LINE_SWEEP,
    fringes: Fringes | None = None,
    *,
    lights: Sequence[Light] = (),
) -> Capture:
    """Photograph a sheet without building its truth; parameters as in :func:`render`."""
    key = int(seed.integers(1 << 63)) if isinstance(seed, np.random.Generator) else seed
    require(0 <= key < 1 << 63, "seed", "be in [0, 2**63)", key)
    config = rig.config
    key = redrawn(key, config.noise_draw)
    samples = sample_scene(rig, sheet, page, margin_px(config.camera_psf_sigma_px))
    window = _windows(rig, samples)
    light = np.float32(config.exposure_grey * config.lit) * samples.lit
    taps = psf_taps(config.camera_psf_sigma_px)
    dark = np.float32(config.exposure_grey) * (
        np.float32(config.ambient) * samples.sky + np.float32(config.leak) * samples.lit * window[0] * window[1]
    )
    black = blurred(dark, taps) + np.float32(config.pedestal_grey)
    white = black + blurred(light * window[0] * window[1], taps)
    fringes = default_fringes(pattern, rig.projector.size) if fringes is None else fringes
    columns, rows = _coded_frames(rig, samples, (light * window[1], light * window[0]), black, key, pattern, fringes)
    return Capture(
        white=exposed(white, config, key, _WHITE),
        black=exposed(black, config, key, _BLACK),
        projector_size=rig.projector.size,
        pattern=pattern,
        columns=columns,
        rows=rows,
        textures=under_lights(rig, sheet, page, lights, key),
        fringes=fringes,
    )


def _coded_frames(
    rig: Rig,
    samples: Samples,
    light: tuple[Floats, Floats],
    black: Floats,
    key: int,
    pattern: PatternKind,
    fringes: Fringes,
) -> tuple[Frames, Frames]:
    """Lazy frames of the columns and of the rows, each with the light that the other axis lets through."""
    width, height = rig.projector.size
    if pattern is PatternKind.LINE_SWEEP:
        n_exposures = rig.config.exposures
        require(n_exposures == 1, "exposures", f"be 1 for a {pattern}: its frames are not averaged", n_exposures)
        first_row = _FIRST_FRAME + width
        return (
            Sweep(samples.column, light[0], black, width, rig.config, key, _FIRST_FRAME, upright=True),
            Sweep(samples.row, light[1], black, height, rig.config, key, first_row, upright=False),
        )
    lines = [rig.config.shown(projected_lines(pattern, extent, fringes)) for extent in (width, height)]
    first_row = _FIRST_FRAME + len(lines[0])
    return (
        Coded(samples.column, light[0], black, lines[0], rig.config, key, _FIRST_FRAME),
        Coded(samples.row, light[1], black, lines[1], rig.config, key, first_row),
    )


def _windows(rig: Rig, samples: Samples) -> tuple[Floats, Floats]:
    """Light of the projector's frame along its columns and along its rows."""
    blur = rig.config.projector_blur_sigma_px
    width, height = rig.projector.size
    return frame_window(samples.column, width, blur), frame_window(samples.row, height, blur)

"""Captures of fringes whose every pixel looks at a known projector coordinate, by the formulas of `Capture` alone."""

from __future__ import annotations

import numpy as np

from deskew.types import Capture, Floats, Fringe, Fringes, PatternKind

PROJECTOR = (256, 192)
CODED = (Fringe(16.0, 6),)
SEVERAL = (Fringe(272.0, 4), Fringe(66.0, 4), Fringe(16.0, 8))
FRINGES = {PatternKind.GRAY_PHASE: CODED, PatternKind.MULTI_PHASE: SEVERAL}
LIGHT, DARK = 180.0, 12.0


def wave(coordinate: Floats, fringe: Fringe, gamma: float = 1.0) -> list[Floats]:
    """Light of each step at a projector coordinate, in [0, 1]."""
    angles = [2 * np.pi * (coordinate / fringe.period_px - n / fringe.n_steps) for n in range(fringe.n_steps)]
    return [((1 + np.cos(angle)) / 2) ** gamma for angle in angles]


def half_period_planes(coordinate: Floats, fringe: Fringe, extent: int) -> list[Floats]:
    """Light of the bit planes of the half period that a coordinate lies in, and of their inverses."""
    half = int(fringe.period_px) // 2
    number = np.floor((coordinate + 0.5) / half).astype(int)
    code = number ^ (number >> 1)
    n_bits = max(1, (-(-extent // half) - 1).bit_length())
    planes = [((code >> bit) & 1).astype(float) for bit in reversed(range(n_bits))]
    return [light for plane in planes for light in (plane, 1 - plane)]


def frames_of(pattern: PatternKind, fringes: Fringes, coordinate: Floats, extent: int, gamma: float) -> list[Floats]:
    """Light of all frames of one axis."""
    coded = pattern is PatternKind.GRAY_PHASE
    planes = half_period_planes(coordinate, fringes[0], extent) if coded else []
    return [*planes, *(light for fringe in fringes for light in wave(coordinate, fringe, gamma))]


def phase_capture(
    column: Floats, row: Floats, pattern: PatternKind, *, albedo: Floats | float = 1.0, noise: float = 0.0,
    gamma: float = 1.0, seed: int = 0, fringes: Fringes | None = None,
) -> Capture:  # fmt: skip
    """Photograph known coordinates, in 8 bits."""
    rng = np.random.default_rng(seed)
    fringes = fringes or FRINGES[pattern]

    def shot(light: Floats) -> np.ndarray:
        grey = DARK + LIGHT * albedo * light + noise * rng.standard_normal(column.shape)
        return np.clip(np.rint(grey), 0, 255).astype(np.uint8)

    axes = [
        [shot(light) for light in frames_of(pattern, fringes, coordinate, extent, gamma)]
        for coordinate, extent in zip((column, row), PROJECTOR, strict=True)
    ]
    ones = np.ones(column.shape)
    return Capture(shot(ones), shot(0 * ones), PROJECTOR, pattern, *axes, fringes=fringes)


def tilted(size: tuple[int, int] = (150, 110)) -> tuple[Floats, Floats]:
    """Projector column and row of each pixel of a tilted plane, (height, width) each."""
    x, y = np.meshgrid(np.arange(size[0], dtype=float), np.arange(size[1], dtype=float))
    return 6.3 + 1.6 * x + 0.04 * y, 4.1 + 0.06 * x + 1.55 * y

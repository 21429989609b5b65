"""Closed-form scenes for the acquisition tests: Gaussian stripes over known coordinates, and two known devices."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from deskew.projection import centre, pixel_grid, project, rays
from deskew.types import Array, Calibration, Capture, Correspondence, Floats, PatternKind, Pinhole, Size


@dataclass
class StripeFrames:
    """Frame k shows ``level + amplitude exp(-(k - where)^2 / (2 width^2))`` with Gaussian noise, rounded and clipped.

    `drawn` logs the frames that were asked for, in order. A second stripe at `ghost_where` is added where it is finite.
    """

    where: Floats
    n_frames: int
    amplitude: Floats
    width: Floats
    level: float
    noise: float
    seed: int
    dtype: type[np.unsignedinteger] = np.uint8
    ghost_where: Floats | None = None
    ghost_amplitude: float = 0.0
    drawn: list[int] = field(default_factory=list)

    def __len__(self) -> int:
        return self.n_frames

    def __iter__(self) -> Iterator[Array]:
        rng = np.random.default_rng(self.seed)
        for k in range(self.n_frames):
            self.drawn.append(k)
            light = self.amplitude * np.exp(-0.5 * ((k - self.where) / self.width) ** 2)
            if self.ghost_where is not None:
                ghost = self.ghost_amplitude * np.exp(-0.5 * ((k - self.ghost_where) / self.width) ** 2)
                light = light + np.nan_to_num(ghost)
            yield digitise(self.level + light + rng.normal(0, self.noise, self.where.shape), self.dtype)


def digitise(grey: Floats, dtype: type[np.unsignedinteger] = np.uint8) -> Array:
    return np.clip(np.rint(grey), 0, np.iinfo(dtype).max).astype(dtype)


def coordinates(size: Size, projector_size: Size) -> tuple[Floats, Floats]:
    """Smooth, bent projector coordinates that keep 8 px clear of the projector's border."""
    x, y = np.moveaxis(pixel_grid(size), -1, 0)
    (w, h), (pw, ph) = size, projector_size
    column = 9 + (pw - 20) * (x + 0.06 * y) / (w + 0.06 * h) + np.sin(y / 9)
    row = 9 + (ph - 20) * (y + 0.05 * x) / (h + 0.05 * w) + np.cos(x / 11)
    return column, row


def stripe_capture(
    size: Size = (96, 64),
    projector_size: Size = (80, 56),
    *,
    amplitude: float | Floats = 120.0,
    width: float | Floats = 1.2,
    level: float = 12.0,
    contrast: float | Floats = 200.0,
    noise: float = 1.0,
    seed: int = 0,
    dtype: type[np.unsignedinteger] = np.uint8,
) -> tuple[Capture, Floats, Floats]:
    """Return a capture with the true column and row of each pixel."""
    column, row = coordinates(size, projector_size)
    rng = np.random.default_rng([seed, 9])
    shape = column.shape
    amplitudes, widths = np.broadcast_to(amplitude, shape), np.broadcast_to(width, shape)
    sweeps = [
        StripeFrames(where, n, amplitudes, widths, level, noise, seed + i, dtype)
        for i, (where, n) in enumerate(zip((column, row), projector_size, strict=True))
    ]
    black = digitise(level + rng.normal(0, noise, shape), dtype)
    white = digitise(level + np.broadcast_to(contrast, shape) + rng.normal(0, noise, shape), dtype)
    return Capture(white, black, projector_size, PatternKind.LINE_SWEEP, *sweeps), column, row


def look_at(size: Size, focal_px: float, eye: tuple[float, float, float], distortion: list[float]) -> Pinhole:
    """A device at `eye` that looks at the world's origin, its x axis leaning to +X."""
    z = -np.array(eye) / np.linalg.norm(eye)
    x = np.cross([0.0, -1.0, 0.0], z)
    x /= np.linalg.norm(x)
    R = np.stack([x, np.cross(z, x), z])
    K = np.array([[focal_px, 0, size[0] / 2 + 1.7], [0, focal_px * 1.003, size[1] / 2 - 2.3], [0, 0, 1]])
    return Pinhole(size, K, np.array(distortion), R, -R @ np.array(eye))


def bench(*, distorted: bool = True) -> Calibration:
    """A camera above and a projector to the right, both with a distortion of a few pixels unless told otherwise."""
    lens = [-0.15, 0.1, 2e-3, -1e-3, 0.02] if distorted else [0.0] * 5
    beam = [0.1, -0.05, -1e-3, 2e-3, 0.0] if distorted else [0.0] * 5
    camera = look_at((96, 72), 260.0, (5.0, -4.0, 800.0), lens)
    return Calibration(camera, look_at((192, 160), 500.0, (380.0, -60.0, 900.0), beam), {})


def plane_depth(camera: Pinhole, normal: Floats, offset: float) -> Floats:
    """Camera z at every pixel of the plane ``normal . X = offset``, (height, width) [mm]."""
    return np.asarray((offset - normal @ centre(camera)) / (rays(camera, pixel_grid(camera.size)) @ normal))


def seen_from(calibration: Calibration, z: Floats) -> Correspondence:
    """The exact correspondence of depth z at the raw camera pixels, (height, width) [mm]."""
    camera = calibration.camera
    points = centre(camera) + z[..., None] * rays(camera, pixel_grid(camera.size))
    pixels = project(calibration.projector, points)
    return Correspondence(pixels[..., 0], pixels[..., 1], np.zeros(z.shape, np.uint8))

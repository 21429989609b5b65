"""The temporal reading of a line sweep: each pixel's brightness over the frames peaks at its projector coordinate.

Frames stream through a ring of the last 2 w + 1. On ink a stripe stands no higher over the noise than the highest of a
thousand dark samples; so a few pixels along the stripe are also searched together, and where a pixel's own peak does
not stand out, it is sought where its cell's is: among three samples noise rises far less high. Peaks are measured in
the pixel's own samples.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deskew.acquisition.sweep import RIVAL_SNR, Scene, Sweep, SweepSettings, dark_level, dark_noise, measure, shadowed
from deskew.acquisition.sweep_tracks import (
    CELL,
    SMOOTH_NOISE,
    SMOOTH_SUM,
    Tracks,
    cells_of,
    pixels_of,
    start_tracks,
    sum_cells,
    track,
)
from deskew.types import Array, Floats, Reason


@dataclass(frozen=True, slots=True)
class _Seen:
    """What one pass over the frames leaves: tracks of the pixels and of the cells, dark level (n,) and dark noise."""

    own: Tracks
    cells: Tracks
    level: Floats
    noise: float


def _stream(
    frames: Iterator[Array], n_frames: int, scene: Scene, settings: SweepSettings, *, along_rows: bool
) -> _Seen:
    """Pass every frame through the ring once."""
    half, window = settings.half_width, settings.window
    shape, n, dtype = scene.black.shape, scene.black.size, scene.black.dtype
    first = np.stack([next(frames) for _ in range(window)])
    noise = dark_noise(first, scene)
    level = dark_level(first, scene, noise)
    smooth_noise = np.float32(SMOOTH_NOISE * noise)
    ones, cells = pixels_of(shape), cells_of(shape, across=not along_rows)
    mean = np.zeros(len(cells.first), np.float32)
    sum_cells(level, cells, mean)
    mean /= CELL
    own = start_tracks(ones, level.ravel() + RIVAL_SNR * smooth_noise, n, window, dtype)
    pooled = start_tracks(cells, mean + settings.min_snr * smooth_noise / np.float32(np.sqrt(CELL)), n, window, dtype)
    ring = first.reshape(window, n)
    sums = np.zeros((window, len(mean)), pooled.best.dtype)
    for i in range(window):
        sum_cells(first[i], cells, sums[i])

    def enter(frame: int) -> None:
        track(own, ring, ring, frame, n_frames)
        track(pooled, sums, ring, frame, n_frames)

    for late in range(half + 1):  # of these the right side is complete only now
        enter(late)
    for i, frame in enumerate(frames, start=window):
        ring[i % window] = frame.ravel()
        sum_cells(frame, cells, sums[i % window])
        enter(i - half)
    for late in range(n_frames - half, n_frames):
        enter(late)
    return _Seen(own, pooled, level.ravel(), noise)


def _guided(seen: _Seen) -> tuple[npt.NDArray[np.bool_], Array, Array]:
    """Look for the peaks that do not stand out where their cells' are.

    Returns
    -------
    guided : (n,) bool array
        Pixels whose own peak does not stand out.
    index : (n,) int32 array
        Frame of each pixel's own peak or else of its cell's, negative where neither has one.
    profiles : (n, 2 w + 1) array
        Samples around it.
    """
    own, pooled = seen.own, seen.cells
    frame = np.empty_like(own.index)
    for k in range(pooled.cells.size):
        frame[pooled.cells.first + k * pooled.cells.step] = pooled.index
    guided = own.index < 0
    return guided, np.where(guided, frame, own.index), np.where(guided[:, None], pooled.profiles, own.profiles)


def decode_temporal(
    frames: Iterator[Array], n_frames: int, scene: Scene, settings: SweepSettings, *, along_rows: bool
) -> Sweep:
    """Decode one sweep pixel by pixel (section 2.3).

    Parameters
    ----------
    frames : iterator of (height, width) arrays
        Read once, in order; never more than 2 w + 1 are held.
    n_frames : int
        Length of the sweep, at least 2 w + 1.
    scene : Scene
        The still scene.
    settings : SweepSettings
        Window and thresholds.
    along_rows : bool
        The stripe moves along image rows, for a sweep of projector columns; else along image columns.

    Returns
    -------
    Sweep
        Frame number of each pixel's peak.
    """
    seen = _stream(frames, n_frames, scene, settings, along_rows=along_rows)
    own, noise = seen.own, seen.noise
    best, second = (heights / np.float32(SMOOTH_SUM) - seen.level for heights in (own.best, own.second))
    guided, index, profiles = _guided(seen)
    peaks = measure(profiles, seen.level, index, n_frames, noise, settings, guided)
    reason = peaks.reason
    rival = np.maximum(settings.second_peak_ratio * best, RIVAL_SNR * SMOOTH_NOISE * noise + 1.0 / SMOOTH_SUM)
    reason[(reason == Reason.OK) & (second > rival)] = Reason.TWO_PEAKS
    reason[own.profiles.max(axis=1) >= scene.saturated_level] = Reason.SATURATED
    # White and black are single frames: on ink their difference may be lost in noise where a stripe still shows.
    reason[shadowed(scene, noise, settings).ravel() & ~(guided & (reason == Reason.OK))] = Reason.SHADOW
    shape = scene.black.shape
    return Sweep(peaks.position.reshape(shape), reason.reshape(shape), peaks.typical_width)

"""The temporal reading of a line sweep: each pixel's brightness over the frames peaks at its projector coordinate.

Frames stream through a ring of the last 2 w + 1; each pixel keeps its best peak's profile and the height of its second
peak, so memory does not grow with the length of the sweep. Peaks are sought in the frames smoothed by (1, 2, 1), nearly
the matched filter of a stripe: on ink a stripe stands no higher over the noise than the highest of a thousand dark
samples. They are measured in the frames themselves.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numba
import numpy as np

from deskew.acquisition.sweep import RIVAL_SNR, Scene, Sweep, SweepSettings, dark_level, dark_noise, measure, shadowed
from deskew.types import Array, Floats, Reason

_SMOOTH_SUM = 4.0  # of the weights (1, 2, 1)
_SMOOTH_NOISE = 6.0**0.5 / 4.0  # of the smoothed mean, relative to a sample's
_FLOOR_MARGIN = 1.0  # peaks are tracked from this far below the smallest signal-to-noise ratio that passes
_BLOCK = 64  # pixels that are compared at a time, in a few vector instructions
_NEVER = -(1 << 20)  # frame of a peak not seen yet: further than any gap from all frames


@dataclass(frozen=True, slots=True)
class _Tracks:
    """Per-pixel state, flat over the image: mutable arrays in a frozen record. Heights are sums of weight 4."""

    best: Array  # (n,) uint16 or uint32, height of the best peak; never below the floor
    second: Array  # (n,) uint32, height of the best peak away from it; never below the floor
    index: Array  # (n,) int32, frame of the best peak
    profiles: Array  # (n, 2 w + 1) samples around it


@numba.njit(cache=True)
def _touched(before: Array, now: Array, after: Array, floors: Array, touched: Array) -> None:
    """Mark the blocks in which any smoothed value exceeds its floor.

    Without an early exit, over slices and in the floors' narrow type: so it becomes few vector instructions.
    """
    for k in range(touched.size):
        first, last = k * _BLOCK, (k + 1) * _BLOCK
        a, b, c, floor = before[first:last], now[first:last], after[first:last], floors[first:last]
        hit = False
        for i in range(a.size):
            hit |= floors.dtype.type(a[i] + 2 * b[i] + c[i]) > floor[i]
        touched[k] = hit


@numba.njit(cache=True)
def _track(
    ring: Array, around: Array, slots: Array, frame: int, gap: int,
    best: Array, second: Array, index: Array, profiles: Array,
) -> None:  # fmt: skip
    """Enter one frame: pixels at a smoothed local maximum that beats their second or their best peak change state.

    `around` holds the ring slots of the frames -2 .. 2 from this one, `slots` those of the profile.
    """
    f0, f1, f2, f3, f4 = ring[around[0]], ring[around[1]], ring[around[2]], ring[around[3]], ring[around[4]]
    n = f2.size
    touched = np.empty((n + _BLOCK - 1) // _BLOCK, np.bool_)
    _touched(f1, f2, f3, second, touched)
    for start in range(0, n, _BLOCK):
        if not touched[start // _BLOCK]:
            continue
        for p in range(start, min(start + _BLOCK, n)):
            value = f1[p] + 2 * f2[p] + f3[p]
            if value <= second[p] or value <= f0[p] + 2 * f1[p] + f2[p] or value < f2[p] + 2 * f3[p] + f4[p]:
                continue
            away = frame - index[p] > gap
            if value > best[p]:
                if away:
                    second[p] = best[p]
                best[p] = value
                index[p] = frame
                for j in range(slots.size):
                    if slots[j] >= 0:
                        profiles[p, j] = ring[slots[j], p]
            elif away:
                second[p] = value


def _enter(tracks: _Tracks, ring: Array, frame: int, n_frames: int) -> None:
    """Track `frame`, whose neighbours of half a window are in the ring; the sweep is mirrored at its ends."""
    window = len(ring)
    half = window // 2
    around = np.abs(np.arange(frame - 2, frame + 3))
    around = (n_frames - 1 - np.abs(n_frames - 1 - around)) % window
    wanted = np.arange(frame - half, frame + half + 1)
    slots = np.where((wanted >= 0) & (wanted < n_frames), wanted % window, -1)
    _track(ring, around, slots, frame, half, tracks.best, tracks.second, tracks.index, tracks.profiles)


def _start(level: Floats, noise: float, dtype: np.dtype[np.unsignedinteger], settings: SweepSettings) -> _Tracks:
    margin = max(settings.min_snr - _FLOOR_MARGIN, 0.0) * _SMOOTH_NOISE * noise
    floor = _SMOOTH_SUM * (level.ravel() + margin)
    best = np.ceil(floor).astype(np.uint16 if dtype == np.uint8 else np.uint32)
    return _Tracks(
        best, best.copy(), np.full(best.size, _NEVER, np.int32), np.zeros((best.size, settings.window), dtype)
    )


def _stream(
    frames: Iterator[Array], n_frames: int, scene: Scene, settings: SweepSettings
) -> tuple[_Tracks, Floats, float]:
    """Pass every frame through the ring once; return the tracks, the dark level (n,) and the dark noise."""
    half, window = settings.half_width, settings.window
    ring = np.zeros((window, scene.black.size), scene.black.dtype)
    for i in range(window):
        ring[i] = next(frames).ravel()
    first = ring.reshape(window, *scene.black.shape)
    noise = dark_noise(first, scene)
    level = dark_level(first, scene, noise)
    tracks = _start(level, noise, ring.dtype, settings)
    for late in range(half + 1):  # of these the right side is complete only now
        _enter(tracks, ring, late, n_frames)
    for i, frame in enumerate(frames, start=window):
        ring[i % window] = frame.ravel()
        _enter(tracks, ring, i - half, n_frames)
    for late in range(n_frames - half, n_frames):
        _enter(tracks, ring, late, n_frames)
    return tracks, level.ravel(), noise


def decode_temporal(frames: Iterator[Array], n_frames: int, scene: Scene, settings: SweepSettings) -> Sweep:
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

    Returns
    -------
    Sweep
        Frame number of each pixel's peak.
    """
    tracks, level, noise = _stream(frames, n_frames, scene, settings)
    dark = shadowed(scene, noise, settings).ravel()
    index = np.where(dark, np.int32(-1), tracks.index)
    peaks = measure(tracks.profiles, level, index, n_frames, noise, settings)
    reason = peaks.reason
    best, second = (height / np.float32(_SMOOTH_SUM) - level for height in (tracks.best, tracks.second))
    rival = np.maximum(settings.second_peak_ratio * best, RIVAL_SNR * _SMOOTH_NOISE * noise)
    reason[(reason == Reason.OK) & (second > rival)] = Reason.TWO_PEAKS
    reason[tracks.profiles.max(axis=1) >= scene.saturated_level] = Reason.SATURATED
    reason[dark] = Reason.SHADOW
    shape = scene.black.shape
    return Sweep(peaks.position.reshape(shape), reason.reshape(shape), peaks.typical_width)

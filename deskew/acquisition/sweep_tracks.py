"""Peaks of many profiles at once, tracked while the frames of a sweep stream by.

Each track keeps its best peak's place and profile and the height of its second peak, so memory does not grow with the
length of the sweep. Peaks are sought in the frames smoothed by (1, 2, 1), nearly the matched filter of a stripe.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from deskew.errors import require
from deskew.types import Array, Floats

SMOOTH_SUM = 4.0  # of the weights (1, 2, 1)
SMOOTH_NOISE = 6.0**0.5 / 4.0  # of the smoothed mean, relative to a sample's
CELL = 4  # pixels along the stripe: their peaks lie within a sample or so of each other on a slope of 30 degrees
_BLOCK = 64  # tracks that are compared at a time, in a few vector instructions
_NEVER = -(1 << 20)  # frame of a peak not seen yet: further than any gap from all frames


@dataclass(frozen=True, slots=True)
class Cells:
    """Pixels, or neighbours along the stripe whose light is summed: alone, one on ink does not rise above its noise.

    Attributes
    ----------
    first : (m,) int32 array
        Flat index of each cell's first pixel.
    size, step : int
        Pixels of a cell, 1 or `CELL`, and the flat distance between them.
    """

    first: Array
    size: int
    step: int


def pixels_of(shape: tuple[int, int]) -> Cells:
    """Every pixel of an image of `shape` as a cell of its own."""
    return Cells(np.arange(shape[0] * shape[1], dtype=np.int32), 1, 1)


def cells_of(shape: tuple[int, int], *, across: bool) -> Cells:
    """Divide an image into cells along its rows or down its columns; the last overlap where it does not divide."""
    height, width = shape
    length = width if across else height
    require(length >= CELL, "white", f"be at least {CELL} px wide and high for a line sweep", (width, height))
    starts = np.minimum(np.arange(0, length, CELL), length - CELL)
    rows, columns = (np.arange(height), starts) if across else (starts, np.arange(width))
    return Cells((rows[:, None] * width + columns).ravel().astype(np.int32), CELL, 1 if across else width)


@dataclass(frozen=True, slots=True)
class Tracks:
    """Per-cell state: mutable arrays in a frozen record. Heights are sums of weight 4 over the cell's pixels.

    Attributes
    ----------
    cells : Cells
        Whose light is tracked, m of them.
    best, second : (m,) uint16 or uint32 arrays
        Heights of the best peak and of the best away from it; never below the floor.
    index : (m,) int32 array
        Frame of the best peak.
    profiles : (n, 2 w + 1) array
        Each pixel's own samples around its cell's best peak.
    """

    cells: Cells
    best: Array
    second: Array
    index: Array
    profiles: Array


def start_tracks(
    cells: Cells, floor: Floats, n_pixels: int, window: int, dtype: np.dtype[np.unsignedinteger]
) -> Tracks:
    """Begin with nothing seen.

    Parameters
    ----------
    cells : Cells
        What to track.
    floor : (m,) array
        Height that a smoothed mean of a cell's pixels must exceed [grey levels].
    n_pixels : int
        Of the image.
    window : int
        Samples of a profile.
    dtype : dtype
        Of the frames.
    """
    best = np.ceil(SMOOTH_SUM * cells.size * floor).astype(np.uint16 if dtype == np.uint8 else np.uint32)
    index = np.full(best.size, _NEVER, np.int32)
    return Tracks(cells, best, best.copy(), index, np.zeros((n_pixels, window), dtype))


@numba.njit(cache=True)
def _sum_down(frame: Array, out: Array) -> None:
    """Sum cells of 4 rows of a frame into `out`, flat."""
    height, width = frame.shape
    add = out.dtype.type
    for b in range((height + 3) // 4):
        y = min(4 * b, height - 4)
        row, top, second, third, last = out[b * width :], frame[y], frame[y + 1], frame[y + 2], frame[y + 3]
        for x in range(width):
            row[x] = add(top[x]) + add(second[x]) + add(third[x]) + add(last[x])


@numba.njit(cache=True)
def _sum_across(frame: Array, out: Array) -> None:
    """Sum cells of 4 columns of a frame into `out`, flat.

    Constant strides and `out`'s own type make it few vector instructions.
    """
    height, width = frame.shape
    n, whole = (width + 3) // 4, width // 4
    add = out.dtype.type
    for y in range(height):
        row, cells = frame[y], out[y * n : (y + 1) * n]
        for b in range(whole):
            cells[b] = add(row[4 * b]) + add(row[4 * b + 1]) + add(row[4 * b + 2]) + add(row[4 * b + 3])
        if whole < n:
            cells[whole] = add(row[width - 4]) + add(row[width - 3]) + add(row[width - 2]) + add(row[width - 1])


def sum_cells(frame: Array, cells: Cells, out: Array) -> None:
    """Sum each cell of `CELL` pixels of a frame (height, width) into `out` (m,)."""
    (_sum_across if cells.step == 1 else _sum_down)(frame, out)


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
def _keep(pixels: Array, slots: Array, first: int, size: int, step: int, profiles: Array) -> None:
    """Copy the profiles of a cell's pixels out of the ring."""
    for p in range(first, first + size * step, step):
        for j in range(slots.size):
            if slots[j] >= 0:
                profiles[p, j] = pixels[slots[j], p]


@numba.njit(cache=True)
def _track(
    ring: Array, pixels: Array, around: Array, slots: Array, frame: int, first: Array, size: int, step: int,
    best: Array, second: Array, index: Array, profiles: Array,
) -> None:  # fmt: skip
    """Enter one frame: cells at a smoothed local maximum that beats their second or their best peak change state.

    `ring` holds the cells' sums, `pixels` the frames; `around` the slots of the frames -2 .. 2 from this one, `slots`
    those of the profile.
    """
    f0, f1, f2, f3, f4 = ring[around[0]], ring[around[1]], ring[around[2]], ring[around[3]], ring[around[4]]
    n, gap = f2.size, slots.size // 2
    touched = np.empty((n + _BLOCK - 1) // _BLOCK, np.bool_)
    _touched(f1, f2, f3, second, touched)
    for start in range(0, n, _BLOCK):
        if not touched[start // _BLOCK]:
            continue
        for c in range(start, min(start + _BLOCK, n)):
            value = f1[c] + 2 * f2[c] + f3[c]
            if value <= second[c] or value <= f0[c] + 2 * f1[c] + f2[c] or value < f2[c] + 2 * f3[c] + f4[c]:
                continue
            away = frame - index[c] > gap
            if value > best[c]:
                if away:
                    second[c] = best[c]
                best[c] = value
                index[c] = frame
                _keep(pixels, slots, first[c], size, step, profiles)
            elif away:
                second[c] = value


def track(tracks: Tracks, ring: Array, pixels: Array, frame: int, n_frames: int) -> None:
    """Enter `frame`, whose neighbours of half a window are in the rings; the sweep is mirrored at its ends.

    Parameters
    ----------
    tracks : Tracks
        Changed.
    ring, pixels : (2 w + 1, m) and (2 w + 1, n) arrays
        The last frames, frame i at i modulo 2 w + 1: the cells' sums, and the pixels themselves.
    frame, n_frames : int
        Which frame, of how many.
    """
    window = len(ring)
    half = window // 2
    around = np.abs(np.arange(frame - 2, frame + 3))
    around = (n_frames - 1 - np.abs(n_frames - 1 - around)) % window
    wanted = np.arange(frame - half, frame + half + 1)
    slots = np.where((wanted >= 0) & (wanted < n_frames), wanted % window, -1)
    cells = tracks.cells
    _track(
        ring, pixels, around, slots, frame, cells.first, cells.size, cells.step,
        tracks.best, tracks.second, tracks.index, tracks.profiles,
    )  # fmt: skip

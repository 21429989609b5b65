"""The paper's reading of a line sweep: each frame holds one curve, a peak along every image line (section 2.3).

The curve gives, for a projector line, where it falls in the image; the projector coordinate at a pixel's centre is then
interpolated between the neighbouring curves.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain

import numba
import numpy as np
import numpy.typing as npt

from deskew.acquisition.sweep import RIVAL_SNR, Scene, Sweep, SweepSettings, dark_level, dark_noise, measure, shadowed
from deskew.acquisition.sweep_tracks import CELL, SMOOTH_NOISE, Cells, cells_of, sum_cells
from deskew.types import Array, Floats, Reason

_SURELY_SEEN = 2.0  # times the height from which a stripe stands out
_JUMP_LINES = 4  # missing curves leave smaller differences between neighbours
_OK, _SATURATED, _WEAK, _TWO_PEAKS, _EDGE = (
    int(r) for r in (Reason.OK, Reason.SATURATED, Reason.WEAK, Reason.TWO_PEAKS, Reason.EDGE)
)


@numba.njit(cache=True)
def _brightest(line: Floats, start: int, stop: int) -> tuple[int, float]:
    """Index and value of the highest entry of line[start:stop], (-1, 0) if none is positive."""
    at, top = -1, np.float32(0.0)
    for x in range(start, stop):
        if line[x] > top:
            at, top = x, line[x]
    return at, float(top)


@numba.njit(cache=True)
def _curve(
    frame: Array, level: Floats, half: int, floor: float, guide: Array, index: Array, profiles: Array, heights: Floats
) -> None:
    """Find one frame's stripe in each image line, where the line smoothed by (1, 2, 1) is highest.

    Fills index (lines,), profiles (lines, 2 half + 1) above the level, and heights (lines, 2): of the best peak and of
    the next away from it, smoothed to a sum of weights of 1. Below the floor the peak is where the guide (lines,) says,
    nowhere if that is negative.
    """
    n_lines, length = frame.shape
    line = np.empty(length, np.float32)
    smooth = np.zeros(length, np.float32)
    for y in range(n_lines):
        for x in range(length):
            line[x] = frame[y, x] - level[y, x]
        for x in range(1, length - 1):
            smooth[x] = np.float32(0.25) * (line[x - 1] + line[x] + line[x] + line[x + 1])
        at, heights[y, 0] = _brightest(smooth, 1, length - 1)
        if heights[y, 0] < floor:
            at = guide[y]
        index[y] = at
        if at < 0:
            continue
        for x in range(max(0, at - half), min(length, at + half + 1)):
            profiles[y, x - at + half] = line[x]
        left, right = _brightest(smooth, 1, at - half), _brightest(smooth, at + half + 1, length - 1)
        heights[y, 1] = max(left[1], right[1])


@numba.njit(cache=True)
def _neighbours(position: Floats, state: Array, where: Floats, which: Array) -> int:
    """Write one image line's curves in the order of their places to `where` and `which`; return their number.

    A curve that agrees with neither neighbour while these agree with each other is a frame's noise, and left out.
    """
    n = 0
    for k in range(len(position)):
        if state[k] != _WEAK:
            where[n], which[n] = position[k], k
            n += 1
    order = np.argsort(where[:n])
    places, frames = where[:n][order], which[:n][order]
    kept = 0
    for i in range(n):
        before, here, after = frames[max(i - 1, 0)], frames[i], frames[min(i + 1, n - 1)]
        if abs(after - before) <= _JUMP_LINES < min(abs(here - before), abs(here - after)):
            continue
        where[kept], which[kept] = places[i], frames[i]
        kept += 1
    return kept


@numba.njit(cache=True)
def _fill(
    position: Floats, state: Array, n_frames: int, max_gap: float, integer: bool, out: Floats, reason: Array
) -> None:
    """Interpolate along each image line between curves that are neighbours there, in whatever order they come.

    `position`, `state` are (frames, lines); a WEAK curve is absent, any other failure spoils the pixels it borders.
    """
    n_lines = len(out)
    where = np.empty(n_frames)
    which = np.empty(n_frames, np.int64)
    for y in range(n_lines):
        n = _neighbours(position[:, y], state[:, y], where, which)
        for i in range(n - 1):
            gap = where[i + 1] - where[i]
            if gap > max_gap:
                continue
            verdict = max(state[which[i], y], state[which[i + 1], y])
            # A jump here or next door: a depth edge, or curves of two surfaces that interleave.
            for k in range(max(i - 1, 0), min(i + 2, n - 1)):
                close = where[k + 1] - where[k] <= max_gap
                if verdict == _OK and close and abs(which[k + 1] - which[k]) > _JUMP_LINES:
                    verdict = _EDGE
            for x in range(int(np.ceil(where[i])), int(np.floor(where[i + 1])) + 1):
                reason[y, x] = verdict
                t = (x - where[i]) / gap if gap > 0 else 0.5
                if integer:
                    t = np.round(t)
                out[y, x] = which[i] + t * (which[i + 1] - which[i])


@dataclass(frozen=True, slots=True)
class _Pooled:
    """The search in the light of `CELL` image lines together, (cells, length).

    Attributes
    ----------
    cells : Cells
        The lines' pixels.
    level : (cells, length) array
        Dark level of a cell.
    half : int
        Half-width of a profile.
    floor : float
        Least height of a cell's stripe [grey levels].
    """

    cells: Cells
    level: Floats
    half: int
    floor: float

    @classmethod
    def of(cls, level: Floats, noise: float, settings: SweepSettings) -> _Pooled:
        """Prepare for the dark level (lines, length) and the noise of a smoothed sample."""
        cells = cells_of(level.shape, across=False)
        total = np.zeros((len(cells.first) // level.shape[1], level.shape[1]), np.float32)
        sum_cells(level, cells, total.reshape(-1))
        return cls(cells, total, settings.half_width, settings.min_snr * noise * float(np.sqrt(CELL)))

    def stripe(self, frame: Array) -> Array:
        """Where each line's cell shows the stripe of a frame (lines, length), -1 where it does not: (lines,) int32."""
        n = len(self.level)
        sums, nowhere = np.empty(self.level.shape, np.uint32), np.full(n, -1, np.int32)
        index, heights = np.empty(n, np.int32), np.zeros((n, 2), np.float32)
        sum_cells(frame, self.cells, sums.reshape(-1))
        profiles = np.empty((n, 2 * self.half + 1), np.float32)
        _curve(sums, self.level, self.half, self.floor, nowhere, index, profiles, heights)
        return np.repeat(index, CELL)[: len(frame)]


def _too_bright(amplitude: Floats, contrast: Floats, seen: npt.NDArray[np.bool_], most: float) -> npt.NDArray[np.bool_]:
    """Where a stripe would be higher than `most`, to judge by white - black and the stripes that are `seen`.

    What is faint there is the tail of one that lies beyond a silhouette or the image.
    """
    ratio = float(np.median(amplitude[seen] / contrast[seen])) if seen.any() else 0.0
    return np.asarray(ratio * contrast > most)


def _observe(
    frames: Iterator[Array], n_frames: int, scene: Scene, settings: SweepSettings, along_rows: bool
) -> tuple[Floats, Array, float, float]:
    """Find every curve; return positions and states, (frames, lines), the dark noise and a stripe's typical width."""
    first = np.stack([next(frames) for _ in range(settings.window)])
    noise = dark_noise(first, scene)
    level, contrast = dark_level(first, scene, noise), scene.contrast
    if not along_rows:
        level, contrast = np.ascontiguousarray(level.T), np.ascontiguousarray(contrast.T)
    n_lines, length = level.shape
    index = np.full((n_frames, n_lines), -1, np.int32)
    profiles = np.zeros((n_frames, n_lines, settings.window), np.float32)
    heights = np.zeros((n_frames, n_lines, 2), np.float32)
    clipped = np.zeros((n_frames, n_lines), np.bool_)
    floor = RIVAL_SNR * SMOOTH_NOISE * noise
    pooled = _Pooled.of(level, SMOOTH_NOISE * noise, settings)
    for k, frame in enumerate(chain(first, frames)):
        turned = frame if along_rows else np.ascontiguousarray(frame.T)
        guide = pooled.stripe(turned)
        _curve(turned, level, settings.half_width, floor, guide, index[k], profiles[k], heights[k])
        clipped[k] = turned[np.arange(n_lines), index[k]] >= scene.saturated_level
    guided = heights[..., 0] < floor
    none = np.zeros(index.size, np.float32)
    peaks = measure(profiles.reshape(-1, settings.window), none, index.ravel(), length, noise, settings, guided.ravel())
    state = peaks.reason.reshape(index.shape)
    best, second = heights[..., 0], heights[..., 1]
    rival = np.maximum(settings.second_peak_ratio * best, floor)
    state[(state == Reason.OK) & (second > rival)] = Reason.TWO_PEAKS
    paper = contrast[np.arange(n_lines), index]
    seen = (state == Reason.OK) & ~guided & (paper > 0)
    state[guided & _too_bright(peaks.amplitude.reshape(index.shape), paper, seen, _SURELY_SEEN * floor)] = Reason.WEAK
    state[clipped & (index >= 0)] = Reason.SATURATED
    position = peaks.position.reshape(index.shape)
    return np.where(clipped, index, position).astype(np.float32), state, noise, peaks.typical_width


def decode_spatial(
    frames: Iterator[Array], n_frames: int, scene: Scene, settings: SweepSettings, *, along_rows: bool
) -> Sweep:
    """Decode one sweep curve by curve (section 2.3).

    Parameters
    ----------
    frames : iterator of (height, width) arrays
        Read once, in order.
    n_frames : int
        Length of the sweep.
    scene : Scene
        The still scene.
    settings : SweepSettings
        Window, thresholds and the widest gap to interpolate.
    along_rows : bool
        Search along image rows, for a sweep of projector columns; else along image columns.

    Returns
    -------
    Sweep
        Projector coordinate at each pixel's centre.
    """
    position, state, noise, width = _observe(frames, n_frames, scene, settings, along_rows)
    shape = scene.black.shape
    turned = shape if along_rows else shape[::-1]
    out = np.full(turned, np.nan, np.float32)
    reason = np.full(turned, int(Reason.WEAK), np.uint8)
    _fill(position, state, n_frames, settings.max_gap_px, settings.peak == "integer", out, reason)
    if not along_rows:
        out, reason = np.ascontiguousarray(out.T), np.ascontiguousarray(reason.T)
    reason[shadowed(scene, noise, settings)] = Reason.SHADOW
    return Sweep(out, reason, width)

"""Whether a sweep's lines are each shown once and for as long as the others: all of them together make the white frame.

A line shown twice or for longer makes its own pixels brighter and its neighbours' darker; shading and the white frame's
own noise know nothing of lines. That every line is late by the same share is not seen: it moves all coordinates alike.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from deskew.acquisition.projectorcheck import FEWEST_PIXELS, STRAY_MAX, bright_pixels, out_of_step
from deskew.types import Array, Floats, ProjectorCheck

_WHITE_RANGE = (0.9, 1.1)  # of all lines together, over white minus black
_FEWEST_LINES = 50
_FEWEST_ON_LINE = 8
_SAMPLE = 40_000  # pixels
_WINDOW = 6  # lines on either side of a pixel's own that hold all of its light, also from a doubled stripe
_ODD = 0.05  # change of light that stands out from the lines beside it
_CERTAIN = 6.0  # standard errors
_SEEN = 0.2  # of white - black: a pixel with less light around its peak has not seen its line


class SweepWatch:
    """Follows a sample of the bright pixels through a sweep, the light around the brightest frame of each.

    Parameters
    ----------
    lit : (height, width) array
        White - black where it can be judged [grey levels].
    columns : bool
        Whether the projector's columns are swept, else its rows: pixels are taken in whole lines across those.
    """

    def __init__(self, lit: Floats, *, columns: bool) -> None:
        stride = max(1, lit.size // _SAMPLE)
        sampled = np.zeros(lit.shape, dtype=bool)
        across = sampled if columns else sampled.T
        across[stride // 2 :: stride] = True
        self._where = np.flatnonzero(sampled & bright_pixels(lit))
        self._lit = lit.ravel()[self._where]
        n = len(self._where)
        self._ring = np.zeros((2 * _WINDOW + 1, n), dtype=np.float32)
        self._near = np.zeros_like(self._ring)
        self._best = np.full(n, -np.inf, dtype=np.float32)
        self._peak = np.zeros(n)
        self._total = np.zeros(n)
        self._n_frames = 0

    def passing(self, frame: Array) -> Array:
        """Look at the next frame and hand it on."""
        window = len(self._ring)
        values = frame.ravel()[self._where]
        self._ring[self._n_frames % window] = values
        self._total += values
        self._n_frames += 1
        middle = self._n_frames - 1 - _WINDOW
        if middle >= _WINDOW:
            height = self._ring[middle % window]
            higher = np.flatnonzero(height > self._best)
            self._best[higher] = height[higher]
            self._peak[higher] = middle
            order = (middle + np.arange(-_WINDOW, _WINDOW + 1)) % window
            self._near[:, higher] = self._ring[np.ix_(order, higher)]
        return frame

    def check(self, name: str) -> ProjectorCheck:
        """Judge the whole sweep; a fault calls it by `name`."""
        n_others = self._n_frames - len(self._near)
        if len(self._where) < FEWEST_PIXELS or n_others < len(self._near):
            return ProjectorCheck()
        # What lies far from the peak is the pixel's dark level.
        above = self._near - (self._total - self._near.sum(axis=0)) / n_others
        light = above.sum(axis=0)
        good = light > _SEEN * self._lit
        if good.sum() < FEWEST_PIXELS:
            return ProjectorCheck()
        above, light = above[:, good], light[good]
        offset = np.arange(-_WINDOW, _WINDOW + 1)[:, None]
        shift = (offset * above).sum(axis=0) / light
        variance = float(np.median(((offset - shift) ** 2 * above).sum(axis=0) / light))
        return _judged(self._peak[good] + shift, light / self._lit[good], max(variance, 0.1), name)


def _judged(place: Floats, total: Floats, variance: float, name: str) -> ProjectorCheck:
    """Judge pixels by where their light peaks [lines] and by all of it over white - black, both (n,).

    `variance` is that of a stripe [lines^2].
    """
    level = float(np.median(total))
    faults = []
    if not _WHITE_RANGE[0] <= level <= _WHITE_RANGE[1]:
        faults.append(
            f"All lines of the {name} together are {level:.2f} times as bright as the white frame: camera or projector "
            "is not linear, or the exposure changed between them."
        )
    lines = _lines(place, total / level)
    if lines is None:
        return ProjectorCheck(tuple(faults))
    stray, certain = _unevenness(lines, variance)
    odd = _odd_lines(lines)
    if (stray > STRAY_MAX and certain) or len(odd) > 0:
        where = f", most clearly near line {odd[0]}" if len(odd) > 0 else ""
        faults.append(out_of_step(stray, f"the sweep of the {name}{where}"))
    return ProjectorCheck(tuple(faults), stray=stray)


@dataclass(frozen=True, slots=True)
class _Lines:
    """Pixels by line, of the lines that enough of them see: first line's number, mean light and its error, NaN else."""

    first: int
    mean: Floats
    error: Floats


def _lines(place: Floats, total: Floats) -> _Lines | None:
    line = np.rint(place).astype(int)
    first = int(line.min())
    line -= first
    count = np.bincount(line)
    seen = count >= _FEWEST_ON_LINE
    both = int((seen[1:] & seen[:-1]).sum())
    if both < _FEWEST_LINES:
        return None
    mean = np.bincount(line, total) / np.maximum(count, 1)
    spread = np.bincount(line, (total - mean[line]) ** 2) / np.maximum(count - 1, 1)
    error = np.sqrt(float(np.median(spread[seen])) / np.maximum(count, 1))
    return _Lines(first, np.where(seen, mean, np.nan), np.where(seen, error, np.nan))


def _unevenness(lines: _Lines, variance: float) -> tuple[float, bool]:
    """Root mean square share of a line's light that varies from frame to frame, and whether it is beyond doubt.

    Shares that vary by sigma from frame to frame, independently, make differences between frames; a pixel sees them
    through a stripe of variance s^2, and differences from line to line are taken once more against shading. Of white
    noise, that leaves the power ``sigma^2 / (2 pi) integral w^4 exp(-s^2 w^2) dw = 3 sigma^2 / (8 sqrt(pi) s^5)``.
    """
    power = np.diff(lines.mean) ** 2
    noise = lines.error[1:] ** 2 + lines.error[:-1] ** 2
    seen = np.isfinite(power)
    weight = 1.0 / noise[seen] ** 2
    excess = float((weight * (power - noise)[seen]).sum() / weight.sum())
    # Squares of neighbouring differences are correlated by 1/4: their mean varies 1.5 times as much as of others.
    doubt = float(np.sqrt(3.0 / weight.sum()))
    passed = 3.0 / (8.0 * np.sqrt(np.pi) * (variance + 1.0 / 12.0) ** 2.5)
    return float(np.sqrt(max(excess, 0.0) / passed)), excess > _CERTAIN * doubt


def _odd_lines(lines: _Lines) -> Floats:
    """Return the numbers of the lines whose light stands out, the clearest first."""
    smooth = ndimage.median_filter(np.nan_to_num(lines.mean, nan=1.0), 9)
    excess = np.abs(np.nan_to_num(lines.mean - smooth))
    odd = np.flatnonzero(excess > np.maximum(_ODD, _CERTAIN * np.nan_to_num(lines.error, nan=np.inf)))
    return np.asarray(odd[np.argsort(-excess[odd])] + lines.first)

"""The line sweep, rendered frame by frame: only the sub-samples near the lit line are touched."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numba import njit

from data_synth.geometry import Ints
from data_synth.noise import RUN, deviation, deviations, digitised, expose, quantile_table, run_start
from data_synth.optics import PROFILE_STEPS, line_profile, psf_taps
from data_synth.rig import RigConfig
from data_synth.shading import SUBSAMPLES
from data_synth.synchrony import frames_in
from deskew.errors import require
from deskew.types import Array, Floats


@dataclass(frozen=True, slots=True)
class Sweep:
    """Lazy frames of a sweep; frame i lights projector line i. Nothing is rendered until it is asked for.

    Any frame can be rendered alone and comes out the same: its noise depends on seed, frame and pixel only.

    Attributes
    ----------
    coordinate : (rows, columns) float32 array
        Projector coordinate across the lines at each sub-sample [px].
    light : (rows, columns) float32 array
        Grey levels that each sub-sample adds when its line is fully lit.
    black : (height, width) float32 array
        Mean of the black frame [grey levels].
    n_lines : int
        Frames.
    config : RigConfig
        Blur and noise.
    key, first_frame : int
        Noise seed and the number of frame 0 in the noise's count.
    upright : bool
        Lines run down the image (a column sweep); otherwise the work is done on the transposed image.
    """

    coordinate: Floats
    light: Floats
    black: Floats
    n_lines: int
    config: RigConfig
    key: int
    first_frame: int
    upright: bool

    def __len__(self) -> int:
        """Return the number of frames."""
        return self.n_lines

    def __iter__(self) -> Iterator[npt.NDArray[np.uint8]]:
        """Yield the frames (height, width) uint8 in projection order, from the first one each time."""
        painter = _Painter.of(self)
        return (painter.frame(line) for line in range(self.n_lines))

    def __getitem__(self, line: int) -> npt.NDArray[np.uint8]:
        """Render one frame alone; a run over all of them is much cheaper by iteration."""
        require(0 <= line < self.n_lines, "line", f"be in [0, {self.n_lines - 1}]", line)
        return _Painter.of(self).frame(line)


@dataclass(frozen=True, slots=True)
class _Painter:
    """A sweep's samples sorted by line, with the tables and the scratch planes of one run through it."""

    sweep: Sweep
    profile: Floats
    taps: Floats
    starts: Ints
    places: npt.NDArray[np.int16]
    values: Floats
    noise: tuple[Floats, Floats, float, float]
    scratch: tuple[Floats, Ints, Floats]

    @classmethod
    def of(cls, sweep: Sweep) -> _Painter:
        """Sort the samples and set up the scratch."""
        coordinate, light = sweep.coordinate, sweep.light
        if not sweep.upright:
            coordinate, light = np.ascontiguousarray(coordinate.T), np.ascontiguousarray(light.T)
        config = sweep.config
        profile, taps = (
            line_profile(config.projector_blur_sigma_px, config.stripe_width_px),
            psf_taps(config.camera_psf_sigma_px),
        )
        reach = len(profile) / PROFILE_STEPS
        starts, places, values = _sorted_by_line(coordinate, light, sweep.n_lines, reach)
        read, shot = sweep.config.noise_variance
        mean = sweep.black.ravel()
        sigma = deviations(mean, read, shot)
        rows, columns = coordinate.shape
        scratch = (
            np.zeros((rows, columns), dtype=np.float32),
            np.tile(np.array([[columns, -1]], dtype=np.int64), (rows, 1)),
            np.zeros(columns, dtype=np.float32),
        )
        return cls(sweep, profile, taps, starts, places, values, (mean, sigma, read, shot), scratch)

    def frame(self, line: int) -> npt.NDArray[np.uint8]:
        """Render one frame."""
        sweep = self.sweep
        mean, sigma, read, shot = self.noise
        number = sweep.first_frame + line
        image = np.empty(sweep.black.shape, dtype=np.uint8)
        expose(mean, sigma, quantile_table(), sweep.key, number, image.reshape(-1))
        plane, spans, buffer = self.scratch
        top, bottom = len(plane), -1
        for shown, share in frames_in(sweep.config, sweep.key, number, line):
            if shown >= 0:
                weighted = np.float32(share) * self.profile
                first, last = _scatter(self.starts, self.places, self.values, shown, weighted, plane, spans)
                top, bottom = min(top, first), max(bottom, last)
        _, width = sweep.black.shape
        strides = (width, 1) if sweep.upright else (1, width)
        noise = (quantile_table(), sweep.key, number, np.float32(read), np.float32(shot))
        _paint(plane, spans, buffer, top, bottom, self.taps, mean, strides, noise, image.reshape(-1))
        _clear(plane, spans, top, bottom)
        return image


@njit(cache=True)
def _sorted_by_line(coordinate: Floats, light: Floats, n_lines: int, reach: float) -> tuple[Ints, Ints, Floats]:
    """Sort the lit sub-samples by nearest line, by counting.

    Returns the runs' starts (n_lines + 1,), the samples' (row, column) int16 and their (coordinate, light) float32.
    """
    counts = np.zeros(n_lines + 1, dtype=np.int64)
    rows, columns = coordinate.shape
    lines = np.full((rows, columns), -1, dtype=np.int16)
    for y in range(rows):
        for x in range(columns):
            if light[y, x] > 0 and -reach < coordinate[y, x] < n_lines - 1 + reach:
                lines[y, x] = min(max(int(np.floor(coordinate[y, x] + np.float32(0.5))), 0), n_lines - 1)
                counts[lines[y, x] + 1] += 1
    starts = np.cumsum(counts)
    fill = starts.copy()
    places = np.empty((starts[-1], 2), dtype=np.int16)
    values = np.empty((starts[-1], 2), dtype=np.float32)
    for y in range(rows):
        for x in range(columns):
            if lines[y, x] >= 0:
                k = fill[lines[y, x]]
                fill[lines[y, x]] += 1
                places[k, 0], places[k, 1] = y, x
                values[k, 0], values[k, 1] = coordinate[y, x], light[y, x]
    return starts, places, values


@njit(cache=True)
def _scatter(
    starts: Ints, places: Ints, values: Floats, line: int, profile: Floats, plane: Floats, spans: Ints
) -> tuple[int, int]:
    """Add the light of a line to the sub-samples near it.

    `spans` is widened to each row's touched columns; the result are the touched rows.
    """
    n_lines = len(starts) - 1
    radius = len(profile) // PROFILE_STEPS + 1
    top, bottom = len(plane), -1
    last = len(profile) - 1
    for k in range(starts[max(line - radius, 0)], starts[min(line + radius, n_lines - 1) + 1]):
        distance = abs(values[k, 0] - np.float32(line)) * np.float32(PROFILE_STEPS)
        i = int(distance)
        if i >= last:
            continue
        y, x = places[k, 0], places[k, 1]
        plane[y, x] += values[k, 1] * (profile[i] + (distance - np.float32(i)) * (profile[i + 1] - profile[i]))
        spans[y, 0] = min(spans[y, 0], x)
        spans[y, 1] = max(spans[y, 1], x)
        top, bottom = min(top, y), max(bottom, y)
    return top, bottom


@njit(cache=True)
def _paint(
    plane: Floats,
    spans: Ints,
    buffer: Floats,
    top: int,
    bottom: int,
    taps: Floats,
    mean: Floats,
    strides: tuple[int, int],
    noise: tuple[Floats, int, int, float, float],
    image: Array,
) -> None:
    """Blur the touched sub-samples into pixels and expose those anew, with the noise of their own signal."""
    table, key, frame, read, shot = noise
    half = len(taps) // 2 - 1
    margin = (half + SUBSAMPLES - 1) // SUBSAMPLES
    first = margin * SUBSAMPLES - half
    height, width = plane.shape[0] // SUBSAMPLES - 2 * margin, plane.shape[1] // SUBSAMPLES - 2 * margin
    for y in range(max((top - first - len(taps)) // SUBSAMPLES, 0), min((bottom - first) // SUBSAMPLES + 1, height)):
        base = y * SUBSAMPLES + first
        left, right = len(buffer), -1
        for k in range(len(taps)):
            left, right = min(left, spans[base + k, 0]), max(right, spans[base + k, 1])
        if right < 0:
            continue
        for k in range(len(taps)):
            row = plane[base + k]
            for x in range(left, right + 1):
                buffer[x] += taps[k] * row[x]
        for x in range(max((left - first - len(taps)) // SUBSAMPLES, 0), min((right - first) // SUBSAMPLES + 1, width)):
            signal = np.float32(0.0)
            for k in range(len(taps)):
                signal += taps[k] * buffer[x * SUBSAMPLES + first + k]
            i = y * strides[0] + x * strides[1]
            value = mean[i] + signal
            offset = run_start(key, frame, i // RUN) + i % RUN
            image[i] = digitised(value + deviation(value, read, shot) * table[offset])
        buffer[left : right + 1] = 0.0


@njit(cache=True)
def _clear(plane: Floats, spans: Ints, top: int, bottom: int) -> None:
    """Leave the scratch as it was."""
    for y in range(top, bottom + 1):
        if spans[y, 1] >= 0:
            plane[y, spans[y, 0] : spans[y, 1] + 1] = 0.0
            spans[y, 0] = plane.shape[1]
            spans[y, 1] = -1

"""Seconds and memory of flattening alone, by method and size, beside libigl's as-rigid-as-possible in the same run."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from statistics import median

import numpy as np

from data_synth import surfaces
from deskew import flattening
from deskew.flattening import peers
from deskew.io import sheet_mesh
from deskew.types import Sheet
from experiments.reporting import Column, Times
from experiments.trials import Recorder, reason_of

Work = Callable[[], object]

RIVAL = "arap"
SIZES = (45, 100, 200, 400, 1000)
LARGEST = {"spring": 1000, RIVAL: 400, "lscm": 200, "slim": 200}
"""Side of the largest grid that each method is timed on [vertices]."""
MESH_SIZES = (45, 100, 200)
MESH_METHODS = ("spring", RIVAL)

_SIDE_MM = 216.0
_SLOPE_P90_DEG = 20.0
_ENOUGH_S = 4.0  # what takes longer is not repeated

TIMES = Times(
    "Flattening",
    "CPU seconds for a crumpled sheet of square cells, by vertices a side: as a grid, and as `mesh/` of triangles. "
    "Median of the repetitions after a warm-up, fewer where they are slow. The ratio is to libigl's `arap`, 20 "
    "iterations without the start that it needs, on the same sheet in the same run; `spring` includes everything.",
    (
        Column("seconds_flatten", "flatten [s]", 4),
        Column("ratio_to_arap", "to arap", 3),
        Column("peak_mb", "peak [MB]", 0),
    ),
    (*map(str, SIZES), *(f"mesh/{n}" for n in MESH_SIZES)),
)


def time_flattening(record: Recorder, rng: np.random.Generator, n: int) -> None:
    """Time every method on grids of every size that it is fast enough for, and on triangle meshes.

    Parameters
    ----------
    record : Recorder
        Gets `seconds_flatten`, `ratio_to_arap` and `peak_mb` for each condition and method; a method that is not
        there or breaks fails its own rows.
    rng : numpy Generator
        Draws the sheets.
    n : int
        Repetitions at most.
    """
    seed = int(rng.integers(1 << 62))
    small = _grid(MESH_SIZES[0], seed)
    for method in LARGEST:
        _time(record, "", method, small, 0)
    for size in SIZES:
        grid = _grid(size, seed)
        _compare(record, str(size), [m for m, largest in LARGEST.items() if size <= largest], grid, n)
        if size in MESH_SIZES:
            _compare(record, f"mesh/{size}", MESH_METHODS, sheet_mesh(grid).sheet, n)


def _grid(size: int, seed: int) -> Sheet:
    """One and the same crumpled square, sampled with so many vertices a side."""
    sheet = surfaces.mirror(np.random.default_rng(seed), (size, size), (_SIDE_MM, _SIDE_MM), _SLOPE_P90_DEG)
    return Sheet(sheet.vertices)


def _compare(record: Recorder, condition: str, methods: list[str] | tuple[str, ...], sheet: Sheet, n: int) -> None:
    seconds = {method: _time(record, condition, method, sheet, n) for method in methods}
    rival = seconds.get(RIVAL)
    for method, taken in seconds.items():
        if taken is not None and rival is not None:
            record.add_times(condition, method, {"ratio_to_arap": taken / rival})


def _time(record: Recorder, condition: str, method: str, sheet: Sheet, n: int) -> float | None:
    """Median of at most n times [s]; None if the method failed, and without a condition nothing is recorded."""
    try:
        work = _work(method, sheet)
        if not condition:
            work()
            return None
        with record.memory(condition, method):
            seconds = _seconds(work, n)
    except Exception as error:
        if condition:
            record.fail(condition, method, reason_of(error))
        return None
    record.add_times(condition, method, {"seconds_flatten": median(seconds)})
    return median(seconds)


def _seconds(work: Work, n: int) -> list[float]:
    seconds: list[float] = []
    while not seconds or (len(seconds) < n and sum(seconds) < _ENOUGH_S):
        start = time.process_time()
        result = work()
        seconds.append(time.process_time() - start)
        # The next repetition must not find the last one's result in its memory.
        del result
    return seconds


def _work(method: str, sheet: Sheet) -> Work:
    """Return what is timed; the peers take triangles, and ARAP a start that is not timed."""
    if method == "spring":
        return partial(flattening.flatten, sheet, method=method)
    mesh = sheet_mesh(sheet).sheet
    if method != RIVAL:
        return partial(flattening.flatten, mesh, method=method)
    vertices, faces = peers.as_mesh(mesh)
    return partial(peers.arap_places, vertices, faces, peers.lscm_places(vertices, faces))

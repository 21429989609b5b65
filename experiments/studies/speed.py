"""How fast every stage is, beside a memory triad over the bytes of a full sweep, and where the time goes."""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from functools import partial
from typing import Any, ClassVar

import numpy as np

import data_synth
from data_synth import Checkerboard, Rig, TrueSheet
from deskew import acquisition, flattening, pipeline, restoration
from deskew.acquisition import DenoiseSettings, SweepSettings
from deskew.errors import require
from deskew.types import Calibration, Capture, Correspondence, DepthMap
from experiments.reporting import Column, Layout, Times
from experiments.settings import Config
from experiments.studies import flattening_times
from experiments.studies.stopwatch import TRIAD, Stopwatch
from experiments.studies.study import Study
from experiments.studies.trial_sheets import refuse_sheets
from experiments.trials import Outcome, Recorder, TrialKey

_MODES = ("spatial", "temporal")
_STAGES = (
    TRIAD,
    "photograph",
    "render",
    *(f"decode/{mode}" for mode in _MODES),
    *(f"sweep/{mode}" for mode in _MODES),
    "calibrate",
    "ink",
    "depth_map",
    "denoise",
    "mesh",
    "flatten",
    "restore",
)


class Speed(Study):
    """One crumpled checkerboard through the whole chain, every stage timed by itself in one process.

    Its numbers are all in `timings.csv`: a machine gives no times twice. `trials` are the repetitions of each stage.

    Conditions
    ----------
    `triad`
        ``a = b + s c`` over as many bytes as the frames of a full sweep have: the unit of every ratio.
    `photograph`
        Geometry, white and black frame, without the sweep.
    `render`
        The frames of both sweeps, one by one.
    `decode/spatial`, `decode/temporal`
        Decoding alone, of frames held in memory.
    `sweep/spatial`, `sweep/temporal`
        All of that streamed: photographed, rendered and decoded, no frame kept.
    `calibrate`
        Corners and joint bundle of the decoded boards.
    `ink`, `depth_map`, `denoise`, `mesh`, `flatten`, `restore`
        The stages of a scan and a restoration, on the temporal reading; `flatten` for each method.
    `45`, `100`, `200`, `400`, `1000`
        Flattening alone of a crumpled grid with so many vertices a side, by `spring`, `arap` (up to 400), `lscm` and
        `slim` (up to 200), whatever `method` says.
    `mesh/45`, `mesh/100`, `mesh/200`
        The same grids as triangle meshes, by `spring` and `arap`.
    """

    layout: ClassVar[Layout] = Layout(
        "Speed",
        "Times are of one process on one thread; they are comparable between machines as ratios only.",
        (Column("frames", "frames", 0), Column("depth_coverage", "pixels with a depth", 4)),
        times=(
            Times(
                "CPU time",
                "Median of the repetitions after a warm-up, whose extra time (compiling, or loading what was compiled "
                "before) stands apart. A triad moves the bytes of a full sweep's frames once. `peak` is the whole "
                "process's, with all that it has imported; under `decode` it includes the frames, which streaming does "
                "not keep. The bars: a full sweep photographed, rendered and decoded in about 2 s, a quarter of it "
                "decoding, in at most 700 MB.",
                (
                    Column("triads", "triads", 1),
                    Column("seconds_cpu", "CPU [s]", 3),
                    Column("seconds_min", "min [s]", 3),
                    Column("seconds_max", "max [s]", 3),
                    Column("seconds_warmup", "warm-up [s]", 2),
                    Column("peak_mb", "peak [MB]", 0),
                ),
                _STAGES,
            ),
            flattening_times.TIMES,
        ),
        profile=Times(
            "Where the time goes",
            "Share of each stage's time by function, without what it calls; a compiled kernel holds all that it calls. "
            "One run of each stage under Python's profiler, which makes Python itself look slower than it is.",
            (Column("share_self", "share", 3),),
            _STAGES,
        ),
    )

    def plan(self, config: Config) -> list[TrialKey]:
        """Plan one trial, whatever the number of repetitions: times are compared within one process only."""
        built_in = set(config.methods) <= flattening.METHODS.keys()
        allowed = f"be built-in ones, {', '.join(flattening.METHODS)}, since others are timed with their process"
        require(built_in, "method", allowed, config.methods)
        refuse_sheets(config, "this experiment times on mirror folds")
        return [TrialKey(config.experiment, seed=config.seed)]

    def run(self, config: Config, shared: Any, key: TrialKey) -> Outcome:
        """Time everything."""
        record, rng = Recorder(key), key.generator()
        rig = data_synth.default_rig(config.rig.noise_scale)
        width, height = rig.camera.size
        n_frames = sum(rig.projector.size)
        watch = Stopwatch(record, config.trials, n_frames * width * height)
        sheet = data_synth.crumpled(rng, slope_p90_deg=config.sheet.slope_p90_deg)
        record.add("sweep", "-", {"frames": n_frames})
        capture, decoded = _time_sweep(watch, rig, sheet, int(rng.integers(1 << 62)))
        calibration = _time_calibration(watch, rig, rng, config.rig.board_poses)
        depth = _time_scan(watch, capture, decoded, calibration)
        record.add("depth_map", "-", {"depth_coverage": float(np.isfinite(depth.z).mean())})
        _time_restoration(watch, capture, calibration, depth, config)
        watch.finish()
        flattening_times.time_flattening(record, rng, config.trials)
        return record.outcome()


def _time_sweep(watch: Stopwatch, rig: Rig, sheet: TrueSheet, seed: int) -> tuple[Capture, Correspondence]:
    """Time the sweep streamed first, in a process that holds nothing else; return its temporal reading."""

    def photograph() -> Capture:
        return data_synth.photograph(rig, sheet, Checkerboard(), seed)

    def read(frames: Capture, mode: str) -> Correspondence:
        return pipeline.decode(frames, settings=SweepSettings(mode=mode))

    def sweep(mode: str) -> Correspondence:
        return read(photograph(), mode)

    for mode in _MODES:
        watch.time(f"sweep/{mode}", partial(sweep, mode))
    capture = watch.time("photograph", photograph)
    watch.time("render", lambda: [deque(frames, maxlen=0) for frames in (capture.columns, capture.rows)])
    held = replace(capture, columns=list(capture.columns), rows=list(capture.rows))
    found = {mode: watch.time(f"decode/{mode}", partial(read, held, mode)) for mode in _MODES}
    return capture, found["temporal"]


def _time_calibration(watch: Stopwatch, rig: Rig, rng: np.random.Generator, n_poses: int) -> Calibration:
    shots = []
    for pose in data_synth.board_poses(n_poses):
        shot = data_synth.render_board(rig, pose, rng)
        decoded = pipeline.decode(shot, settings=SweepSettings(mode="temporal"))
        # Corners ask for white and black alone; the samples behind the sweeps would fill the memory.
        shots.append((_without_frames(shot), decoded))
    board = data_synth.BOARD
    return watch.time(
        "calibrate",
        lambda: acquisition.calibrate(board, [acquisition.view_board(board, *shot) for shot in shots]),
    )


def _without_frames(shot: Capture) -> Capture:
    none: Any = [range(n) for n in shot.projector_size]
    return replace(shot, columns=none[0], rows=none[1])


def _time_scan(watch: Stopwatch, capture: Capture, decoded: Correspondence, calibration: Calibration) -> DepthMap:
    corrected = watch.time("ink", lambda: acquisition.correct_ink(calibration, decoded, capture))
    depth = watch.time("depth_map", lambda: acquisition.depth_map(calibration, corrected))
    return watch.time("denoise", lambda: acquisition.denoise_depth(depth, DenoiseSettings()))


def _time_restoration(
    watch: Stopwatch, capture: Capture, calibration: Calibration, depth: DepthMap, config: Config
) -> None:
    shape = (config.mesh.rows, config.mesh.columns)
    scan = watch.time("mesh", lambda: pipeline.span(capture, calibration, depth, shape=shape))
    for method in config.methods:
        flattened = watch.time("flatten", partial(flattening.flatten, scan.sheet, method=method), method=method)
    watch.time("restore", lambda: restoration.restore_textures(scan, flattened, ["white"]))

"""The study of speed: its arithmetic on a clock of our own, and the whole of it on a bench of a quarter of the size."""

from __future__ import annotations

import csv
import os
import subprocess
import sys
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import data_synth
from data_synth import Rig
from deskew import projection
from deskew.types import Calibration, Pinhole
from experiments.program import main
from experiments.reporting import Column, Layout, Times
from experiments.reporting.tables import table, times_page
from experiments.studies import flattening_times, speed, stopwatch
from experiments.studies.profiles import profiled
from experiments.studies.stopwatch import Stopwatch
from experiments.trials import Recorder, Row, TrialKey

STAGES = {"photograph", "render", "calibrate", "ink", "depth_map", "denoise", "mesh", "flatten", "restore"}
SWEEPS = {f"{what}/{mode}" for what in ("decode", "sweep") for mode in ("spatial", "temporal")}


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The process's CPU time as the tests set it."""
    now = [0.0]
    monkeypatch.setattr(stopwatch.time, "process_time", lambda: now[0])
    return now


def timings(record: Recorder) -> dict[tuple[str, str], dict[str, float]]:
    found: dict[tuple[str, str], dict[str, float]] = defaultdict(dict)
    for row in record.outcome().timings:
        found[row.condition, row.method][row.metric] = row.value
    return found


def test_the_median_stands_apart_from_the_warm_up_and_is_a_ratio_to_the_triad(
    clock: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    triads: Iterator[list[float]] = iter([[0.5, 0.5, 9.0], [0.5, 0.25, 0.5]])
    monkeypatch.setattr(stopwatch, "triad_seconds", lambda n_bytes, n: next(triads))
    takes = iter([10.0, 2.0, 7.0, 3.0, 4.0])

    def work() -> str:
        clock[0] += next(takes)
        return "done"

    record = Recorder(TrialKey("speed"))
    watch = Stopwatch(record, 3, 1000)
    assert watch.time("decode", work) == "done"
    watch.finish()
    assert next(takes, None) is None
    found = timings(record)
    measured = {name: value for name, value in found["decode", "-"].items() if name != "peak_mb"}
    expected = {"seconds_cpu": 3.0, "seconds_min": 2.0, "seconds_max": 7.0, "seconds_warmup": 7.0, "triads": 6.0}
    assert measured == expected
    assert found["triad", "-"] == {"seconds_cpu": 0.5, "triads": 1.0}
    assert record.outcome().rows == ()


def test_the_triad_moves_the_bytes_that_it_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    moved: list[int] = []
    monkeypatch.setattr(stopwatch, "_triad", lambda a, b, c, s: moved.append(a.nbytes + b.nbytes + c.nbytes))
    assert len(stopwatch.triad_seconds(24_000, 3)) == 3
    assert moved == [24_000] * 4
    monkeypatch.undo()
    a, b, c = np.zeros(7), np.arange(7.0), np.ones(7)
    stopwatch._triad(a, b, c, 3.0)
    assert a.tolist() == [3, 4, 5, 6, 7, 8, 9]


_MEASURED = """
import numpy as np
from experiments.trials import Recorder, TrialKey
record = Recorder(TrialKey("speed"))
with record.memory("large"):
    block = np.ones(25_000_000)
assert block.sum() == 25_000_000
del block
with record.memory("small"):
    pass
found = {row.condition: row.value for row in record.outcome().timings if row.metric == "peak_mb"}
print(found["large"], found["small"], found["-"])
"""


def test_peak_memory_is_each_stages_own_and_the_trials_is_the_highest() -> None:
    # In a process of its own: one that has run other tests holds memory that the system may take back meanwhile.
    root = Path(__file__).parents[2]
    done = subprocess.run([sys.executable, "-c", _MEASURED], cwd=root, capture_output=True, text=True, check=True)
    large, small, trial = map(float, done.stdout.split())
    assert 0.0 < small <= large <= trial
    if os.access("/proc/self/clear_refs", os.W_OK):
        assert large - small > 150


def test_a_profile_names_kernels_and_functions_without_their_folders() -> None:
    camera = data_synth.default_rig().camera
    pixels = projection.pixel_grid(camera.size)
    kernel = projection._undistorted

    def work() -> str:
        projection.undistort(camera, pixels)
        return "-".join(str(k) for k in sorted(range(50_000)))[:3]

    work()
    result, shares = profiled(work)
    assert result == "0-1"
    assert projection._undistorted is kernel
    assert sum(shares.values()) == pytest.approx(1.0)
    assert 0.1 < shares["deskew/projection.py:_undistorted"] < 1.0
    assert 0.0 < shares["tests/experiments/test_speed.py:<genexpr>"] < 1.0
    assert not any(name.startswith("/") for name in shares)


def test_times_head_the_table_in_their_own_order() -> None:
    def rows(condition: str, method: str, value: float) -> Row:
        return Row.of(TrialKey("speed"), condition, method, "triads", value)

    times = Times("CPU time", "A note.", (Column("triads", "triads", 1),), ("triad", "flatten", "absent"))
    timings = [rows("decode", "-", 30.0), rows("flatten", "a", 2.0), rows("flatten", "b", 4.0), rows("triad", "-", 1.0)]
    other = Row.of(TrialKey("speed"), "-", "-", "peak_mb", 400.0)
    text = table(Layout("Speed", "N", (), times=(times,)), [], [], sorted([*timings, other]))
    lines = ["| triad | - | 1.0 |", "| flatten | b | 4.0 |", "| flatten | a | 2.0 |", "| decode | - | 30.0 |"]
    assert "\n".join(lines) in text
    assert text.index("## CPU time") < text.index("A note.") < text.index(lines[0])
    assert "| - | - |" not in text
    assert times_page(times, timings).startswith("# CPU time\n\nA note.\n\n| condition")


def small_rig(noise_scale: float) -> Rig:
    """The default bench with half of the camera's and a quarter of the projector's pixels, each way."""

    def scaled(device: Pinhole, factor: float) -> Pinhole:
        K = device.K.copy()
        K[:2] *= factor
        K[:2, 2] += (factor - 1) / 2
        return replace(device, size=(round(device.size[0] * factor), round(device.size[1] * factor)), K=K)

    rig = FULL_RIG(noise_scale)
    return replace(rig, camera=scaled(rig.camera, 0.5), projector=scaled(rig.projector, 0.25))


FULL_RIG: Callable[[float], Rig] = data_synth.default_rig


def true_calibration(watch: Stopwatch, rig: Rig, rng: np.random.Generator, n_poses: int) -> Calibration:
    return watch.time("calibrate", lambda: Calibration(rig.camera, rig.projector, {}, camera_psf_px=0.8))


def test_every_stage_is_timed_and_no_time_is_a_result(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(data_synth, "default_rig", small_rig)
    monkeypatch.setattr(speed, "_time_calibration", true_calibration)
    monkeypatch.setattr(flattening_times, "time_flattening", lambda record, rng, n: None)
    out = tmp_path / "out"
    line = "experiment=speed trials=1 mesh.rows=9 mesh.columns=9 method=paper_euler"
    assert main([*line.split(), f"out={out}"]) == 0
    found: dict[str, dict[str, float]] = defaultdict(dict)
    with (out / "timings.csv").open() as file:
        for row in csv.DictReader(file):
            if row["metric"] != "share_self":
                found[row["condition"]][row["metric"]] = float(row["value"])
    assert set(found) == {"triad", *STAGES, *SWEEPS, "prepare", "-"}
    for stage in STAGES | SWEEPS:
        times = found[stage]
        assert times["triads"] == pytest.approx(times["seconds_cpu"] / found["triad"]["seconds_cpu"])
        assert times["seconds_min"] <= times["seconds_cpu"] <= times["seconds_max"]
        assert 0.0 < times["peak_mb"] <= found["-"]["peak_mb"]
    with (out / "results.csv").open() as file:
        results = {row["metric"]: float(row["value"]) for row in csv.DictReader(file)}
    assert results.pop("frames") == 256 + 192
    assert 0.8 < results.pop("depth_coverage") < 1.0
    assert not results
    assert "| sweep/temporal | - |" in (out / "table.md").read_text()
    assert "| render | data_synth/sweep.py:_paint |" in (out / "profile.md").read_text()

"""The comparison of decoders: how frames are spent, and that every pattern has its row."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import pytest

import data_synth
from deskew.types import Calibration, PatternKind, Pinhole, n_frames
from experiments.program import main
from experiments.studies import decoders
from experiments.studies.bench import Bench


def smaller(device: Pinhole) -> Pinhole:
    """A quarter of the pixels each way."""
    K = device.K.copy()
    K[:2, 2] = (K[:2, 2] + 0.5) / 4 - 0.5
    K[[0, 0, 1], [0, 1, 1]] /= 4
    return replace(device, size=(device.size[0] // 4, device.size[1] // 4), K=K)


@pytest.mark.parametrize("allowed", [40, 160, 1792])
def test_every_pattern_spends_what_it_may_and_the_sweep_its_own(allowed: int) -> None:
    found = decoders.plans((1024, 768), [allowed])
    assert [plan.pattern for _, plan in found] == list(PatternKind)
    assert found[0] == (1792, decoders.Plan(PatternKind.LINE_SWEEP, (), 1, 1792))
    for budget, plan in found[1:]:
        assert budget == allowed
        assert 0.97 * allowed < plan.frames <= allowed
        shown = sum(n_frames(plan.pattern, extent, plan.fringes) for extent in (1024, 768))
        assert shown * plan.exposures == plan.frames


def test_the_study_measures_every_pattern_on_both_pages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rig = data_synth.default_rig()
    rig = replace(rig, camera=smaller(rig.camera), projector=smaller(rig.projector))
    bench = Bench(rig, Calibration(rig.camera, rig.projector, {}, camera_psf_px=0.8))
    monkeypatch.setattr(decoders, "calibrated_bench", lambda config, mode: bench)
    line = ["experiment=decoders", "decoders.frames=[48]", "trials=1", "engine=serial", f"out={tmp_path / 'out'}"]
    assert main(line) == 0
    with (tmp_path / "out" / "results.csv").open() as file:
        rows = {(row["condition"], row["metric"]): float(row["value"]) for row in csv.DictReader(file)}
    wanted = {"line_sweep/448", "gray_code/48", "gray_phase/48", "multi_phase/48"}
    assert {condition for condition, _ in rows} == {
        f"{page}/{name}" for page in ("white", "checkered") for name in wanted
    }
    assert rows["white/gray_code/48", "frames"] == 32
    for name in wanted:
        assert 0.0 < rows[f"white/{name}", "depth_raw_rms_mm"] < 1.0
        assert 0.7 < rows[f"white/{name}", "depth_coverage"] <= 1.0

"""The studies themselves, run small: every condition, method and metric that their tables need is there."""

from __future__ import annotations

import csv
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

import data_synth
from deskew import pipeline
from deskew.errors import StepError
from deskew.io import write_arrays
from experiments.program import main

SMALL = ["rig.board_poses=4", "mesh.rows=15", "mesh.columns=15", "trials=1", "engine=serial", "scan.mode=temporal"]
CORNERS = {f"corner_{kind}_{unit}" for kind in ("mean", "rms", "max") for unit in ("px", "mm")}
CORNERS |= {"corner_rigid_mean_mm", "corner_rigid_max_mm", "corners_missing", "corners_expected"}
CALIBRATION = {
    f"calib_{name}_rms_{unit}"
    for names, unit in (
        (("camera", "projector", "stereo", "held_out_camera", "held_out_projector"), "px"),
        (("held_out_length",), "mm"),
    )
    for name in names
}
DEPTH = {f"depth_raw_{name}_mm" for name in ("rms", "p95", "max", "bias")} | {"depth_coverage"}
SHEET = {"slope_p90_deg", "relief_mm"}


def run(out: Path, *overrides: str) -> dict[tuple[str, str], dict[str, float]]:
    """Run an experiment and return its numbers by condition and method."""
    assert main([*overrides, *SMALL, f"out={out}"]) == 0
    found: dict[tuple[str, str], dict[str, float]] = defaultdict(dict)
    with (out / "results.csv").open() as file:
        for row in csv.DictReader(file):
            found[row["condition"], row["method"]][row["metric"]] = float(row["value"])
    return dict(found)


def test_corner_distance_measures_every_condition_by_both_detectors(tmp_path: Path) -> None:
    rows = run(tmp_path / "out", "experiment=corner_distance", "seed=4711")
    assert set(rows) == {
        *((f"{place}{detector}", "-") for place in ("control", "unrestored") for detector in ("", "/saddle")),
        *((f"restored{d}", method) for d in ("", "/saddle") for method in ("paper_euler", "paper_rk4")),
    }
    assert rows["control", "-"].keys() == CORNERS | {"detector_rms_px"}
    assert rows["unrestored", "-"].keys() == CORNERS | CALIBRATION | DEPTH | SHEET | {"meets_paper"}
    assert rows["restored/saddle", "paper_rk4"].keys() == CORNERS | {"meets_paper"}
    more = {"dense_mean_mm", "dense_p95_mm", "dense_max_mm", "page_coverage", "at_rest", "steps", "steps_rejected"}
    more |= {"force_evaluations", "contacts", "strain_rms", "flips", "folded_quads", "meets_paper"}
    assert rows["restored", "paper_euler"].keys() == CORNERS | more
    assert 0.003 < rows["control/saddle", "-"]["detector_rms_px"] < 0.05
    assert rows["restored", "paper_euler"]["corner_mean_px"] < rows["unrestored", "-"]["corner_mean_px"]
    assert (tmp_path / "out" / "figures" / "pages.png").is_file()


def test_plane_accuracy_measures_planes_and_lengths(tmp_path: Path) -> None:
    rows = run(tmp_path / "out", "experiment=plane_accuracy", "seed=4712")
    assert set(rows) == {("white", "-"), ("checkered", "-")}
    plane = {"plane_mean_abs_mm", "plane_rms_mm", "plane_max_mm", "tilt_deg"} | CALIBRATION | DEPTH | SHEET
    assert rows["white", "-"].keys() == plane
    assert rows["checkered", "-"].keys() == plane | {"length_error_mm"}
    assert 0.0 < rows["checkered", "-"]["length_error_mm"] < 0.1
    assert 0.005 < rows["white", "-"]["plane_mean_abs_mm"] < 0.05


def test_a_page_that_cannot_be_scanned_fails_each_of_its_rows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_scan(*_: object, **__: object) -> None:
        raise StepError("Page outline: no page.")

    monkeypatch.setattr(pipeline, "scan", no_scan)
    sheet = data_synth.flat_sheet((279.0, 216.0))
    path = tmp_path / "flat.npz"
    write_arrays({"V": sheet.vertices[::10, ::10], "F": sheet.flat[::10, ::10]}, path)
    rows = run(tmp_path / "out", "experiment=corner_distance", f"sheet.paths=[{path}]")
    for detector in ("", "/saddle"):
        for method in ("paper_euler", "paper_rk4"):
            assert rows[f"restored{detector}", method] == {"failed": 1.0}
    assert "0 of 1" not in (tmp_path / "out" / "table.md").read_text()
    assert np.isfinite(rows["unrestored", "-"]["corner_mean_px"])

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


METHODS = ("spring", "paper_euler", "paper_rk4")


def test_corner_distance_measures_every_condition_by_both_detectors(tmp_path: Path) -> None:
    rows = run(tmp_path / "out", "experiment=corner_distance", "seed=4711")
    assert set(rows) == {
        *((f"{place}{detector}", "-") for place in ("control", "unrestored") for detector in ("", "/saddle")),
        *((f"restored{d}", method) for d in ("", "/saddle") for method in METHODS),
    }
    assert rows["control", "-"].keys() == CORNERS | {"detector_rms_px"}
    mesh = {"mesh_filled_fraction", "mesh_cut_quads"}
    assert rows["unrestored", "-"].keys() == CORNERS | CALIBRATION | SHEET | {"meets_paper"}
    assert rows["restored/saddle", "paper_rk4"].keys() == CORNERS | {"meets_paper", "picture_to_map_rms_mm"}
    more = {
        "picture_to_map_rms_mm",
        "dense_mean_mm",
        "dense_p95_mm",
        "dense_max_mm",
        "page_coverage",
        "at_rest",
        "steps",
        "steps_rejected",
    }
    more |= {"force_evaluations", "contacts", "strain_rms", "flips", "folded_quads", "meets_paper"}
    # Each method has its own scan.
    assert rows["restored", "paper_euler"].keys() == CORNERS | more | DEPTH | mesh
    filtered = {f"depth_{name}_mm" for name in ("rms", "p95", "max", "bias")}
    dynamic = {"steps", "steps_rejected", "force_evaluations", "contacts"}
    assert rows["restored", "spring"].keys() == (CORNERS | more | DEPTH | mesh | filtered) - dynamic
    assert rows["restored", "spring"]["dense_mean_mm"] < 0.7 * rows["restored", "paper_rk4"]["dense_mean_mm"]
    assert 0.003 < rows["control/saddle", "-"]["detector_rms_px"] < 0.05
    assert rows["restored", "paper_euler"]["corner_mean_px"] < rows["unrestored", "-"]["corner_mean_px"]
    assert (tmp_path / "out" / "figures" / "figure_3.png").is_file()


def test_accuracy_measures_every_body_and_looks_through_every_fault(tmp_path: Path) -> None:
    rows = run(tmp_path / "out", "experiment=plane_accuracy", "seed=4712")
    bodies = ("white", "checkered", "sphere", "sphere/checkered")
    faults = ("fault/none", "fault/baseline", "fault/focal", "fault/yaw")
    assert set(rows) == {(condition, "-") for condition in (*bodies, *faults)}
    every = {"tilt_deg", "bound_depth_mm", "depth_rms_ratio", "depth_raw_bias_mm"} | CALIBRATION | DEPTH | SHEET
    plane = {f"plane_{name}_mm" for name in ("mean_abs", "rms", "max")} | {"flatness_mm"}
    ball = {"probing_form_mm", "probing_size_mm", "sphere_spacing_error_mm"}
    ball_ratios = {"probed_points", "probing_form_ratio", "probing_size_ratio", "sphere_spacing_ratio"}
    length = {"length_error_mm", "length_error_max_mm", "lengths", "length_error_ratio"}
    assert rows["white", "-"].keys() == every | plane | {"plane_rms_ratio", "flatness_ratio"}
    assert rows["checkered", "-"].keys() == rows["white", "-"].keys() | length
    assert rows["sphere", "-"].keys() == rows["sphere/checkered", "-"].keys() == every | ball | ball_ratios
    white, checkered, sphere = (rows[condition, "-"] for condition in bodies[:3])
    assert 0.0 < checkered["length_error_mm"] < 0.1
    assert 0.005 < white["plane_mean_abs_mm"] < 0.05
    assert 0.9 < white["plane_rms_ratio"] < 4.0
    assert 0.03 < sphere["probing_form_mm"] < 0.3
    assert abs(sphere["sphere_spacing_error_mm"]) < 0.1

    # What the table is for: the plane is blind to a wrong baseline, and what knows a length is not.
    none, baseline, focal, yaw = (rows[condition, "-"] for condition in faults)
    assert none["plane_rms_mm"] == white["plane_rms_mm"]
    assert baseline["plane_rms_mm"] == pytest.approx(none["plane_rms_mm"], rel=0.03)
    assert baseline["sphere_spacing_error_mm"] == pytest.approx(1.5, abs=0.1)
    assert baseline["probing_size_mm"] == pytest.approx(0.6, abs=0.1)
    assert 2.7 < baseline["length_error_mm"] < 3.3
    assert 7.0 < baseline["depth_raw_bias_mm"] < 9.0
    assert baseline["calib_camera_centre_error_mm"] == none["calib_camera_centre_error_mm"]
    assert focal["calib_camera_focal_error_px"] - none["calib_camera_focal_error_px"] == pytest.approx(16.84, abs=0.1)
    assert 2 * focal["depth_coverage"] < 1.6 * none["depth_coverage"]
    assert min(focal["plane_rms_mm"], yaw["plane_rms_mm"]) > 1.5 * none["plane_rms_mm"]
    assert abs(yaw["depth_raw_bias_mm"]) > 1.0
    assert (tmp_path / "out" / "figures" / "depth_error.png").is_file()


def test_a_page_that_cannot_be_scanned_fails_each_of_its_rows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_scan(*_: object, **__: object) -> None:
        raise StepError("Page outline: no page.")

    monkeypatch.setattr(pipeline, "scan", no_scan)
    sheet = data_synth.flat_sheet((279.0, 216.0))
    path = tmp_path / "flat.npz"
    write_arrays({"V": sheet.vertices[::10, ::10], "F": sheet.flat[::10, ::10]}, path)
    rows = run(tmp_path / "out", "experiment=corner_distance", f"sheet.paths=[{path}]")
    for detector in ("", "/saddle"):
        for method in METHODS:
            assert rows[f"restored{detector}", method] == {"failed": 1.0}
    assert "0 of 1" not in (tmp_path / "out" / "table.md").read_text()
    assert np.isfinite(rows["unrestored", "-"]["corner_mean_px"])

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

import data_synth
from deskew import flattening
from deskew.errors import InputError, StepError
from deskew.projection import project
from deskew.types import Sheet
from experiments.studies import falling_sheet
from experiments.studies.falling_sheet import FallingSheet, fallen, kept_falling_sheet, vertex_error


@pytest.fixture(scope="module")
def arch() -> Sheet:
    """Part of a cylinder, 12 mm high in the middle."""
    s, y = np.meshgrid(np.linspace(-40, 40, 13), np.linspace(30, -30, 9))
    return Sheet(np.stack([60 * np.sin(s / 60), y, 60 * np.cos(s / 60)], axis=-1))


def test_states_lead_from_the_scan_to_what_the_method_gives(arch: Sheet) -> None:
    frames, steps, times = fallen(arch, 9)
    whole = flattening.flatten(arch, method="paper_euler")
    np.testing.assert_allclose(frames[0], arch.vertices - [0, 0, arch.vertices[..., 2].min()])
    np.testing.assert_array_equal(frames[-1], whole.vertices)
    assert (steps[0], steps[-1]) == (0, whole.counters["steps"])
    assert (np.diff(steps) > 0).all()
    assert (np.diff(times) > 0).all()
    between = flattening.flatten(arch, method="paper_euler", max_steps=int(steps[4]))
    np.testing.assert_array_equal(frames[4], between.vertices)


def test_sheet_moves_alike_from_state_to_state(arch: Sheet) -> None:
    frames, _, _ = fallen(arch, 9)
    left = np.sqrt(((frames - frames[-1]) ** 2).sum(axis=-1).mean(axis=(1, 2)))
    assert (np.diff(left) < 0).all()
    # The push's first steps are the longest, and no state lies within a step.
    assert 0 < np.abs(left / left[0] - np.linspace(1, 0, 9)).max() < 0.15


def test_sheet_that_does_not_come_to_rest_is_refused(arch: Sheet, monkeypatch: pytest.MonkeyPatch) -> None:
    flatten = flattening.flatten
    monkeypatch.setattr(flattening, "flatten", lambda sheet, **settings: flatten(sheet, **{**settings, "max_steps": 3}))
    with pytest.raises(StepError, match="not flat"):
        fallen(arch)


def test_error_is_what_is_left_after_a_rigid_motion() -> None:
    truth = np.stack(np.meshgrid(np.linspace(0, 30, 4), np.linspace(0, -20, 3)), axis=-1)
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    flat = np.concatenate([truth @ turn.T + [5.0, 7.0], np.zeros((3, 4, 1))], axis=-1)
    np.testing.assert_allclose(vertex_error(flat, truth), 0.0, atol=1e-12)
    # No scale is taken out: a sheet one per cent too large is off by a per cent of the distance from its middle.
    middle = truth.mean(axis=(0, 1))
    np.testing.assert_allclose(vertex_error(1.01 * flat, truth), 0.01 * np.linalg.norm(truth - middle, axis=-1))
    truth[0, 0] = np.nan
    assert np.isnan(vertex_error(flat, truth)).sum() == 1


def test_pictures_of_all_formats_are_cut_out_alike() -> None:
    rng = np.random.default_rng(4)
    rig = data_synth.default_rig()
    page = data_synth.hidden_manuscript(rng)
    true = data_synth.flat_sheet(page.page_size_mm)
    above = data_synth.standard_lights(falling_sheet._READOUT)[:1]
    capture = data_synth.photograph(rig, true, page, 1, lights=above)
    vertices = true.vertices[:: true.vertices.shape[0] - 1, :: true.vertices.shape[1] - 1]
    pictures, places = falling_sheet._cut_out(capture, project(rig.camera, vertices))
    scan, fine = (pictures[name].astype(np.float32) for name in ("white", "above"))
    assert scan.shape == fine.shape
    inner = np.s_[100:-100, 100:-100]
    smooth = [cv2.GaussianBlur(picture[inner], (0, 0), 2.0) for picture in (scan, fine)]
    correlation, moved = cv2.findTransformECC(*smooth, np.eye(2, 3, dtype=np.float32), cv2.MOTION_TRANSLATION)
    assert correlation > 0.8
    assert np.abs(moved[:, 2]).max() < 0.1
    # Beyond each corner of the page lies the desk, within it the page.
    size = np.array(scan.shape[::-1])
    inwards = np.sign(places.mean(axis=(0, 1)) - places) * 6
    for picture in (scan, fine):
        within, beyond = (np.rint(places * size - 0.5 + way * inwards).astype(int).clip(0, size - 1) for way in (1, -1))
        assert (picture[within[..., 1], within[..., 0]] > 120).all()
        assert (picture[beyond[..., 1], beyond[..., 0]] < 80).all()


def test_recorded_sheet_is_kept_for_the_next_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = FallingSheet(
        np.arange(24.0).reshape(2, 2, 2, 3),
        np.array([0, 5]),
        np.array([0.0, 0.1]),
        np.ones((2, 2, 2)),
        np.full((2, 2), np.nan),
        np.zeros((2, 2)),
        {"uv": np.eye(3, dtype=np.uint8)},
    )
    calls = []
    monkeypatch.setattr(falling_sheet, "record_falling_sheet", lambda *given: calls.append(given) or made)
    first, again = (kept_falling_sheet(7, tmp_path / "kept", tmp_path / "calibrations") for _ in range(2))
    assert calls == [(7, tmp_path / "calibrations")]
    np.testing.assert_array_equal(again.frames, first.frames)
    np.testing.assert_array_equal(again.pictures["uv"], made.pictures["uv"])
    (path,) = (tmp_path / "kept").iterdir()
    path.write_bytes(b"no archive")
    with pytest.raises(InputError, match="whole NPZ"):
        kept_falling_sheet(7, tmp_path / "kept", tmp_path / "calibrations")

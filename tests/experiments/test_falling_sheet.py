from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import cast

import cv2
import numpy as np
import pytest

from deskew import flattening
from deskew.errors import InputError, StepError
from deskew.types import Capture, Sheet
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
    """A printed rectangle on a dark desk, and the same in the second format: one map takes the one to the other."""
    print_on_it = cv2.GaussianBlur(np.random.default_rng(4).uniform(0, 255, (480, 640)), (0, 0), 3.0)
    white = np.full((480, 640), 10.0)
    white[30:451, 40:601] = 130 + 4 * (print_on_it[30:451, 40:601] - 128)
    white = cv2.GaussianBlur(np.clip(white, 0, 255), (0, 0), 0.8).astype(np.uint8)
    readout = falling_sheet._READOUT
    above = cv2.warpAffine(white, readout.from_scan, readout.size, flags=cv2.INTER_CUBIC)
    corners = np.array([[[40.0, 30.0], [600.0, 30.0]], [[40.0, 450.0], [600.0, 450.0]]])
    capture = cast(Capture, SimpleNamespace(white=white, textures={"above": above}))
    pictures, places = falling_sheet._cut_out(capture, corners)
    scan, fine = (pictures[name].astype(np.float32) for name in ("white", "above"))
    assert scan.shape == fine.shape == (round(2.4 * 426), round(2.4 * 566))
    inner = np.s_[100:-100, 100:-100]
    smooth = [cv2.GaussianBlur(picture[inner], (0, 0), 2.0) for picture in (scan, fine)]
    correlation, moved = cv2.findTransformECC(*smooth, np.eye(2, 3, dtype=np.float32), cv2.MOTION_TRANSLATION)
    assert correlation > 0.98
    assert np.abs(moved[:, 2]).max() < 0.1
    # A corner is half-way up the edge from the desk to the page, in both directions: it is where it is said to be.
    size = np.array(scan.shape[::-1])
    for place, beyond in zip(places.reshape(-1, 2), ((-1, -1), (1, -1), (-1, 1), (1, 1)), strict=True):
        x, y = np.rint(place * size - 0.5).astype(int)
        for step in (np.array([5 * beyond[0], 0]), np.array([0, 5 * beyond[1]])):
            assert scan[y + step[1], x + step[0]] < 45
        assert scan[y - 5 * beyond[1], x - 5 * beyond[0]] > 45


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

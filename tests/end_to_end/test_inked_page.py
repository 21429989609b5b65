"""Depth of rendered crumpled pages: ink corrected with the spread that the rig's own board shows, and filtered."""

from functools import cache

import numpy as np
import pytest

import data_synth
from data_synth import Blank, Checkerboard
from deskew import acquisition, metrics, pipeline, restoration
from deskew.acquisition import GrayCodeSettings, InkSettings, SweepSettings
from deskew.acquisition.psf import camera_psf, edge_blurs
from deskew.types import Calibration, Capture, PatternKind

SEED = 6100


@cache
def estimated_psf():
    rig = data_synth.default_rig()
    capture = data_synth.render_board(rig, data_synth.board_poses(9)[2], SEED)
    lit = capture.white.astype(float) - capture.black
    return camera_psf(edge_blurs(lit, acquisition.find_board(lit, data_synth.BOARD.shape)))


def calibration(rig):
    """The true devices, which leaves ink as the largest error; the spread is estimated."""
    return Calibration(rig.camera, rig.projector, {}, camera_psf_px=estimated_psf())


def depth_errors(noise_scale, page, mode="temporal"):
    """Raw without and with the correction, and filtered: (rms, p95, max, coverage) each."""
    rig = data_synth.default_rig(noise_scale)
    known, rng = calibration(rig), np.random.default_rng(SEED)
    capture, truth = data_synth.render(rig, data_synth.crumpled(rng, slope_p90_deg=20.0), page, rng)
    true_points = truth.points_at(restoration.undistortion_map(rig.camera).astype(np.float64))
    decoded = pipeline.decode(capture, settings=SweepSettings(mode=mode))
    plain, corrected = (
        acquisition.depth_map(known, c) for c in (decoded, acquisition.correct_ink(known, decoded, capture))
    )
    filtered = acquisition.denoise_depth(corrected)
    found = (metrics.depth_error(depth, true_points) for depth in (plain, corrected, filtered))
    return [np.array(list(e.values())) for e in found]


def test_depth_of_an_inked_crumpled_page():
    plain, raw, filtered = depth_errors(1.0, Checkerboard())
    assert 0.05 < raw[0] < 0.12
    assert 0.1 < raw[1] < 0.25
    assert raw[0] < 0.6 * plain[0]
    assert 0.005 < filtered[0] < 0.03
    assert 0.01 < filtered[1] < 0.06
    assert 0.1 < filtered[2] < 1.0
    assert 0.985 < filtered[-1] < 1.0


@pytest.mark.parametrize("mode", ["temporal", "spatial"])
def test_depth_of_an_inked_crumpled_page_in_doubled_noise(mode):
    plain, raw, filtered = depth_errors(2.0, Checkerboard(), mode)
    assert 0.1 < raw[0] < plain[0]
    assert raw[1] < plain[1]
    assert 0.01 < filtered[0] < 0.06
    assert filtered[2] < 2.0
    assert 0.9 < filtered[-1] < 1.0  # alone, four pixels of ten do not rise above their noise


def test_depth_of_a_blank_crumpled_page():
    plain, raw, filtered = depth_errors(1.0, Blank())
    assert 0.01 < raw[0] < min(0.03, 1.02 * plain[0])
    assert raw[1] < 1.02 * plain[1]
    assert 0.002 < filtered[0] < 0.7 * raw[0]
    assert filtered[2] < 0.5
    assert raw[-1] > 0.995


def test_a_scan_corrects_ink_only_when_asked_to():
    rig = data_synth.default_rig()
    known, rng = calibration(rig), np.random.default_rng(SEED)
    capture, _ = data_synth.render(rig, data_synth.flat_sheet(Checkerboard().page_size_mm), Checkerboard(), rng)
    plain, inked = (pipeline.scan(capture, known, shape=(9, 9), ink=ink) for ink in (None, InkSettings()))
    np.testing.assert_array_equal(plain.depth.z, acquisition.depth_map(known, pipeline.decode(capture)).z)
    heights = [np.nanstd(scan.depth.z[150:330, 200:440]) for scan in (plain, inked)]
    assert 0.0 < heights[1] < heights[0]


class Decoded(Exception):  # noqa: N818
    """Carries what the decoder was asked for."""


@pytest.mark.parametrize(
    ("ink", "given", "limit"),
    [
        (None, None, GrayCodeSettings().ink_slope_max),
        (InkSettings(), None, None),
        (InkSettings(), GrayCodeSettings(ink_slope_max=0.3), 0.3),
    ],
    ids=["off", "on", "on, with a gate of one's own"],
)
def test_a_gray_code_keeps_the_edges_of_ink_when_they_are_corrected(monkeypatch, ink, given, limit):
    def record(capture, settings):
        raise Decoded(settings or GrayCodeSettings())

    monkeypatch.setattr(acquisition, "decode", record)
    known = calibration(data_synth.default_rig())
    picture = np.zeros(known.camera.size[::-1], np.uint8)
    frames = [picture] * 20  # 10 bits and their inverses
    capture = Capture(picture, picture, known.projector.size, PatternKind.GRAY_CODE, frames, frames)
    with pytest.raises(Decoded) as asked:
        pipeline.scan(capture, known, ink=ink, settings=given)
    assert asked.value.args[0].ink_slope_max == limit

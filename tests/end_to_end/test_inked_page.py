"""Ink on a rendered crumpled page, corrected with the spread that the rig's own board shows."""

import numpy as np
import pytest

import data_synth
from data_synth import Blank, Checkerboard
from deskew import acquisition, metrics, pipeline, restoration
from deskew.acquisition import GrayCodeSettings, InkSettings
from deskew.acquisition.psf import camera_psf, edge_blurs
from deskew.types import Calibration, Capture, PatternKind

SEED = 6100


def calibration(rig):
    """The true devices, which leaves ink as the largest error; the spread is estimated."""
    capture = data_synth.render_board(rig, data_synth.board_poses(9)[2], SEED)
    lit = capture.white.astype(float) - capture.black
    psf = camera_psf(edge_blurs(lit, acquisition.find_board(lit, data_synth.BOARD.shape)))
    return Calibration(rig.camera, rig.projector, {}, camera_psf_px=psf)


def depth_errors(noise_scale, page):
    """Without and with the correction, (rms, p95, coverage) each."""
    rig = data_synth.default_rig(noise_scale)
    known, rng = calibration(rig), np.random.default_rng(SEED)
    capture, truth = data_synth.render(rig, data_synth.crumpled(rng, slope_p90_deg=20.0), page, rng)
    true_points = truth.points_at(restoration.undistortion_map(rig.camera).astype(np.float64))
    decoded = pipeline.decode(capture)
    corrected = acquisition.correct_ink(known, decoded, capture)
    found = (metrics.depth_error(acquisition.depth_map(known, c), true_points) for c in (decoded, corrected))
    return [np.array([e["depth_raw_rms_mm"], e["depth_raw_p95_mm"], e["depth_coverage"]]) for e in found]


@pytest.mark.parametrize("noise_scale", [1.0, 2.0])
def test_ink_costs_half_of_what_it_did(noise_scale):
    plain, corrected = depth_errors(noise_scale, Checkerboard())
    assert 0.05 < corrected[0] < 0.6 * plain[0]
    assert corrected[0] < 0.12
    assert 0.1 < corrected[1] < 0.6 * plain[1]
    assert corrected[2] >= plain[2] - 0.001
    assert noise_scale > 1 or corrected[2] > 0.97


def test_a_blank_page_is_no_worse():
    plain, corrected = depth_errors(1.0, Blank())
    assert 0.01 < corrected[0] < min(0.04, 1.02 * plain[0])
    assert corrected[1] < 1.02 * plain[1]


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

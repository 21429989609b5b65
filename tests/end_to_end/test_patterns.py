"""Every pattern on one rendered crumpled page, through the one door, against the true depth."""

import numpy as np
import pytest

import data_synth
from deskew import acquisition, metrics, pipeline, restoration
from deskew.types import Calibration, PatternKind

SEED = 6201  # of no study and no development run
SPREAD_PX = 0.804  # lens and pixel area of the default rig, as its boards show it


@pytest.fixture(scope="module")
def rig():
    return data_synth.default_rig()


@pytest.fixture(scope="module")
def sheet():
    return data_synth.crumpled(np.random.default_rng(SEED), slope_p90_deg=20.0)


def depth_figures(rig, sheet, page, pattern):
    """Uncorrected and corrected, by the true devices: the pattern's own error."""
    known = Calibration(rig.camera, rig.projector, {}, camera_psf_px=SPREAD_PX)
    capture, truth = data_synth.render(rig, sheet, page, SEED, pattern)
    true_points = truth.points_at(restoration.undistortion_map(rig.camera).astype(np.float64))
    decoded = pipeline.decode(capture, acquisition.settings_for_ink(pattern))
    assert decoded.projector.faults == ()
    corrected = acquisition.correct_ink(known, decoded, capture)
    return [metrics.depth_error(acquisition.depth_map(known, seen), true_points) for seen in (decoded, corrected)]


@pytest.mark.parametrize(
    ("pattern", "most_mm", "coverage"),
    [
        (PatternKind.GRAY_PHASE, 0.11, 0.995),
        (PatternKind.MULTI_PHASE, 0.10, 0.995),
    ],
)
def test_forty_frames_measure_an_inked_page_and_the_correction_of_ink_holds_for_them(
    rig, sheet, pattern, most_mm, coverage
):
    plain, corrected = depth_figures(rig, sheet, data_synth.Checkerboard(), pattern)
    assert 0.03 < corrected["depth_raw_rms_mm"] < most_mm
    assert corrected["depth_raw_rms_mm"] < 0.65 * plain["depth_raw_rms_mm"]
    assert corrected["depth_coverage"] > coverage
    assert corrected["depth_raw_max_mm"] < 2.0  # half a period off would be 8 mm

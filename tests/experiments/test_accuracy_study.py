"""Wrong calibrations, the picture of depth errors, and the summary in parts."""

from __future__ import annotations

import numpy as np
import pytest

import data_synth
from deskew.projection import centre, ideal, pixel_grid, rays
from deskew.types import Calibration, DepthMap, Pinhole
from experiments.reporting import Column, Layout, Montage, Section
from experiments.reporting.figures import picture_wall
from experiments.reporting.tables import table
from experiments.studies.accuracy_layout import LAYOUT
from experiments.studies.depth_picture import FULL_COLOUR_MM, depth_error_picture
from experiments.studies.faults import FAULTS
from experiments.trials import Recorder, Row, TrialKey

RIG = data_synth.default_rig()
TRUE = Calibration(RIG.camera, RIG.projector, {})


def test_no_fault_is_the_calibration_itself() -> None:
    assert FAULTS["none"](TRUE) is TRUE


def test_a_longer_baseline_stretches_the_line_between_the_devices_by_1_percent() -> None:
    wrong = FAULTS["baseline"](TRUE)
    assert wrong.camera is TRUE.camera
    before, after = (centre(calibration.projector) - centre(RIG.camera) for calibration in (TRUE, wrong))
    np.testing.assert_allclose(after, 1.01 * before)
    np.testing.assert_array_equal(wrong.projector.R, RIG.projector.R)


def test_a_longer_focal_length_is_the_cameras_alone() -> None:
    wrong = FAULTS["focal"](TRUE)
    assert wrong.projector is TRUE.projector
    np.testing.assert_allclose(np.diag(wrong.camera.K)[:2], 1.01 * np.diag(RIG.camera.K)[:2])
    np.testing.assert_array_equal(wrong.camera.K[:2, 2], RIG.camera.K[:2, 2])
    np.testing.assert_allclose(centre(wrong.camera), centre(RIG.camera))


def test_a_yaw_turns_the_projector_about_its_own_centre() -> None:
    wrong = FAULTS["yaw"](TRUE)
    assert wrong.camera is TRUE.camera
    np.testing.assert_allclose(centre(wrong.projector), centre(RIG.projector), atol=1e-9)
    turned = wrong.projector.R @ RIG.projector.R.T
    assert np.degrees(np.arccos((np.trace(turned) - 1) / 2)) == pytest.approx(0.1, rel=1e-6)
    np.testing.assert_allclose(turned[1], [0, 1, 0], atol=1e-12)


def test_depth_errors_have_their_colours() -> None:
    camera = ideal(
        Pinhole((6, 5), np.array([[50.0, 0, 2.5], [0, 50, 2], [0, 0, 1]]), np.zeros(5), np.eye(3), np.zeros(3))
    )
    sight = rays(camera, pixel_grid(camera.size))
    true_points = 100.0 * sight
    z = np.full((5, 6), 100.0)
    z[0] += FULL_COLOUR_MM
    z[1] -= FULL_COLOUR_MM
    z[2, 0] = np.nan
    true_points[3] = np.nan
    picture = depth_error_picture(DepthMap(z, (~np.isfinite(z)).astype(np.uint8), camera), true_points)
    assert picture.dtype == np.uint8
    assert (picture[0] == [255, 0, 0]).all()
    assert (picture[1] == [0, 0, 255]).all()
    assert (picture[4] == 255).all()
    assert len({tuple(colour) for colour in (picture[2, 0], picture[3, 0], picture[4, 0])}) == 3


def row(condition: str, metric: str, value: float) -> Row:
    return Row.of(TrialKey("fake", trial=0, seed=1), condition, "-", metric, value)


def test_a_section_shows_its_conditions_in_order_and_only_columns_with_data() -> None:
    columns = (Column("a_mm", "a", 1, {"z": "7"}), Column("b_mm", "b", 1), Column("c_mm", "c", 1))
    part = Section("Part", "About it.", ("z", "y", "absent"), ("b_mm", "a_mm"))
    rows = [row("y", "a_mm", 1.0), row("z", "a_mm", 2.0), row("z", "c_mm", 3.0), row("x", "b_mm", 4.0)]
    lines = table(Layout("T", "N", columns, sections=(part,)), rows, []).splitlines()
    start = lines.index("**Part.** About it.")
    assert lines[start + 2 : start + 7] == [
        "| condition | n | failed | a |",
        "| --- | ---: | ---: | ---: |",
        "| z | 1 | 0 | 2.0 |",
        "| y | 1 | 0 | 1.0 |",
        "| the paper | – | – | 7 |",
    ]
    assert "## Each trial" not in lines


def test_every_section_names_columns_of_the_layout() -> None:
    known = {column.metric for column in LAYOUT.columns}
    for section in LAYOUT.sections:
        assert set(section.metrics) <= known
        assert len(set(section.metrics)) == len(section.metrics)


def test_a_montage_bears_its_caption() -> None:
    record = Recorder(TrialKey("fake"))
    record.picture("page_0", np.full((4, 6), 99, np.uint8))
    wall = picture_wall(Montage("m", (("page", "page_{trial}"),), caption="What it shows."), record.outcome().pictures)
    assert wall is not None
    assert " ".join(wall.get_supxlabel().split()) == "What it shows."

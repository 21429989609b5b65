from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

import data_synth as ds
from data_synth import folds
from data_synth.cylinder import Bend, roll
from data_synth.sheets import page_grid, slopes_deg
from deskew.errors import InputError, StepError
from deskew.projection import project
from deskew.types import Floats

SEEDS = range(9000, 9010)


@pytest.fixture(scope="module")
def sheets() -> list[ds.TrueSheet]:
    return [ds.crumpled(np.random.default_rng(seed), slope_p90_deg=20.0) for seed in SEEDS]


def strains(sheet: ds.TrueSheet) -> list[Floats]:
    """Relative change of length of every edge and of both diagonals of every cell."""
    result = []
    for a, b in (
        (np.s_[:, 1:], np.s_[:, :-1]),
        (np.s_[1:], np.s_[:-1]),
        (np.s_[1:, 1:], np.s_[:-1, :-1]),
        (np.s_[1:, :-1], np.s_[:-1, 1:]),
    ):
        bent = np.linalg.norm(sheet.vertices[a] - sheet.vertices[b], axis=-1)
        flat = np.linalg.norm(sheet.flat[a] - sheet.flat[b], axis=-1)
        result.append((bent / flat - 1).ravel())
    return result


def test_a_crumpled_sheet_is_isometric_away_from_its_creases(sheets: list[ds.TrueSheet]) -> None:
    for sheet in sheets:
        strain = np.concatenate(strains(sheet))
        # A chord is never longer than the paper; only those across a crease or a rounded bend are shorter.
        assert 0 <= strain.max() < 1e-9
        assert np.median(np.abs(strain)) < 1e-9
        assert 0 < np.mean(strain < -1e-4) < 0.03
        assert strain.min() > -0.25


def test_the_wanted_slope_is_met_on_every_seed(sheets: list[ds.TrueSheet]) -> None:
    met = np.array([sheet.slope_p90_deg for sheet in sheets])
    assert 0 < np.abs(met - 20.0).max() < 1.0
    assert np.abs(met - 20.0).mean() < 0.25


@pytest.mark.parametrize("slope", [3.0, 30.0])
def test_gentle_and_steep_slopes_are_met(slope: float) -> None:
    for seed in (1, 2, 3):
        sheet = ds.crumpled(np.random.default_rng(seed), slope_p90_deg=slope)
        assert sheet.slope_p90_deg == pytest.approx(slope, abs=1.0)


def test_slopes_of_a_sphere_are_those_of_its_normals() -> None:
    vertices = ds.dome(radius_mm=500.0).vertices
    middle = (vertices[:-1, :-1] + vertices[1:, 1:]) / 2
    expected = np.degrees(np.arcsin(np.hypot(middle[..., 0], middle[..., 1]) / 500.0))
    assert np.allclose(slopes_deg(vertices), expected, atol=1e-4)


def test_sheets_rest_on_the_bed_level_and_inside_both_frames(sheets: list[ds.TrueSheet]) -> None:
    rig = ds.default_rig()
    for sheet in sheets:
        assert sheet.vertices[..., 2].min() == 0
        assert 10 < sheet.relief_mm < 60
        # No tilt is left: heights do not regress on the page's coordinates.
        design = np.column_stack([np.ones(sheet.flat[..., 0].size), sheet.flat.reshape(-1, 2)])
        tilt = np.linalg.lstsq(design, sheet.vertices[..., 2].ravel(), rcond=None)[0][1:]
        assert np.abs(tilt).max() < 2e-3
        for device in (rig.camera, rig.projector):
            pixels = project(device, sheet.vertices[::10, ::10])
            assert pixels.min() > 0
            assert (pixels.reshape(-1, 2).max(axis=0) < np.array(device.size) - 1).all()


def test_sheets_are_not_mirrored_and_show_the_camera_no_wall(sheets: list[ds.TrueSheet]) -> None:
    camera = ds.default_rig().camera
    for sheet in sheets:
        x, y = np.moveaxis(project(camera, sheet.vertices[::2, ::2]), -1, 0)
        area = (x[:-1, 1:] - x[:-1, :-1]) * (y[1:, :-1] - y[:-1, :-1])
        area -= (x[1:, :-1] - x[:-1, :-1]) * (y[:-1, 1:] - y[:-1, :-1])
        # u runs right and v down in the picture, so an unmirrored page has positive areas everywhere.
        assert area.min() > 0.25 * np.median(area)


def test_same_seed_gives_the_same_sheet_and_another_seed_another(sheets: list[ds.TrueSheet]) -> None:
    again = ds.crumpled(np.random.default_rng(SEEDS[0]), slope_p90_deg=20.0)
    assert np.array_equal(again.vertices, sheets[0].vertices)
    assert np.abs(sheets[1].vertices - sheets[0].vertices).max() > 1


def test_the_bytes_do_not_depend_on_the_number_of_threads() -> None:
    program = (
        "import numpy as np, hashlib, data_synth as ds\n"
        "sheet = ds.crumpled(np.random.default_rng(5))\n"
        "capture = ds.photograph(ds.default_rig(), sheet, ds.Checkerboard(), 5)\n"
        "images = (sheet.vertices, capture.white, capture.black, capture.columns[500], capture.rows[300])\n"
        "print(hashlib.sha256(b''.join(a.tobytes() for a in images)).hexdigest())\n"
    )
    digests = set()
    for threads in ("1", "2"):
        names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
        environment = {**os.environ, **dict.fromkeys(names, threads)}
        run = subprocess.run(
            [sys.executable, "-c", program], env=environment, check=True, capture_output=True, text=True
        )
        digests.add(run.stdout.strip())
    assert len(digests) == 1
    assert len(digests.pop()) == 64


def test_walls_and_sheets_out_of_view_are_rejected() -> None:
    view = folds.View(half_size_mm=(150.0, 125.0))
    gentle, wall = ds.tent(steep_deg=60.0).vertices, ds.tent(steep_deg=80.0).vertices
    assert folds._acceptable(gentle, view)
    assert not folds._acceptable(wall, view)
    assert not folds._acceptable(gentle + np.array([30.0, 0, 0]), view)
    assert not folds._acceptable(gentle + np.array([0, 0, 61.0]), view)
    mirrored = gentle * np.array([-1.0, 1.0, 1.0])
    assert not folds._acceptable(mirrored, view)


def test_a_view_that_nothing_fits_ends_in_a_step_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(folds, "_ATTEMPTS", 2)
    with pytest.raises(StepError, match=r"2 sheets left the view.*lower `slope_p90_deg` or widen `view`"):
        ds.crumpled(np.random.default_rng(0), view=ds.View(half_size_mm=(50.0, 50.0)))


def test_a_half_circle_of_paper_has_the_height_of_its_diameter() -> None:
    length = 60.0
    points = np.stack([np.linspace(-50, 50, 201), np.full(201, 7.0), np.zeros(201)], axis=-1)
    bent = roll(points, [Bend(0.0, length, np.pi)], azimuth=0.0)
    assert bent[-1, 2] == pytest.approx(2 * length / np.pi, abs=1e-9)
    assert bent[0].tolist() == points[0].tolist()
    # The straight part beyond runs back over the first one, parallel to it.
    assert bent[-1, 0] - bent[-11, 0] == pytest.approx(-5.0, abs=1e-9)
    assert np.array_equal(bent[:, 1], points[:, 1])


def test_rolling_turns_with_its_azimuth() -> None:
    points = page_grid((90.0, 60.0), 3.0)
    points = np.concatenate([points - [45.0, 30.0], np.zeros((*points.shape[:2], 1))], axis=-1)
    bends = [Bend(-10.0, 8.0, 0.5), Bend(12.0, 5.0, -0.9)]
    turn = 0.7
    R = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    # With the profile's start far outside, turning before and after rolling must agree.
    straight = roll(points, [Bend(b.centre_mm, b.length_mm, b.angle) for b in bends], 0.2)
    turned = roll(points @ R.T, bends, 0.2 + turn)
    assert np.allclose(turned, straight @ R.T, atol=1e-9)
    assert np.ptp(straight[..., 2]) > 5


@pytest.mark.parametrize("tilt", [0.0, 10.0, 25.0])
@pytest.mark.parametrize("azimuth", [0.0, 90.0, 215.0])
def test_a_plane_has_its_tilt_and_rises_where_it_says(tilt: float, azimuth: float) -> None:
    sheet = ds.plane(tilt_deg=tilt, azimuth_deg=azimuth)
    assert np.allclose(slopes_deg(sheet.vertices), tilt, atol=1e-5)
    assert sheet.vertices[..., 2].min() == 0
    assert np.abs(np.concatenate(strains(sheet))).max() < 1e-10
    gradient = np.linalg.lstsq(
        np.column_stack([sheet.vertices[..., :2].reshape(-1, 2), np.ones(sheet.flat[..., 0].size)]),
        sheet.vertices[..., 2].ravel(),
        rcond=None,
    )[0][:2]
    uphill = np.tan(np.radians(tilt)) * np.array([np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth))])
    assert np.allclose(gradient, uphill, atol=1e-9)


def test_a_dome_is_a_sphere_that_rests_on_its_corners() -> None:
    sheet = ds.dome(radius_mm=500.0)
    centre = np.array([0, 0, sheet.vertices[..., 2].max() - 500.0])
    assert np.allclose(np.linalg.norm(sheet.vertices - centre, axis=-1), 500.0, atol=0.01)
    assert sheet.vertices[[0, 0, -1, -1], [0, -1, 0, -1], 2] == pytest.approx(0, abs=1e-9)


def test_the_flat_sheet_is_centred_with_v_running_down() -> None:
    sheet = ds.flat_sheet()
    assert sheet.vertices.shape == (721, 931, 3)
    assert sheet.vertices[0, 0].tolist() == [-139.5, 108.0, 0.0]
    assert sheet.vertices[-1, -1].tolist() == [139.5, -108.0, 0.0]
    assert sheet.page_size_mm == (279.0, 216.0)
    assert (sheet.slope_p90_deg, sheet.relief_mm) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: ds.crumpled(np.random.default_rng(0), slope_p90_deg=60.0), r"`slope_p90_deg` must be in \[1, 45\]"),
        (lambda: ds.crumpled(np.random.default_rng(0), slope_p90_deg=np.nan), r"`slope_p90_deg` must .* got nan\."),
        (lambda: ds.crumpled(np.random.default_rng(0), n_folds=(5, 4)), r"`n_folds` must be .* got \(5, 4\)\."),
        (lambda: ds.plane(tilt_deg=50.0), r"`tilt_deg` must be in \[0, 45\], got 50\.0\."),
        (lambda: ds.plane(azimuth_deg=np.inf), r"`azimuth_deg` must be finite, got inf\."),
        (lambda: ds.flat_sheet((0.0, 10.0)), r"`page_size_mm` must be at least ten cells"),
        (lambda: ds.dome(radius_mm=100.0), r"`radius_mm` must be at least 264\.6, got 100\.0\."),
        (lambda: ds.tent(steep_deg=90.0), r"`steep_deg` must be in \[10, 80\], got 90\.0\."),
        (lambda: ds.TrueSheet(np.zeros((4, 3)), np.zeros((4, 2))), r"`vertices` must have shape \(h, w, 3\)"),
        (lambda: ds.TrueSheet(np.zeros((2, 2, 3)), np.zeros((2, 3, 2))), r"`flat` must have shape \(2, 2, 2\)"),
        (lambda: ds.TrueSheet(np.full((2, 2, 3), np.nan), np.zeros((2, 2, 2))), r"`vertices` must be finite"),
        (lambda: Bend(0.0, 0.0, 1.0), r"`length_mm` must be positive, got 0\.0\."),
        (
            lambda: roll(np.zeros((2, 3)), [Bend(9.0, 4.0, 1.0), Bend(8.0, 4.0, 1.0)], 0.0),
            r"`bends` must be in order, inside the page and apart, got \[9\.0, 8\.0\]\.",
        ),
    ],
)
def test_bad_arguments_are_named(call: object, message: str) -> None:
    assert callable(call)
    with pytest.raises(InputError, match=message):
        call()

from __future__ import annotations

from dataclasses import replace
from itertools import islice

import cv2
import numpy as np
import pytest

import data_synth as ds
from data_synth.devices import packed
from data_synth.pages import INK_ALBEDO, PAPER_ALBEDO
from data_synth.shading import irradiance
from data_synth.truth import true_sheet_seen
from deskew.errors import InputError
from deskew.projection import centre, onto_bed, pixel_grid, project
from deskew.types import Capture, Floats


@pytest.fixture(scope="module")
def rig() -> ds.Rig:
    return ds.default_rig()


@pytest.fixture(scope="module")
def silent() -> ds.Rig:
    return ds.default_rig(noise_scale=0.0)


@pytest.fixture(scope="module")
def blank(silent: ds.Rig) -> Capture:
    """A flat white page without noise."""
    return ds.photograph(silent, ds.flat_sheet(), ds.Blank(), 0)


@pytest.fixture(scope="module")
def checkered(rig: ds.Rig) -> Capture:
    """A flat checkerboard with noise."""
    return ds.photograph(rig, ds.flat_sheet(), ds.Checkerboard(), 1)


def corner_errors(white: Floats, expected: Floats) -> Floats:
    """What OpenCV's sub-pixel corner finder says, less what is expected, (N, 2) px."""
    start = np.ascontiguousarray(expected.reshape(-1, 1, 2), dtype=np.float32)
    criteria = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 100, 1e-4)
    return np.asarray(cv2.cornerSubPix(white.copy(), start, (5, 5), (-1, -1), criteria)).reshape(-1, 2) - expected


def true_corners(rig: ds.Rig) -> Floats:
    """Corners of the default checkerboard on the bed, through OpenCV's projection: (300, 2) px."""
    u, v = np.moveaxis(ds.Checkerboard().corners.reshape(-1, 2), -1, 0)
    return project(rig.camera, np.stack([u - 139.5, 108.0 - v, np.zeros(300)], axis=-1))


def test_corners_are_rendered_where_opencv_projects_them(rig: ds.Rig, checkered: Capture) -> None:
    errors = corner_errors(checkered.white, true_corners(rig))
    assert np.abs(errors.mean(axis=0)).max() < 0.01
    assert 0.005 < np.sqrt((errors**2).sum(axis=1).mean()) < 0.05


def test_half_a_sub_sample_of_shift_would_be_seen(rig: ds.Rig, checkered: Capture) -> None:
    for shift in ([0.125, 0.0], [0.0, -0.125]):
        errors = corner_errors(checkered.white, true_corners(rig) + shift)
        assert np.abs(errors.mean(axis=0) + shift).max() < 0.01
        assert np.abs(errors.mean(axis=0)).max() > 0.1


def test_a_mirrored_page_would_be_seen(rig: ds.Rig) -> None:
    for page, sheet in (
        (ds.Checkerboard(), ds.crumpled(np.random.default_rng(8))),
        (ds.board_page(ds.BOARD, 7.0), ds.flat_sheet((230.0, 176.0))),
    ):
        capture, truth = ds.render(rig, sheet, page, 0)
        pixels = pixel_grid(rig.camera.size)[::7, ::7]
        u, v = np.moveaxis(truth.page_at(pixels), -1, 0)
        on_print = np.isfinite(u) & (np.abs(u / page.page_size_mm[0] - 0.5) < 0.4)
        on_print &= np.abs(v / page.page_size_mm[1] - 0.5) < 0.4
        seen = capture.white[::7, ::7][on_print].astype(float)
        u, v, side = u[on_print], v[on_print], np.full(int(on_print.sum()), 0.5)
        width, height = page.page_size_mm
        # An odd number of squares mirrors onto itself: each page is asked about its even side.
        mirror = (width - u, v) if page.squares[0] % 2 == 0 else (u, height - v)
        assert np.corrcoef(seen, page.albedo(u, v, side, side))[0, 1] > 0.95
        assert np.corrcoef(seen, page.albedo(*mirror, side, side))[0, 1] < -0.9


def test_corners_of_a_crumpled_page_are_where_the_truth_says(rig: ds.Rig) -> None:
    capture, truth = ds.render(rig, ds.crumpled(np.random.default_rng(21)), ds.Checkerboard(), 2)
    errors = corner_errors(capture.white, truth.pixels_of(ds.Checkerboard().corners).reshape(-1, 2))
    # Creases through a corner mislead any detector, so the median counts.
    assert 0.005 < np.median(np.linalg.norm(errors, axis=1)) < 0.06


def test_the_outline_is_rendered_where_opencv_projects_it(silent: ds.Rig, blank: Capture) -> None:
    white = blank.white.astype(float)
    for row in range(60, 420, 23):
        ray = onto_bed(silent.camera, np.array([30.0, row]))
        edge = project(silent.camera, np.array([-139.5, ray[1], 0.0]))
        profile = white[row, :60]
        half = (profile[:10].mean() + profile[-10:].mean()) / 2
        k = int(np.argmax(profile > half))
        crossing = k - (profile[k] - half) / (profile[k] - profile[k - 1])
        assert crossing == pytest.approx(edge[0], abs=0.06)


def test_a_plane_across_the_projectors_axis_is_lit_evenly(rig: ds.Rig) -> None:
    projector = rig.projector
    axis = projector.R[2]
    rng = np.random.default_rng(0)
    local = np.column_stack([rng.uniform(-150, 150, (100, 2)), np.full(100, 900.0)])
    points = local @ projector.R + centre(projector)
    light = [irradiance(packed(projector), *point, *-axis) for point in points]
    assert np.allclose(light, 1 / 900.0**2, rtol=1e-12)
    assert irradiance(packed(projector), *points[0], *axis) < 0


def test_brightness_of_a_flat_page_follows_the_formula(silent: ds.Rig, blank: Capture) -> None:
    pixels = pixel_grid(silent.camera.size)[40:440:20, 40:600:20]
    world = np.concatenate([onto_bed(silent.camera, pixels), np.zeros((*pixels.shape[:2], 1))], axis=-1)

    def light(points: Floats) -> Floats:
        ray = centre(silent.projector) - points
        r = np.linalg.norm(ray, axis=-1)
        return np.asarray(ray[..., 2] / r / ((-(ray @ silent.projector.R[2]) / r) ** 3 * r**2))

    relative = light(world) / light(np.zeros(3))
    code = (235 / 255) ** 2.2 * (1 - 1 / 500) + 1 / 500
    expected = 4 + 235 * PAPER_ALBEDO * (relative * code + 0.03)
    assert np.abs(blank.white[40:440:20, 40:600:20] - expected).max() < 0.55
    black = 4 + 235 * PAPER_ALBEDO * (relative / 500 + 0.03)
    assert np.abs(blank.black[40:440:20, 40:600:20] - black).max() < 0.55


def test_ink_and_desk_are_dark_and_nothing_saturates(checkered: Capture) -> None:
    signal = checkered.white.astype(float) - checkered.black
    x, y = true_corners(ds.default_rig()).reshape(15, 20, 2)[7, 10].round().astype(int)
    # The square at the top right of a corner is ink where row + column is odd.
    ink, paper = signal[y - 18 : y - 5, x + 5 : x + 18], signal[y - 18 : y - 5, x - 18 : x - 5]
    assert 150 < paper.mean() < 190
    assert ink.mean() / paper.mean() == pytest.approx(INK_ALBEDO / PAPER_ALBEDO, rel=0.05)
    assert signal[:6].mean() / paper.mean() == pytest.approx(0.03 / PAPER_ALBEDO, rel=0.3)
    assert checkered.white.max() < 255


def test_a_stripe_is_bright_where_its_projector_coordinate_is(silent: ds.Rig, blank: Capture) -> None:
    pixels = pixel_grid(silent.camera.size)
    world = np.concatenate([onto_bed(silent.camera, pixels), np.zeros((480, 640, 1))], axis=-1)
    coordinates = project(silent.projector, world)
    on_page = np.s_[40:440, 40:600]
    for frames, axis, lines in ((blank.columns, 0, (300, 555, 800)), (blank.rows, 1, (200, 401, 600))):
        for line in lines:
            light = frames[line].astype(float) - blank.black  # type: ignore[index]
            distance = np.abs(coordinates[..., axis] - line)[on_page]
            assert light[on_page][distance < 0.3].min() > 30
            assert np.abs(light[on_page][distance > 8]).max() <= 1


@pytest.mark.parametrize("axis", [0, 1], ids=["columns", "rows"])
def test_temporal_centroids_are_the_projector_coordinates(silent: ds.Rig, blank: Capture, axis: int) -> None:
    pixels = pixel_grid(silent.camera.size)[40:440:13, 40:600:13]
    world = np.concatenate([onto_bed(silent.camera, pixels), np.zeros((*pixels.shape[:2], 1))], axis=-1)
    expected = project(silent.projector, world)[..., axis]
    mass, moment = np.zeros(expected.shape), np.zeros(expected.shape)
    black = blank.black[40:440:13, 40:600:13].astype(float)
    for line, frame in enumerate((blank.columns, blank.rows)[axis]):
        light = np.maximum(frame[40:440:13, 40:600:13] - black, 0)
        mass += light
        moment += line * light
    errors = moment / mass - expected
    assert abs(errors.mean()) < 0.002
    assert 1e-4 < errors.std() < 0.02
    # All lines together are the white frame.
    white = blank.white[40:440:13, 40:600:13] - black
    assert np.abs(mass / white - 1).max() < 0.05
    assert abs((mass / white).mean() - 1) < 0.03


def test_frames_are_restartable_and_do_not_depend_on_their_order(checkered: Capture) -> None:
    for frames in (checkered.columns, checkered.rows):
        first = [frame.copy() for frame in islice(frames, 330)]
        again = [frame.copy() for frame in islice(frames, 330)]
        assert all(np.array_equal(a, b) for a, b in zip(first, again, strict=True))
        for line in (329, 0, 200, 201):
            assert np.array_equal(frames[line], first[line])  # type: ignore[index]
        interleaved = zip(frames, frames, strict=True)
        assert all(a is not b and np.array_equal(a, b) for a, b in islice(interleaved, 40))


def test_same_seed_gives_the_same_bytes_and_another_seed_others(rig: ds.Rig, checkered: Capture) -> None:
    same = ds.photograph(rig, ds.flat_sheet(), ds.Checkerboard(), 1)
    other = ds.photograph(rig, ds.flat_sheet(), ds.Checkerboard(), 2)
    assert np.array_equal(same.white, checkered.white)
    assert np.array_equal(same.columns[400], checkered.columns[400])  # type: ignore[index]
    for image, another in (
        (checkered.white, other.white),
        (checkered.black, other.black),
        (checkered.rows[100], other.rows[100]),  # type: ignore[index]
        (checkered.rows[100], checkered.rows[101]),  # type: ignore[index]
    ):
        assert 0.4 < np.mean(image != another) < 0.95


def test_a_generator_seeds_as_its_own_draw_does(rig: ds.Rig) -> None:
    sheet, page = ds.flat_sheet((60.0, 40.0)), ds.Blank((60.0, 40.0))
    key = int(np.random.default_rng(4).integers(1 << 63))
    drawn = ds.photograph(rig, sheet, page, np.random.default_rng(4))
    assert np.array_equal(drawn.white, ds.photograph(rig, sheet, page, key).white)


def test_bad_arguments_are_named(rig: ds.Rig) -> None:
    sheet = ds.flat_sheet((60.0, 40.0))
    with pytest.raises(InputError, match=r"`page` must have the sheet's size \(60\.0, 40\.0\) mm, got"):
        ds.photograph(rig, sheet, ds.Checkerboard(), 0)
    with pytest.raises(InputError, match=r"`seed` must be in \[0, 2\*\*63\), got -1\."):
        ds.photograph(rig, sheet, ds.Blank((60.0, 40.0)), -1)
    capture = ds.photograph(rig, sheet, ds.Blank((60.0, 40.0)), 0)
    with pytest.raises(InputError, match=r"`line` must be in \[0, 1023\], got 1024\."):
        capture.columns[1024]  # type: ignore[index]


def test_the_tent_casts_its_shadow_where_straight_rays_end(silent: ds.Rig) -> None:
    sheet = ds.tent()
    capture, truth = ds.render(silent, sheet, ds.Blank(), 0)
    light = capture.white.astype(float) - capture.black
    X, _, Z = centre(silent.projector)
    # Each ridge point throws its shadow on Z = 0 along the ray from the projector; the farthest one is the edge.
    ridge = sheet.vertices[sheet.vertices.shape[0] // 2]
    raised = ridge[ridge[:, 2] > 5]
    edge = (X + (raised[:, 0] - X) * Z / (Z - raised[:, 2])).min()
    foot = ridge[np.argmax(ridge[:, 2] > 0.5), 0]
    assert 3 < foot - edge < 20
    for y in (-60.0, 0.0, 60.0):
        expected = project(silent.camera, np.array([edge, y, 0.0]))
        row = round(float(expected[1]))
        profile = light[row]
        lit = profile[int(expected[0]) - 12]
        k = int(expected[0]) - 10 + int(np.argmax(profile[int(expected[0]) - 10 :] < lit / 2))
        crossing = k - (lit / 2 - profile[k]) / (profile[k - 1] - profile[k])
        assert crossing == pytest.approx(expected[0], abs=0.5)
        shaded = project(silent.camera, np.array([(edge + foot) / 2, y, 0.0])).round().astype(int)
        # No light but the blur's, although the camera sees the page there; the sky still reaches it.
        assert light[shaded[1], shaded[0]] < 0.03 * lit
        assert np.isfinite(truth.depth_at(shaded.astype(float)))
        assert capture.black[shaded[1], shaded[0]] >= 8
    assert light.max() > 150


def test_a_plane_never_shades_itself_however_the_light_grazes(silent: ds.Rig) -> None:
    # Rising towards -X at 40 degrees it faces the light at only 27; compare with the formula's cosine.
    for azimuth in (0.0, 90.0, 180.0, 270.0):
        sheet = ds.plane((150.0, 100.0), tilt_deg=40.0, azimuth_deg=azimuth)
        capture, truth = ds.render(silent, sheet, ds.Blank((150.0, 100.0)), 0)
        u, v = np.moveaxis(truth.page_at(pixel_grid(silent.camera.size)), -1, 0)
        inside = (u > 4) & (u < 146) & (v > 4) & (v < 96)
        light = (capture.white.astype(float) - capture.black)[inside]
        assert light.min() > 0.65 * light.max() > 20


def test_board_poses_span_the_volume_and_pose_0_is_the_world(rig: ds.Rig) -> None:
    poses = ds.board_poses(9)
    assert np.array_equal(poses[0].R, np.eye(3))
    assert poses[0].t.tolist() == [0, 0, 0]
    width, height = ds.board_page(ds.BOARD, 7.0).page_size_mm
    outline = np.array([[sx * width / 2, sy * height / 2, 0] for sx in (-1, 1) for sy in (-1, 1)])
    heights, tilts = [], []
    for pose in ds.board_poses(12):
        assert np.allclose(pose.R @ pose.R.T, np.eye(3), atol=1e-12)
        corners = outline @ pose.R.T + pose.t
        heights += corners[:, 2].tolist()
        tilts.append(np.degrees(np.arccos(pose.R[2, 2])))
        for device in (rig.camera, rig.projector):
            pixels = project(device, corners)
            assert pixels.min() > 0
            assert (pixels.max(axis=0) < np.array(device.size) - 1).all()
    assert min(heights) >= -1e-9
    assert 150 < max(heights) < 175
    assert 33 < max(tilts) < 38
    with pytest.raises(InputError, match=r"`n` must be in \[3, 12\], got 2\."):
        ds.board_poses(2)


def test_boards_are_photographed_in_their_pose(rig: ds.Rig) -> None:
    nx, ny = ds.BOARD.shape
    x, y = np.meshgrid(np.arange(nx) - (nx - 1) / 2, (ny - 1) / 2 - np.arange(ny))
    board = np.stack([x.ravel(), y.ravel(), np.zeros(nx * ny)], axis=-1) * ds.BOARD.square
    for pose in (ds.board_poses(9)[0], ds.board_poses(9)[3]):
        capture = ds.render_board(rig, pose, 5)
        expected = project(rig.camera, board @ pose.R.T + pose.t)
        errors = corner_errors(capture.white, expected)
        assert 0.005 < np.sqrt((errors**2).sum(axis=1).mean()) < 0.05
        assert len(capture.columns) == 1024
        # The square at the top left of the corner grid is ink.
        first = expected[0] + 0.5 * (expected[0] - expected[nx + 1])
        assert capture.white[round(first[1]), round(first[0])] < 60


def test_the_point_spread_has_the_stated_width(silent: ds.Rig) -> None:
    # The slanted edge of a page, sampled finely by its rows: its slope's second moment is the spread's variance.
    c, s = np.cos(0.15), np.sin(0.15)
    sheet = ds.posed((120.0, 80.0), np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]), np.zeros(3))
    edge = true_sheet_seen(sheet, silent.camera).pixels_of(np.array([[0.0, 5.0], [0.0, 75.0]]))
    rows = np.arange(int(edge[:, 1].min()), int(edge[:, 1].max()))
    along = (rows - edge[0, 1]) / (edge[1, 1] - edge[0, 1])
    x = edge[0, 0] + along * (edge[1, 0] - edge[0, 0])
    columns = np.round(x)[:, None].astype(int) + np.arange(-8, 9)
    # Distance from the edge, positive on the page.
    distance = (columns - x[:, None]) * (edge[1, 1] - edge[0, 1]) / np.linalg.norm(edge[1] - edge[0])
    grid = np.linspace(-6, 6, 241)
    for sigma in (0.6, 0.75, 1.2):
        rig = replace(silent, config=replace(silent.config, camera_psf_sigma_px=sigma))
        white = ds.photograph(rig, sheet, ds.Blank((120.0, 80.0)), 0).white.astype(float)
        profile = white[rows[:, None], columns]
        low, high = profile[distance < -5].mean(), profile[distance > 5].mean()
        step = np.array([profile[np.abs(distance - g) < 0.15].mean() for g in grid])
        density = np.gradient((step - low) / (high - low), grid)
        density[np.abs(grid) > 4.5 * sigma] = 0
        variance = np.trapezoid(density * grid**2, grid) / np.trapezoid(density, grid)
        # The pixel's own box adds 1/12, the sliding mean of 0.3 px adds 0.3^2 / 12.
        assert variance == pytest.approx(sigma**2 + 1 / 12 + 0.0075, rel=0.08)

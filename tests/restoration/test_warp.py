"""The restored view: through the same lens as the control, and pixel for pixel where theory says."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from deskew import projection
from deskew.errors import InputError, StepError
from deskew.restoration import texture_quads, undistorted_view, undistortion_map, view_camera
from deskew.types import Flattened, Floats, Pinhole, Sheet, Status

SIZE = (240, 180)
CAMERA = Pinhole(
    size=SIZE,
    K=np.array([[480.0, 0.0, 118.0], [0.0, 483.0, 91.0], [0.0, 0.0, 1.0]]),
    distortion=np.array([-0.2, 0.08, 0.001, -0.0007, 0.0]),
    R=np.diag([1.0, -1.0, -1.0]),
    t=np.array([2.0, -1.0, 800.0]),
)


def flat_sheet(rows: int = 9, columns: int = 12, shift: tuple[float, float] = (0.0, 0.0)) -> Sheet:
    x, y = np.linspace(-130.2, 128.9, columns) + shift[0], np.linspace(97.4, -99.1, rows) + shift[1]
    X, Y = np.meshgrid(x, y)
    return Sheet(np.stack([X, Y, np.zeros_like(X)], axis=-1))


def still(sheet: Sheet) -> Flattened:
    return Flattened(sheet.vertices, Status.AT_REST)


def scene(pixels: Floats) -> Floats:
    """A smooth scene on the undistorted grid."""
    x, y = pixels[..., 0], pixels[..., 1]
    return 120 + 60 * np.sin(x / 9.0) * np.cos(y / 11.0) + 0.2 * x


def raw_image() -> Floats:
    """The scene as the raw camera with its lens sees it."""
    normalised = projection.undistort(CAMERA, projection.pixel_grid(SIZE))
    return scene(normalised @ CAMERA.K[:2, :2].T + CAMERA.K[:2, 2])


def test_identity_flattening_returns_the_undistorted_view() -> None:
    sheet = flat_sheet()
    restored = texture_quads(raw_image(), CAMERA, sheet, still(sheet))
    shown = np.isfinite(restored.backward_map[..., 0])
    assert 0.3 < shown.mean() < 0.8
    np.testing.assert_allclose(restored.backward_map[shown], undistortion_map(CAMERA)[shown], atol=1e-3)
    np.testing.assert_allclose(restored.image[shown], undistorted_view(raw_image(), CAMERA)[shown], atol=0.02)
    assert (restored.image[~shown] == 0).all()
    assert not restored.camera.distortion.any()
    assert restored.backward_map.dtype == np.float32


def test_what_lies_inside_the_quads_is_textured_where_the_surface_went() -> None:
    fine = flat_sheet(17, 23)
    coarse = Sheet(fine.vertices[::2, ::2], surface=fine.vertices)
    # Between the grid's own vertices, which stay, the surface has been 3 mm further to the right.
    moved = fine.vertices.copy()
    moved[1::2, 1::2, 0] -= 3.0
    flattened = Flattened(coarse.vertices, Status.AT_REST, surface=moved)
    by_surface = texture_quads(raw_image(), CAMERA, coarse, flattened)
    by_fine_grid = texture_quads(raw_image(), CAMERA, fine, Flattened(moved, Status.AT_REST))
    by_grid = texture_quads(raw_image(), CAMERA, coarse, still(coarse))
    assert np.array_equal(by_surface.backward_map, by_fine_grid.backward_map, equal_nan=True)
    assert 1.0 < np.nanmax(np.abs(by_surface.backward_map - by_grid.backward_map)) < 3.0


def test_control_and_restoration_look_through_the_same_lens() -> None:
    """Seen through the lens the scene comes back where the ideal camera has it, not .1 px beside."""
    control = undistorted_view(raw_image(), CAMERA)
    inner = (slice(20, -20), slice(20, -20))
    np.testing.assert_allclose(control[inner], scene(projection.pixel_grid(SIZE))[inner], atol=0.3)
    assert np.abs(raw_image() - control)[inner].max() > 5.0


def test_agrees_with_opencvs_undistort() -> None:
    image = np.clip(raw_image(), 0, 255).astype(np.uint8)
    theirs = cv2.undistort(image, CAMERA.K, CAMERA.distortion)
    off = np.abs(undistorted_view(image, CAMERA).astype(int) - theirs)[10:-10, 10:-10]
    assert np.percentile(off, 99) <= 2
    map_x, map_y = cv2.initUndistortRectifyMap(CAMERA.K, CAMERA.distortion, None, CAMERA.K, SIZE, cv2.CV_32FC1)
    ours = undistortion_map(CAMERA)
    shown = np.isfinite(ours[..., 0])
    np.testing.assert_allclose(ours[shown], np.stack([map_x, map_y], axis=-1)[shown], atol=1e-3)


def test_moved_page_is_read_from_where_it_was() -> None:
    """Flattened 7 mm to the right and 4 mm down: the source is the same distance back, through the lens."""
    old, new = flat_sheet(), flat_sheet(shift=(7.0, -4.0))
    restored = texture_quads(raw_image(), CAMERA, old, still(new))
    ideal = projection.ideal(CAMERA)
    bed = projection.onto_bed(ideal, projection.pixel_grid(SIZE)) - [7.0, -4.0]
    source = projection.project(CAMERA, np.concatenate([bed, np.zeros((*bed.shape[:2], 1))], axis=-1))
    shown = np.isfinite(restored.backward_map[..., 0])
    np.testing.assert_allclose(restored.backward_map[shown], source[shown], atol=2e-3)


def test_half_texel_shift_would_be_seen() -> None:
    sheet = flat_sheet()
    restored = texture_quads(raw_image(), CAMERA, sheet, still(sheet)).image
    shown = restored != 0
    truth = scene(projection.pixel_grid(SIZE))
    shifted = scene(projection.pixel_grid(SIZE) + 0.5)
    right = np.abs(restored - truth)[shown].mean()
    assert 0 < right < 0.05
    assert np.abs(restored - shifted)[shown].mean() > 20 * right


@pytest.mark.parametrize("scale", [0.5, 1.0, 2.0, 3.0])
def test_view_of_another_size_shows_the_same_world(scale: float) -> None:
    sheet = flat_sheet()
    restored = texture_quads(raw_image(), CAMERA, sheet, still(sheet), scale=scale)
    width, height = restored.camera.size
    assert restored.image.shape == (height, width) == (round(180 * scale), round(240 * scale))
    # One world point, seen by both: its raw source is the same.
    for point in np.array([[-100.0, 70.0, 0.0], [40.0, -50.0, 0.0]]):
        at = projection.project(restored.camera, point[None])[0]
        patch = cv2.remap(restored.backward_map, *(np.array([[v]], dtype=np.float32) for v in at), cv2.INTER_LINEAR)
        np.testing.assert_allclose(patch[0, 0], projection.project(CAMERA, point[None])[0], atol=0.05)
    corners = np.array([[-0.5, -0.5], [width - 0.5, height - 0.5]])
    want = projection.onto_bed(view_camera(CAMERA), np.array([[-0.5, -0.5], [239.5, 179.5]]))
    np.testing.assert_allclose(projection.onto_bed(restored.camera, corners), want, atol=1e-9)


def test_edge_pixels_are_not_mixed_with_an_artificial_border() -> None:
    """A bright page up to the picture's last pixel: the restored rim is as bright as the rest."""
    sheet = flat_sheet()
    restored = texture_quads(np.full((180, 240), 200, dtype=np.uint8), CAMERA, sheet, still(sheet))
    shown = np.isfinite(restored.backward_map[..., 0])
    assert (restored.image[shown] == 200).all()
    wide = Sheet(sheet.vertices * 2.5)
    beyond = texture_quads(np.full((180, 240), 200, dtype=np.uint8), CAMERA, wide, still(wide))
    assert set(np.unique(beyond.image)) <= {0, 200}


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.float32])
def test_colour_and_depth_are_kept(dtype: type) -> None:
    sheet = flat_sheet()
    image = np.dstack([raw_image(), 0.5 * raw_image(), 200 - 0.5 * raw_image()]).astype(dtype)
    restored = texture_quads(image, CAMERA, sheet, still(sheet)).image
    assert (restored.dtype, restored.shape) == (dtype, (180, 240, 3))
    for k in range(3):
        single = texture_quads(image[..., k].copy(), CAMERA, sheet, still(sheet)).image
        np.testing.assert_array_equal(restored[..., k], single)


def test_texture_of_twice_the_resolution_restores_to_the_same_picture() -> None:
    """The same view at 480 x 360 sampled from the scene itself."""
    fine = (projection.pixel_grid((480, 360)) + 0.5) / 2 - 0.5
    normalised = projection.undistort(CAMERA, fine)
    image = scene(normalised @ CAMERA.K[:2, :2].T + CAMERA.K[:2, 2])
    sheet = flat_sheet()
    restored = texture_quads(image, CAMERA, sheet, still(sheet))
    shown = np.isfinite(restored.backward_map[..., 0])
    off = np.abs(restored.image - scene(projection.pixel_grid(SIZE)))[shown]
    assert 0 < off.mean() < 0.3


def test_same_input_gives_the_same_bytes() -> None:
    sheet = flat_sheet()
    first, second = (texture_quads(raw_image(), CAMERA, sheet, still(sheet)) for _ in range(2))
    assert first.image.tobytes() == second.image.tobytes()
    assert first.backward_map.tobytes() == second.backward_map.tobytes()


def test_disagreeing_or_diverged_sheets_are_refused() -> None:
    sheet = flat_sheet()
    with pytest.raises(InputError, match="`flattened` must have the sheet's shape"):
        texture_quads(raw_image(), CAMERA, sheet, still(flat_sheet(rows=8)))
    broken = sheet.vertices.copy()
    broken[0, 0, 0] = np.nan
    with pytest.raises(InputError, match="`flattened` must have finite vertices, got status diverged"):
        texture_quads(raw_image(), CAMERA, sheet, Flattened(broken, Status.DIVERGED))
    triangles = Sheet(sheet.vertices.reshape(-1, 3), faces=np.array([[0, 1, 2]]))
    with pytest.raises(InputError, match="`sheet` must be a grid"):
        texture_quads(raw_image(), CAMERA, triangles, still(triangles))


def test_page_out_of_view_is_a_failed_step() -> None:
    with pytest.raises(StepError, match="Restoration: the flattened page lies at pixels"):
        texture_quads(raw_image(), CAMERA, flat_sheet(), still(flat_sheet(shift=(2000.0, 0.0))))


@pytest.mark.parametrize("scale", [0.0, -1.0, 17.0, float("nan"), float("inf")])
def test_scale_out_of_range_is_refused(scale: float) -> None:
    with pytest.raises(InputError, match=r"`scale` must lie in \(0, 16\], got"):
        undistorted_view(raw_image(), CAMERA, scale)


def test_image_of_another_aspect_is_refused() -> None:
    sheet = flat_sheet()
    with pytest.raises(InputError, match="`image` must have the aspect"):
        texture_quads(np.zeros((200, 240)), CAMERA, sheet, still(sheet))


def test_lens_without_distortion_leaves_the_view_alone() -> None:
    image = raw_image()
    np.testing.assert_allclose(undistorted_view(image, replace(CAMERA, distortion=np.zeros(5))), image, atol=1e-3)


@pytest.mark.parametrize("lift_mm", [800.0, 900.0, 0.99e9])
def test_sheet_behind_the_camera_is_refused(lift_mm: float) -> None:
    sheet = flat_sheet()
    lifted = Sheet(sheet.vertices + np.array([0.0, 0.0, lift_mm]))
    with pytest.raises(InputError, match="`sheet` must lie"):
        texture_quads(raw_image(), CAMERA, lifted, still(sheet))
    with pytest.raises(InputError, match="`flattened` must lie"):
        texture_quads(raw_image(), CAMERA, sheet, still(lifted))


def test_flattening_beyond_all_measure_is_refused() -> None:
    sheet = flat_sheet()
    away = replace(still(sheet), vertices=sheet.vertices + 1e12)
    with pytest.raises(InputError, match=r"`flattened` must lie within 1e\+09 mm"):
        texture_quads(raw_image(), CAMERA, sheet, away)

"""The rasteriser and the truth, against planes in closed form and OpenCV's projection."""

from __future__ import annotations

import numpy as np
import pytest

import data_synth as ds
from data_synth.geometry import buckets, gather, locate, rasterise
from data_synth.truth import Truth, true_sheet_seen
from deskew.errors import InputError
from deskew.projection import centre, pixel_grid, project, rays
from deskew.types import Floats


@pytest.fixture(scope="module")
def rig() -> ds.Rig:
    return ds.default_rig()


@pytest.fixture(scope="module")
def tilted(rig: ds.Rig) -> Truth:
    return true_sheet_seen(ds.plane((200.0, 150.0), tilt_deg=20.0, azimuth_deg=30.0), rig.camera)


def plane_hits(truth: Truth, pixels: Floats) -> Floats:
    """Where the pixels' rays meet the plane through three corners of the sheet, by OpenCV's undistortion."""
    a, b, c = truth.sheet.vertices[0, 0], truth.sheet.vertices[0, -1], truth.sheet.vertices[-1, 0]
    normal = np.cross(b - a, c - a)
    eye, directions = centre(truth.camera), rays(truth.camera, pixels)
    return np.asarray(eye + directions * ((a - eye) @ normal / (directions @ normal))[..., None])


def test_truth_of_a_tilted_plane_is_exact_at_any_pixel(tilted: Truth) -> None:
    pixels = np.random.default_rng(0).uniform([200, 150], [430, 330], (5000, 2))
    hits = plane_hits(tilted, pixels)
    points = tilted.points_at(pixels)
    assert 0 < np.abs(points - hits).max() < 1e-4
    depth = hits @ tilted.camera.R[2] + tilted.camera.t[2]
    assert np.abs(tilted.depth_at(pixels) - depth).max() < 1e-4
    corner, right, down = (tilted.sheet.vertices[i] for i in ((0, 0), (0, -1), (-1, 0)))
    u = (hits - corner) @ (right - corner) / 200.0
    v = (hits - corner) @ (down - corner) / 150.0
    assert np.abs(tilted.page_at(pixels) - np.stack([u, v], axis=-1)).max() < 1e-4


def test_the_page_ends_exactly_at_its_border(rig: ds.Rig, tilted: Truth) -> None:
    sheet = tilted.sheet
    outward = [(0, 400, (0, -1)), (-1, 400, (0, 1)), (250, 0, (-1, 0)), (250, -1, (1, 0))]
    for row, column, direction in outward:
        pixel = project(rig.camera, sheet.vertices[row, column])
        inside, outside = pixel - 0.01 * np.array(direction), pixel + 0.01 * np.array(direction)
        assert np.isfinite(tilted.page_at(inside)).all()
        assert np.isnan(tilted.page_at(outside)).all()
        assert np.isnan(tilted.depth_at(outside))


def test_truth_answers_in_the_shape_of_the_question_and_passes_nan_on(rig: ds.Rig, tilted: Truth) -> None:
    grid = pixel_grid(rig.camera.size)
    assert tilted.page_at(grid).shape == (480, 640, 2)
    assert tilted.depth_at(grid[5]).shape == (640,)
    odd = np.array([[np.nan, 240.0], [-9.0, 240.0], [320.0, 240.0], [320.0, 1e9]])
    assert np.isfinite(tilted.depth_at(odd)).tolist() == [False, False, True, False]
    share = np.isfinite(tilted.depth_at(grid)).mean()
    assert 0.4 < share < 0.5
    with pytest.raises(InputError, match=r"`raw_pixels` must have shape \(\.\.\., 2\), got \(4, 3\)\."):
        tilted.page_at(np.zeros((4, 3)))


def test_page_points_and_pixels_are_inverse_to_each_other(rig: ds.Rig) -> None:
    truth = true_sheet_seen(ds.crumpled(np.random.default_rng(77)), rig.camera)
    corners = ds.Checkerboard().corners
    pixels = truth.pixels_of(corners)
    assert np.abs(truth.page_at(pixels) - corners).max() < 1e-4
    # At vertices OpenCV knows the answer.
    vertices = project(rig.camera, truth.sheet.vertices[::60, ::60])
    assert np.abs(truth.pixels_of(truth.sheet.flat[::60, ::60]) - vertices).max() < 1e-6


def test_the_nearer_of_two_layers_is_seen() -> None:
    # A sheet that folds back over itself: x runs 0..9 at depth 20, then back 9..0 at depth 10.
    x = np.concatenate([np.arange(10.0), np.arange(9.0, -1.0, -1.0)])
    z = np.repeat([20.0, 10.0], 10)
    screen = np.stack([np.tile(x, (6, 1)), np.tile(np.arange(6.0)[:, None], 20), np.tile(z, (6, 1))], axis=-1)
    inverse, ids = rasterise(screen, 6, 10)
    assert (ids >= 0).all()
    assert np.allclose(1 / inverse[:, :9], 10.0)
    px, py = np.array([3.3]), np.array([2.7])
    depth, hit = locate(screen, px, py, *buckets(px, py, 6, 10), 10)
    assert depth[0] == pytest.approx(10.0)
    column = gather(np.arange(20.0)[None, :, None] * np.ones((6, 1, 1)), screen, hit, px, py)[0, 0]
    assert column == pytest.approx(19 - 3.3)


def test_raster_depth_of_a_slanted_plane_is_linear_in_inverse_depth() -> None:
    x, y = np.meshgrid(np.linspace(-0.4, 40.3, 30), np.linspace(-0.7, 30.9, 20))
    inverse_depth = 1e-3 * (1 + 0.01 * x - 0.02 * y)
    inverse, ids = rasterise(np.stack([x, y, 1 / inverse_depth], axis=-1), 31, 41)
    rows, columns = np.mgrid[:31, :41]
    covered = columns <= 40
    assert (ids >= 0)[covered].all()
    assert np.allclose(inverse[covered], 1e-3 * (1 + 0.01 * columns - 0.02 * rows)[covered], rtol=2e-6)


def test_a_raster_has_no_holes_along_shared_edges(rig: ds.Rig) -> None:
    truth = true_sheet_seen(ds.crumpled(np.random.default_rng(3)), rig.camera)
    screen = truth.screen.copy()
    screen[..., :2] = screen[..., :2] * 3 + 1
    ids = rasterise(screen, 1440, 1920)[1]
    seen = ids >= 0
    # A hole is an empty sample whose four neighbours are all seen.
    empty = ~seen[1:-1, 1:-1] & seen[:-2, 1:-1] & seen[2:, 1:-1] & seen[1:-1, :-2] & seen[1:-1, 2:]
    assert not empty.any()
    assert 0.8 < seen.mean() < 0.95

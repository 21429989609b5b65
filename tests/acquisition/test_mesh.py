"""The mesh covers the page to its outline and lies on the surface that the depth map shows."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from deskew import projection
from deskew.acquisition.fill import fill_depth
from deskew.acquisition.jumps import depth_jumps
from deskew.acquisition.mesh import coons_grid, page_mesh, page_sheet
from deskew.acquisition.outline import Outline, straight_outline
from deskew.errors import InputError, StepError
from deskew.types import DepthMap, Floats, Pinhole, Reason

SIZE = (200, 150)
CAMERA = Pinhole(
    size=SIZE,
    K=np.array([[400.0, 0.0, 99.0], [0.0, 400.0, 75.0], [0.0, 0.0, 1.0]]),
    distortion=np.zeros(5),
    R=np.diag([1.0, -1.0, -1.0]),
    t=np.array([0.0, 0.0, 800.0]),
)
CORNERS = np.array([[31.3, 24.2], [170.6, 27.9], [166.1, 124.4], [28.7, 118.8]])
NORMAL, OFFSET = np.array([0.25, -0.15, 1.0]), 20.0


def plane_depth() -> Floats:
    """Camera z of the plane NORMAL . X = OFFSET at every pixel, by intersection."""
    rays = projection.rays(CAMERA, projection.pixel_grid(SIZE))
    return (OFFSET - projection.centre(CAMERA) @ NORMAL) / (rays @ NORMAL)


def cylinder_depth(radius: float = 120.0) -> Floats:
    """Camera z of a cylinder along the world's Y whose top touches Z = radius, by the quadratic."""
    origin, rays = projection.centre(CAMERA), projection.rays(CAMERA, projection.pixel_grid(SIZE))
    a = rays[..., 0] ** 2 + rays[..., 2] ** 2
    b = origin[0] * rays[..., 0] + origin[2] * rays[..., 2]
    c = origin[0] ** 2 + origin[2] ** 2 - (3 * radius) ** 2
    return (-b - np.sqrt(b * b - a * c)) / a


def depth_map(z: Floats, missing: Floats | None = None) -> DepthMap:
    z = z.copy()
    reason = np.zeros(z.shape, dtype=np.uint8)
    if missing is not None:
        z[missing.astype(bool)] = np.nan
        reason[missing.astype(bool)] = Reason.WEAK
    return DepthMap(z, reason, CAMERA)


def bowed_outline(bow_px: float = 5.0) -> Outline:
    def side(a: Floats, b: Floats) -> Floats:
        t = np.linspace(0, 1, 140)[:, None]
        along = b - a
        across = np.array([-along[1], along[0]]) / np.linalg.norm(along)
        return a + t * along + bow_px * np.sin(2 * np.pi * t) * across

    a, b, c, d = CORNERS
    return Outline(top=side(a, b), right=side(b, c), bottom=side(d, c), left=side(a, d))


@pytest.mark.parametrize("shape", [(2, 2), (7, 11), (45, 45)])
def test_flat_tilted_page_is_meshed_exactly_up_to_its_outline(shape: tuple[int, int]) -> None:
    x, y = np.moveaxis(projection.pixel_grid(SIZE), -1, 0)
    # A wrong depth right up to two pixels inside the outline, as mixed pixels have it, must not matter.
    z = plane_depth()
    outline = straight_outline(CORNERS)
    inside = fill_depth(depth_map(z), outline, 12.0).inside
    z = np.where(inside, z, z + 30.0 + 0.1 * x - 0.2 * y)
    mesh = page_mesh(depth_map(z), outline, shape)
    assert mesh.sheet.vertices.shape == (*shape, 3)
    np.testing.assert_allclose(mesh.sheet.vertices @ NORMAL, OFFSET, atol=1e-4)
    np.testing.assert_allclose(projection.project(CAMERA, mesh.sheet.vertices), mesh.nodes, atol=1e-8)
    np.testing.assert_allclose(mesh.nodes[[0, 0, -1, -1], [0, -1, -1, 0]], CORNERS, atol=1e-9)
    assert mesh.filled_fraction == 0.0


def test_border_nodes_lie_on_the_outline_at_even_lengths_in_space() -> None:
    outline = bowed_outline()
    mesh = page_mesh(depth_map(cylinder_depth()), outline, (30, 45))
    dense = np.stack([np.interp(np.linspace(0, 139, 20001), np.arange(140), outline.top[:, k]) for k in range(2)], -1)
    off = np.linalg.norm(mesh.nodes[0][:, None] - dense, axis=-1).min(axis=1)
    assert off.max() < 0.01
    steps = np.linalg.norm(np.diff(mesh.sheet.vertices[0], axis=0), axis=-1)
    assert 0 < steps.std() / steps.mean() < 0.01
    # Where the cylinder falls away steeply the same length is shorter in the picture.
    pixels = np.linalg.norm(np.diff(mesh.nodes[0], axis=0), axis=-1)
    assert pixels.std() / pixels.mean() > 0.02


def test_vertices_lie_on_a_curved_surface() -> None:
    vertices = page_sheet(depth_map(cylinder_depth()), bowed_outline(), (45, 45)).vertices
    radius = np.hypot(vertices[..., 0], vertices[..., 2])
    assert 0 < np.abs(radius[1:-1, 1:-1] - 360.0).max() < 0.01
    assert np.abs(radius - 360.0).max() < 0.1


@pytest.mark.parametrize("shape", [(12, 15), (20, 31), (60, 80)])
def test_surface_is_the_mesh_sampled_about_every_other_pixel(shape: tuple[int, int]) -> None:
    sheet = page_sheet(depth_map(cylinder_depth()), bowed_outline(), shape)
    n = sheet.refinement
    width_px = 140.0  # of the page in the picture
    if sheet.surface is None:
        assert width_px / (shape[1] - 1) < 3.0
        return
    assert n in (2, 4, 8)
    assert 1.0 < width_px / (shape[1] - 1) / n < 3.5
    assert 0.3 < sheet.crease_width < 1.0
    assert np.array_equal(sheet.surface[::n, ::n], sheet.vertices)
    radius = np.hypot(sheet.surface[..., 0], sheet.surface[..., 2])
    assert 0 < np.abs(radius[n:-n, n:-n] - 360.0).max() < 0.02


def test_coons_grid_of_straight_sides_is_bilinear() -> None:
    outline = straight_outline(CORNERS)
    s, t = np.linspace(0, 1, 6), np.linspace(0, 1, 4)

    def along(side: Floats, at: Floats) -> Floats:
        return side[0] + at[:, None] * (side[1] - side[0])

    grid = coons_grid(along(outline.top, s), along(outline.right, t), along(outline.bottom, s), along(outline.left, t))
    a, b, c, d = CORNERS
    S, T = s[None, :, None], t[:, None, None]
    np.testing.assert_allclose(grid, (1 - T) * ((1 - S) * a + S * b) + T * ((1 - S) * d + S * c), atol=1e-12)


def test_coons_grid_passes_through_all_four_curved_sides() -> None:
    outline = bowed_outline(12.0)
    sides = [s[::20] if len(s[::20]) else s for s in (outline.top, outline.right, outline.bottom, outline.left)]
    sides = [
        np.concatenate([s, e[-1:]])
        for s, e in zip(sides, (outline.top, outline.right, outline.bottom, outline.left), strict=True)
    ]
    grid = coons_grid(*sides)
    for got, side in zip((grid[0], grid[:, -1], grid[-1], grid[:, 0]), sides, strict=True):
        np.testing.assert_allclose(got, side, atol=1e-9)


def test_small_holes_are_bridged_and_their_share_is_told() -> None:
    x, y = np.moveaxis(projection.pixel_grid(SIZE), -1, 0)
    hole = np.hypot(x - 90, y - 70) < 9
    mesh = page_mesh(depth_map(cylinder_depth(), hole), bowed_outline(), (45, 45))
    radius = np.hypot(mesh.sheet.vertices[..., 0], mesh.sheet.vertices[..., 2])
    assert np.abs(radius - 360.0).max() < 0.3
    nodes_in_hole = (np.hypot(mesh.nodes[..., 0] - 90, mesh.nodes[..., 1] - 70) < 9).sum() / 43**2
    assert mesh.filled_fraction == pytest.approx(nodes_in_hole, rel=0.4)


def test_plane_stays_a_plane_over_scattered_holes() -> None:
    rng = np.random.default_rng(1)
    missing = rng.random((SIZE[1], SIZE[0])) < 0.6
    vertices = page_sheet(depth_map(plane_depth(), missing), straight_outline(CORNERS), (45, 45)).vertices
    np.testing.assert_allclose(vertices @ NORMAL, OFFSET, atol=1e-4)


def test_large_hole_says_where_and_how_large() -> None:
    x, y = np.moveaxis(projection.pixel_grid(SIZE), -1, 0)
    hole = np.hypot(x - 90, y - 70) < 20
    with pytest.raises(StepError, match=r"pixel \(9\d, [67]\d\) on the page lies (19|20).\d px .* at most 12 px"):
        page_sheet(depth_map(plane_depth(), hole), straight_outline(CORNERS))


def test_page_without_depth_is_a_failed_step() -> None:
    nothing = np.ones((SIZE[1], SIZE[0]), dtype=bool)
    with pytest.raises(StepError, match="no pixel inside the outline has depth"):
        page_sheet(depth_map(plane_depth(), nothing), straight_outline(CORNERS))


@pytest.mark.parametrize("shape", [(1, 45), (45, 1), (0, 0), (4.5, 4), (3, 1001), (3,), 5, (True, 3)])
def test_mesh_of_no_sound_shape_is_refused(shape: Any) -> None:
    with pytest.raises(InputError, match=r"`shape` must be \(rows, columns\) of at least 2 x 2 vertices, at most 1000"):
        page_sheet(depth_map(plane_depth()), straight_outline(CORNERS), shape)


def test_outline_too_concave_for_a_grid_is_a_failed_step() -> None:
    a, b, c, d = CORNERS
    notch = np.stack([a, [80.0, 26.0], [100.0, 112.0], [120.0, 26.0], b])
    outline = Outline(top=notch, right=np.stack([b, c]), bottom=np.stack([d, [100.0, 60.0], c]), left=np.stack([a, d]))
    with pytest.raises(StepError, match="quads overlap"):
        page_sheet(depth_map(plane_depth()), outline, (9, 9), max_hole_px=60.0)


def test_hole_limit_below_the_rim_is_refused() -> None:
    with pytest.raises(InputError, match=r"`max_hole_px` must be >= 2\.0, got 1"):
        page_sheet(depth_map(plane_depth()), straight_outline(CORNERS), max_hole_px=1)


def stepped_depth(step_mm: float, edge: int = 100) -> Floats:
    """The plane, its right part lifted towards the camera as by a flap."""
    z = plane_depth()
    z[:, edge:] -= step_mm
    return z


@pytest.mark.parametrize("gap", [0, 4])
def test_a_jump_cuts_the_mesh_and_nothing_is_interpolated_across_it(gap: int) -> None:
    """Also where the jump itself lies in a gap of the depth map, as beside a flap's shadow."""
    missing = np.zeros((SIZE[1], SIZE[0]))
    missing[:, 100 : 100 + gap] = 1
    # Over a pixel of 2 mm even paper may climb 22 mm, across a gap of four 68.
    step = 30.0 if gap == 0 else 90.0
    mesh = page_mesh(depth_map(stepped_depth(step), missing), straight_outline(CORNERS), (20, 28))
    assert mesh.sheet.cut is not None
    # Every row of quads is cut, near the edge and nowhere else.
    middles = (mesh.nodes[:-1, :-1, 0] + mesh.nodes[1:, 1:, 0]) / 2
    assert mesh.sheet.cut.any(axis=1).all()
    edge = 99.5 + gap / 2
    assert np.abs(middles[mesh.sheet.cut] - edge).max() < 6
    height = mesh.sheet.vertices @ NORMAL - OFFSET
    side = np.where(mesh.nodes[..., 0] < edge, 0.0, step)
    rays = projection.rays(CAMERA, mesh.nodes)
    assert np.abs(height + side * (rays @ NORMAL)).max() < (
        1.0 if gap == 0 else 4.0
    )  # a pixel's own slope; 6 and 30 if blended


@pytest.mark.parametrize("step_mm", [0.0, 1.5, 10.0])
def test_noise_and_steep_paper_are_no_jumps(step_mm: float) -> None:
    sheet = page_mesh(depth_map(stepped_depth(step_mm)), straight_outline(CORNERS), (20, 28)).sheet
    assert sheet.cut is None
    wild = plane_depth()
    wild[60:63, 90:93] -= 80.0
    assert page_mesh(depth_map(wild), straight_outline(CORNERS), (20, 28)).sheet.cut is None
    climbing = np.tile(600.0 + 3.4 * np.arange(SIZE[0]), (SIZE[1], 1))  # 60 degrees at pixels of 2 mm
    assert page_mesh(depth_map(climbing), straight_outline(CORNERS), (20, 28)).sheet.cut is None


def test_depth_that_jumps_everywhere_is_refused() -> None:
    z = plane_depth() + 60.0 * (np.indices((SIZE[1], SIZE[0])).sum(axis=0) % 2)
    with pytest.raises(StepError, match="the depth jumps in every quad"):
        page_mesh(depth_map(z), straight_outline(CORNERS), (5, 5))


def test_jumps_are_the_same_in_any_unit() -> None:
    z, page = stepped_depth(30.0), np.ones((SIZE[1], SIZE[0]), dtype=bool)
    for unit in (1e-3, 1.0, 40.0):
        assert np.array_equal(depth_jumps(z * unit, page, 400.0), depth_jumps(z, page, 400.0))
    assert depth_jumps(z, page, 400.0)[:, 99:101].all()
    assert depth_jumps(z, page, 400.0).sum() == 2 * SIZE[1]

"""Light taken out of a page: exact where theory says so, and on a rendered one, whose light the rig makes its way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import data_synth as ds
from deskew import projection, restoration
from deskew.errors import InputError
from deskew.restoration.shading import projector_light, surface_normals
from deskew.types import DepthMap, Floats

RIG = ds.default_rig(noise_scale=0.0)
VIEW = restoration.view_camera(RIG.camera)
PIXELS = restoration.undistortion_map(RIG.camera).astype(np.float64)


def test_a_plane_across_the_projectors_axis_is_lit_evenly() -> None:
    projector = RIG.projector
    x, y = np.meshgrid(np.linspace(-200.0, 200.0, 9), np.linspace(-150.0, 150.0, 7))
    local = np.stack([x, y, np.full(x.shape, 900.0)], axis=-1)
    points = (local - projector.t) @ projector.R
    facing = np.broadcast_to(-projector.R[2], points.shape)
    light = projector_light(projector, points, facing)
    assert np.ptp(light) < 1e-12
    # Further away by a tenth, weaker by its square; turned by 60 degrees, half.
    further = projector_light(projector, (1.1 * local - projector.t) @ projector.R, facing)
    assert np.allclose(further * 1.1**2, light)
    turned = 0.5 * facing + np.sqrt(0.75) * projector.R[0]
    assert projector_light(projector, points[3, 4], turned[3, 4]) == pytest.approx(0.5 * light[3, 4])
    assert (projector_light(projector, points, -facing) == 0.0).all()


def test_a_level_element_at_the_origin_gets_full_light() -> None:
    assert projector_light(RIG.projector, np.zeros(3), np.array([0.0, 0.0, 1.0])) == pytest.approx(1.0)


def test_normals_of_a_tilted_plane_are_its_own() -> None:
    normal = np.array([0.3, -0.2, 1.0]) / np.linalg.norm([0.3, -0.2, 1.0])
    rays, origin = projection.rays(VIEW, projection.pixel_grid(VIEW.size)), projection.centre(VIEW)
    points = origin - rays * ((origin @ normal) / (rays @ normal))[..., None]
    found = surface_normals(points, 1.5)[20:-20, 20:-20]
    assert np.abs(found - normal).max() < 1e-6


def test_holes_in_the_depth_take_their_neighbours() -> None:
    z = np.full((480, 640), 800.0)
    z[100:104, 200:203] = np.nan
    reason = np.where(np.isnan(z), 1, 0).astype(np.uint8)
    points = restoration.surface_points(DepthMap(z, reason, VIEW))
    assert np.isfinite(points).all()
    assert np.allclose(points @ VIEW.R[2] + VIEW.t[2], 800.0)


def variation(image: np.ndarray, page: np.ndarray) -> float:
    values = image[page].astype(np.float64)
    return float(values.std() / values.mean())


def test_blank_crumpled_paper_becomes_even_and_keeps_its_reflectance() -> None:
    sheet = ds.crumpled(np.random.default_rng(31), slope_p90_deg=25.0, shape=(217, 280))
    capture, truth = ds.render(RIG, sheet, ds.Blank(), 5)
    points = truth.points_at(PIXELS)
    page = np.isfinite(points[..., 0])
    depth = np.where(page, points @ VIEW.R[2] + VIEW.t[2], np.nan)
    known = restoration.surface_points(DepthMap(depth, np.where(page, 0, 1).astype(np.uint8), VIEW))
    inside = (np.abs(truth.page_at(PIXELS) - np.divide(ds.PAGE_SIZE_MM, 2)) < np.divide(ds.PAGE_SIZE_MM, 2) - 4.0).all(
        -1
    )
    raw = restoration.undistorted_view(capture.white, RIG.camera)
    flat = restoration.undistorted_view(
        restoration.remove_shading(capture.white, capture.black, RIG.camera, RIG.projector, known), RIG.camera
    )
    # What is left is the crease's own pixels, where lens and normals blur differently.
    before, after = variation(raw, inside), variation(flat, inside)
    assert before > 0.08
    assert 0.0 < after < 0.25 * before
    lit = RIG.config.exposure_grey * RIG.config.lit
    assert np.median(flat[inside]) / lit == pytest.approx(0.85, abs=0.01)


def test_a_local_white_takes_slow_light_out_and_keeps_print() -> None:
    grey = np.full((120, 160), 200.0)
    grey[40:80, 60:64] = grey[40:80, 110:114] = 20.0
    light = np.linspace(0.5, 1.0, 160)
    image = np.rint(grey * light).astype(np.uint8)
    found = restoration.divide_by_local_white(image, 21.0).astype(np.float64)
    paper = grey == 200.0
    assert found[paper].std() / found[paper].mean() < 0.02 < image[paper].std() / image[paper].mean()
    assert found[60, 62] / found[60, 90] == pytest.approx(0.1, abs=0.02)
    assert found[60, 112] / found[60, 90] == pytest.approx(0.1, abs=0.02)


def test_a_local_white_does_not_lift_a_dark_desk() -> None:
    image = np.full((100, 100), 8, np.uint8)
    image[:, 50:] = 200
    assert restoration.divide_by_local_white(image, 12.0)[:, :40].max() < 40


def test_images_that_do_not_belong_together_are_refused() -> None:
    white, points = np.zeros((480, 640), np.uint8), np.zeros((480, 640, 3))
    devices = RIG.camera, RIG.projector
    with pytest.raises(InputError, match="`black` must have white's shape"):
        restoration.remove_shading(white, white[1:], *devices, points)
    with pytest.raises(InputError, match="`white` must have the camera's shape"):
        restoration.remove_shading(white[1:], white[1:], *devices, points)
    with pytest.raises(InputError, match="`points` must have shape"):
        restoration.remove_shading(white, white, *devices, points[1:])


def test_colours_and_deep_images_keep_their_type() -> None:
    rays, origin = projection.rays(VIEW, projection.pixel_grid(VIEW.size)), projection.centre(VIEW)
    bed: Floats = origin - rays * (origin[2] / rays[..., 2:])
    white = np.full((480, 640, 3), 20000, np.uint16)
    small = replace(RIG.camera, distortion=np.zeros(5))
    found = restoration.remove_shading(white, white // 4, small, RIG.projector, bed)
    assert (found.dtype, found.shape) == (np.uint16, white.shape)
    x, y = np.rint(projection.project(small, np.zeros(3))).astype(int)
    assert found[y, x] == pytest.approx(15000, rel=0.002)

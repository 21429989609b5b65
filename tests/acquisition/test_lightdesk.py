"""The outline on a desk as light as the page, on the rig; measured depth is stood in for by the true one with noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

import data_synth as ds
from deskew import projection
from deskew.acquisition import page_outline
from deskew.errors import StepError
from deskew.types import Capture, DepthMap, Floats, Pinhole, Reason

CAMERA = ds.default_rig().camera
SIDE = np.linspace(1e-6, 1 - 1e-6, 400)


def scene(desk_albedo: float, sheet: ds.TrueSheet, page: ds.Page) -> tuple[Capture, ds.Truth, DepthMap]:
    rig = ds.default_rig()
    rig = replace(rig, config=replace(rig.config, desk_albedo=desk_albedo))
    capture, truth = ds.render(rig, sheet, page, 8123)
    return capture, truth, depth_map(truth, capture)


def depth_map(truth: ds.Truth, capture: Capture) -> DepthMap:
    """True depth of page and desk with 0.1 mm of noise; none where the projector's light does not reach."""
    view = projection.ideal(CAMERA)
    rays = projection.rays(view, projection.pixel_grid(view.size))
    raw = projection.distort(CAMERA, projection.undistort(view, projection.pixel_grid(view.size)))
    z, bed = truth.depth_at(raw), -projection.centre(view)[2] / rays[..., 2]
    z = np.where(np.isfinite(z), z, bed) + np.random.default_rng(1).normal(0, 0.1, z.shape)
    x, y = np.clip(np.rint(raw).astype(int), 0, np.array(view.size) - 1).reshape(-1, 2).T
    dark = (capture.white.astype(int) - capture.black)[y, x].reshape(z.shape) < 12
    reason = np.where(dark, Reason.SHADOW, Reason.OK).astype(np.uint8)
    return DepthMap(np.where(dark, np.nan, z), reason, view)


def true_ring(truth: ds.Truth, view: Pinhole) -> Floats:
    """The page's border on the undistorted grid."""
    w, h = truth.sheet.page_size_mm
    low, high = np.full(400, 1e-6), np.full(400, 1 - 1e-6)
    sides = [(SIDE, low), (high, SIDE), (SIDE[::-1], high), (low, SIDE[::-1])]
    page = np.concatenate([np.stack([u * w, v * h], axis=-1) for u, v in sides])
    return projection.undistort(CAMERA, truth.pixels_of(page)) @ view.K[:2, :2].T + view.K[:2, 2]


@pytest.mark.parametrize(("desk_albedo", "rms_px", "max_px"), [(0.4, 0.6, 3.0), (0.85, 1.8, 8.0)])
def test_a_crumpled_page_is_found_by_its_height(desk_albedo: float, rms_px: float, max_px: float) -> None:
    rng = np.random.default_rng(61)
    page = ds.Lettered(ds.pseudo_words(rng))
    capture, truth, depth = scene(desk_albedo, ds.crumpled(rng, slope_p90_deg=20.0), page)
    found = page_outline(capture.white, capture.black, CAMERA, depth=depth).ring
    distance = cKDTree(true_ring(truth, depth.camera)).query(found)[0]
    assert 0.1 < np.sqrt((distance**2).mean()) < rms_px
    assert distance.max() < max_px
    # Light alone does not find it.
    with pytest.raises(StepError, match="Page outline"):
        page_outline(capture.white, capture.black, CAMERA)


@pytest.mark.parametrize("page", [ds.Blank(), ds.Checkerboard()])
def test_a_flat_page_on_a_desk_of_its_own_shade_is_refused(page: ds.Page) -> None:
    capture, _, depth = scene(0.85, ds.flat_sheet(), page)
    with pytest.raises(StepError, match=r"Page outline: .*mask"):
        page_outline(capture.white, capture.black, CAMERA, depth=depth)


def test_depth_changes_nothing_on_a_dark_desk() -> None:
    capture, _, depth = scene(0.03, ds.crumpled(np.random.default_rng(5)), ds.Checkerboard())
    with_depth, without = (page_outline(capture.white, capture.black, CAMERA, depth=d).ring for d in (depth, None))
    assert np.array_equal(with_depth, without)

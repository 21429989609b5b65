from __future__ import annotations

import numpy as np
import pytest

from deskew.flattening.directions import noise_directions
from deskew.flattening.noiselevel import noise_level
from tests.flattening.noisy_sheets import SHEETS, noisy, scroll, triangulated


@pytest.mark.parametrize("name", SHEETS)
@pytest.mark.parametrize("sigma", [0.05, 0.3])
def test_noise_is_found_within_three_percent(name, sigma):
    vertices, faces, _ = SHEETS[name]()
    assert 0.97 * sigma < noise_level(noisy(vertices, sigma), faces) < 1.03 * sigma


@pytest.mark.parametrize("name", SHEETS)
def test_a_clean_sheet_has_no_noise(name):
    vertices, faces, _ = SHEETS[name]()
    assert noise_level(vertices, faces) < 3e-4


def test_noise_scales_with_the_mesh_and_ignores_pose_and_order():
    vertices, faces, _ = SHEETS["folds"]()
    scan = noisy(vertices)
    level = noise_level(scan, faces)
    order = np.random.default_rng(1).permutation(len(scan))
    c, s = np.cos(1.0), np.sin(1.0)
    turned = scan @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + [500.0, -300.0, 50.0]
    assert noise_level(1000 * scan, faces) == pytest.approx(1000 * level, rel=1e-9)
    assert noise_level(turned, faces) == pytest.approx(level, rel=1e-6)
    assert noise_level(scan[order], np.argsort(order)[faces]) == pytest.approx(level, rel=1e-6)


def test_a_mesh_turned_on_its_side_is_judged_along_its_mean_normal():
    vertices, faces, _ = SHEETS["folds"]()
    scan = noisy(vertices)
    on_its_side = scan[:, [2, 0, 1]]
    assert noise_level(on_its_side, faces) == pytest.approx(noise_level(scan, faces), rel=0.01)


def test_a_scroll_is_judged_along_its_normals():
    vertices, faces, _ = scroll()
    normals = noise_directions(vertices, faces)
    assert np.ptp(normals, axis=0).max() > 1
    scan = vertices + normals * np.random.default_rng(3).normal(0, 0.3, len(vertices))[:, None]
    assert 0.28 < noise_level(scan, faces) < 0.32


def test_a_mesh_without_inner_vertices_has_no_noise():
    vertices, faces = triangulated(np.random.default_rng(0).normal(size=(2, 9, 3)))
    assert noise_level(vertices, faces) == 0.0

from __future__ import annotations

import numpy as np
import pytest

from deskew.flattening.directions import noise_directions
from deskew.flattening.hinges import hinges_of
from deskew.flattening.smoothing import denoise
from tests.flattening.noisy_sheets import SHEETS, noisy, roof


def test_jumps_are_the_differences_of_neighbouring_slopes():
    # Over a plane the jump is nothing; over a roof it is what the slope changes by, twice .5 across the ridge.
    vertices, faces, _ = roof(offset_mm=0.0)
    up = noise_directions(vertices, faces)
    hinges = hinges_of(vertices, faces, up)
    ridge = (abs(vertices[hinges.vertices[:, :2], 0]) < 1e-9).all(axis=1)
    assert ridge.sum() == 50
    np.testing.assert_allclose(hinges.jumps[ridge], -1.0, atol=1e-12)
    np.testing.assert_allclose(hinges.jumps[~ridge], 0.0, atol=1e-12)


def test_jumps_change_with_offsets_as_the_stencils_say():
    vertices, faces, _ = SHEETS["folds"]()
    up = noise_directions(vertices, faces)
    offsets = np.random.default_rng(0).normal(0, 1, len(vertices))
    before, after = hinges_of(vertices, faces, up), hinges_of(vertices + offsets[:, None] * up, faces, up)
    expected = before.jumps + (before.stencils * offsets[before.vertices]).sum(axis=1)
    np.testing.assert_allclose(after.jumps, expected, atol=1e-9)


@pytest.mark.parametrize("name", SHEETS)
def test_most_noise_goes_and_only_along_z(name):
    vertices, faces, _ = SHEETS[name]()
    scan = noisy(vertices)
    smooth = denoise(scan, faces, 0.3)
    np.testing.assert_array_equal(smooth[:, :2], scan[:, :2])
    error = smooth[:, 2] - vertices[:, 2]
    assert 0.005 < error.std() < 0.075
    assert np.abs(error).max() < 1.0


def test_without_noise_nothing_moves():
    vertices, faces, _ = SHEETS["folds"]()
    np.testing.assert_array_equal(denoise(vertices, faces, 0.0), vertices)
    # Beside a crossing of creases the prior may want more; it gets five times the noise it was told of.
    assert np.abs(denoise(vertices, faces, 1e-3) - vertices).max() < 5e-3


def test_the_border_is_held_as_the_inside_is():
    vertices, faces, _ = SHEETS["folds"]()
    rim = np.ones((145, 187), dtype=bool)
    rim[1:-1, 1:-1] = False
    error = np.concatenate([(denoise(noisy(vertices, seed=s), faces, 0.3) - vertices)[rim.ravel(), 2] for s in (1, 2)])
    assert error.std() < 0.16
    assert (np.abs(error) > 0.5).mean() < 0.01


def test_a_fold_stays_sharp():
    vertices, faces, _ = roof()
    z = denoise(noisy(vertices), faces, 0.3)[:, 2].reshape(51, 61)
    x = vertices[:, 0].reshape(51, 61)
    slopes = (np.diff(z, axis=1) / np.diff(x, axis=1)).mean(axis=0)
    middle = (x[0, 1:] + x[0, :-1]) / 2
    # From two vertices beside the ridge on, the planes have their slopes; across it the whole jump is there.
    np.testing.assert_allclose(slopes[middle < -2.0], 0.5, atol=0.05)
    np.testing.assert_allclose(slopes[middle > 2.0], -0.5, atol=0.05)
    # A convex prior of this strength takes .15 mm and more off the ridge.
    profile = (z - vertices[:, 2].reshape(51, 61)).mean(axis=0)
    assert np.abs(profile).max() < 0.08


def test_order_and_pose_and_unit_do_not_matter():
    # But for where the linear solver stops: a hundredth of sigma.
    vertices, faces, _ = SHEETS["arch"]()
    scan = noisy(vertices)
    smooth = denoise(scan, faces, 0.3)
    order = np.random.default_rng(1).permutation(len(scan))
    shuffled = denoise(scan[order], np.argsort(order)[faces], 0.3)
    np.testing.assert_allclose(shuffled, smooth[order], atol=3e-3)
    c, s = np.cos(2.0), np.sin(2.0)
    turn, shift = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]), np.array([200.0, -900.0, 40.0])
    np.testing.assert_allclose(denoise(scan @ turn + shift, faces, 0.3), smooth @ turn + shift, atol=3e-3)
    np.testing.assert_allclose(denoise(1e3 * scan, faces, 3e2), 1e3 * smooth, atol=3.0)


def test_a_triangle_alone_has_nothing_to_be_smoothed_by():
    triangle = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 1.0]])
    np.testing.assert_array_equal(denoise(triangle, np.array([[0, 1, 2]]), 0.1), triangle)

from __future__ import annotations

import numpy as np
import pytest

from deskew.errors import InputError
from deskew.flattening.lengths import surface_lengths
from deskew.flattening.noiselevel import noise_level
from tests.flattening.noisy_sheets import SHEETS, noisy, roof, scroll


def strains(scan, faces, flat, sigma=0.0):
    """Relative errors (E,) of the lengths, and of the chords."""
    edges, lengths = surface_lengths(scan, faces, sigma)
    a, b = edges.T
    true = np.linalg.norm(flat[a] - flat[b], axis=1)
    return lengths / true - 1, np.linalg.norm(scan[a] - scan[b], axis=1) / true - 1


def test_edges_are_unique_sorted_and_in_order():
    vertices, faces, _ = SHEETS["arch"]()
    edges, lengths = surface_lengths(vertices, faces)
    pairs = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    np.testing.assert_array_equal(edges, np.unique(pairs, axis=0))
    assert lengths.shape == (len(edges),)


@pytest.mark.parametrize("offset", [0.1, 0.3, 0.6, 0.9])
def test_a_crease_between_vertices_is_unfolded(offset):
    vertices, faces, flat = roof(0.7, offset)
    found, chords = strains(vertices, faces, flat)
    assert chords.min() < -0.02
    # Two edges cut a corner of the page: there is nothing behind them.
    assert (abs(found) > 1e-9).sum() <= 2


@pytest.mark.parametrize("turn", [0.3, 0.7, 1.2])
def test_an_oblique_crease_is_unfolded_but_for_a_few_edges(turn):
    # A ray may look back along the crease, into a triangle that the crease crosses too.
    vertices, faces, flat = roof(0.7, 0.4, turn)
    found, chords = strains(vertices, faces, flat)
    assert abs(found.mean()) < 0.12 * abs(chords.mean())
    assert found.max() < 0.02


def test_curvature_is_no_crease():
    vertices, faces, flat = SHEETS["arch"]()
    found, chords = strains(vertices, faces, flat)
    assert -5e-5 < chords.min() < -1e-6
    np.testing.assert_allclose(found, chords, atol=2e-4)
    assert abs(found.mean() - chords.mean()) < 1e-7


@pytest.mark.parametrize("name", SHEETS)
def test_noise_leaves_the_mean_length_unbiased(name):
    vertices, faces, flat = SHEETS[name]()
    both = [strains(noisy(vertices, seed=seed), faces, flat, 0.3) for seed in (11, 12, 13)]
    found, chords = np.mean(both, axis=0)
    assert chords.mean() > 0.02
    # Without the bootstrap the arch and the folds come out 3.5e-4 short, without unfolding the roof and the folds 5e-4.
    assert abs(found.mean()) < 2.2e-4
    assert 0.001 < found.std() < 0.03


def test_a_scroll_with_noise_along_its_normals_is_unbiased():
    vertices, faces, flat = scroll()
    radial = vertices * [1, 0, 1] / np.linalg.norm(vertices[:, [0, 2]], axis=1)[:, None]
    scan = vertices + radial * np.random.default_rng(5).normal(0, 0.3, len(vertices))[:, None]
    found, chords = strains(scan, faces, flat, 0.3)
    assert chords.mean() > 0.02
    assert abs(found.mean()) < 2e-3


def test_same_scan_same_bytes():
    vertices, faces, _ = SHEETS["arch"]()
    scan = noisy(vertices)
    np.testing.assert_array_equal(surface_lengths(scan, faces, 0.3)[1], surface_lengths(scan, faces, 0.3)[1])


def test_pose_and_unit_do_not_matter():
    vertices, faces, _ = SHEETS["arch"]()
    scan = noisy(vertices)
    lengths = surface_lengths(scan, faces, 0.3)[1]
    c, s = np.cos(0.7), np.sin(0.7)
    turned = scan @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + [100.0, 2000.0, -30.0]
    # But for where the linear solver stops.
    np.testing.assert_allclose(surface_lengths(turned, faces, 0.3)[1], lengths, rtol=1e-3)
    np.testing.assert_allclose(surface_lengths(0.1 * scan, faces, 0.03)[1], 0.1 * lengths, rtol=1e-3)


def test_order_changes_lengths_only_by_the_noise_of_the_bootstrap():
    vertices, faces, flat = SHEETS["arch"]()
    scan = noisy(vertices)
    order = np.random.default_rng(1).permutation(len(scan))
    found, _ = strains(scan, faces, flat, 0.3)
    again, _ = strains(scan[order], np.argsort(order)[faces], flat[order], 0.3)
    assert abs(again.mean() - found.mean()) < 5e-4
    assert np.sort(again).std() == pytest.approx(found.std(), rel=0.15)


def test_winding_does_not_matter():
    vertices, faces, _ = SHEETS["arch"]()
    scan = noisy(vertices)
    lengths = surface_lengths(scan, faces, 0.3)[1]
    np.testing.assert_allclose(surface_lengths(scan, faces[:, ::-1], 0.3)[1], lengths, rtol=1e-3)


def test_a_hole_changes_lengths_at_its_rim_only():
    vertices, faces, _ = SHEETS["arch"]()
    scan = noisy(vertices)
    edges, lengths = surface_lengths(scan, faces, 0.3)
    row, column = np.divmod(faces.min(axis=1), 84)
    kept = (abs(row - 25) > 3) | (abs(column - 40) > 3)
    holed, again = surface_lengths(scan, faces[kept], 0.3)
    shared = np.isin(edges[:, 0] * len(scan) + edges[:, 1], holed[:, 0] * len(scan) + holed[:, 1])
    assert np.isfinite(again).all()
    change = np.abs(again / lengths[shared] - 1)
    far = np.abs(holed[:, 0] // 84 - 25) > 15
    assert change[far].max() < 2e-3
    assert change.max() < 0.3


@pytest.mark.parametrize("sigma", [0.0, 0.3])
def test_coincident_vertices_and_needles_are_borne(sigma):
    vertices, faces, _ = SHEETS["arch"]()
    scan = noisy(vertices, sigma)
    scan[1000], scan[2000] = scan[1001], (scan[2001] + scan[1917]) / 2
    edges, lengths = surface_lengths(scan, faces, sigma)
    assert np.isfinite(lengths).all()
    assert lengths[(edges == [1000, 1001]).all(axis=1)] < 0.15
    assert 0.97 * sigma <= noise_level(scan, faces) <= 1.03 * sigma + 3e-4


@pytest.mark.parametrize("sigma", [-1.0, np.inf, np.nan])
def test_impossible_noise_is_refused(sigma):
    vertices, faces, _ = SHEETS["arch"]()
    with pytest.raises(InputError, match="`sigma_mm` must be finite and not negative"):
        surface_lengths(vertices, faces, sigma)

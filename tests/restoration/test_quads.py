"""The backward map over the mesh: exact where theory gives it, and without gaps."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from deskew.restoration.quads import backward_quads
from deskew.types import Floats

SIZE = (120, 90)


def grid(
    rows: int, columns: int, low: tuple[float, float] = (10.3, 8.7), high: tuple[float, float] = (105.6, 80.2)
) -> Floats:
    x, y = np.linspace(low[0], high[0], columns), np.linspace(low[1], high[1], rows)
    return np.stack(np.meshgrid(x, y), axis=-1)


def pixels() -> Floats:
    return np.stack(np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1])), axis=-1).astype(float)


def inside_polygon(ring: Floats) -> np.ndarray:
    contour = ring.astype(np.float32).reshape(-1, 1, 2)
    return np.array(
        [[cv2.pointPolygonTest(contour, (float(x), float(y)), True) for x in range(SIZE[0])] for y in range(SIZE[1])]
    )


def ring_of(nodes: Floats) -> Floats:
    return np.concatenate([nodes[0, :-1], nodes[:-1, -1], nodes[-1, :0:-1], nodes[:0:-1, 0]])


def test_unmoved_mesh_maps_every_pixel_onto_itself() -> None:
    nodes = grid(6, 8) + np.random.default_rng(0).uniform(-2, 2, (6, 8, 2))
    out = backward_quads(nodes, nodes, SIZE)
    drawn = np.isfinite(out[..., 0])
    np.testing.assert_allclose(out[drawn], pixels()[drawn], atol=1e-9)
    assert drawn.sum() == pytest.approx(cv2.contourArea(ring_of(nodes).astype(np.float32)), rel=0.05)


@settings(deadline=None)
@given(st.floats(-3.1, 3.1), st.floats(0.5, 1.8), st.floats(-0.4, 0.4), st.integers(0, 2**31))
def test_affine_move_gives_exactly_its_inverse(angle: float, scale: float, shear: float, seed: int) -> None:
    old = grid(5, 4) + np.random.default_rng(seed).uniform(-3, 3, (5, 4, 2))
    matrix = scale * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]) @ [[1, shear], [0, 1]]
    middle = np.array([60.0, 45.0])
    out = backward_quads((old - middle) @ matrix.T + middle, old, SIZE)
    drawn = np.isfinite(out[..., 0])
    np.testing.assert_allclose(out[drawn], ((pixels() - middle) @ np.linalg.inv(matrix).T + middle)[drawn], atol=1e-7)
    assert drawn.sum() > 500


def test_homography_is_followed_to_the_second_order_of_the_quads_size() -> None:
    H = np.array([[1.1, 0.05, -6.0], [-0.03, 1.05, 2.0], [8e-4, -5e-4, 1.0]])
    errors = []
    for n in (6, 12, 24):
        old = grid(n, n)
        new = cv2.perspectiveTransform(old.reshape(-1, 1, 2), H).reshape(old.shape)
        out = backward_quads(new, old, SIZE)
        drawn = np.isfinite(out[..., 0])
        want = cv2.perspectiveTransform(pixels().reshape(-1, 1, 2), np.linalg.inv(H)).reshape(out.shape)
        errors.append(np.abs(out - want)[drawn].max())
    assert 0 < errors[2] < 0.01
    # Doubling the mesh quarters the error: between (n - 1) ratios 11 / 5 and 23 / 11, squared.
    assert errors[0] / errors[1] == pytest.approx((11 / 5) ** 2, rel=0.2)
    assert errors[1] / errors[2] == pytest.approx((23 / 11) ** 2, rel=0.2)


def test_inside_one_quad_the_map_is_the_inverse_of_the_bilinear_form() -> None:
    new = np.array([[[10.0, 12.0], [95.0, 20.0]], [[22.0, 80.0], [80.0, 60.0]]])
    out = backward_quads(new, np.array([[[0.0, 0.0], [1.0, 0.0]], [[0.0, 1.0], [1.0, 1.0]]]), SIZE)
    drawn = np.isfinite(out[..., 0]) & (out >= 0).all(-1) & (out <= 1).all(-1)
    a, b = out[drawn].T[..., None]
    forward = (1 - b) * ((1 - a) * new[0, 0] + a * new[0, 1]) + b * ((1 - a) * new[1, 0] + a * new[1, 1])
    np.testing.assert_allclose(forward, pixels()[drawn], atol=1e-9)
    assert drawn.sum() > 2000


@pytest.mark.parametrize("jitter", [0.0, 6.0, 14.0])
def test_no_pixel_inside_the_page_is_left_without_a_source(jitter: float) -> None:
    """Jitter of 14 px on quads of 13 px folds, crosses and turns over many of them."""
    nodes = grid(6, 8)
    moved = nodes.copy()
    moved[1:-1, 1:-1] += np.random.default_rng(3).uniform(-jitter, jitter, (4, 6, 2))
    out = backward_quads(moved, nodes, SIZE)
    inside = inside_polygon(ring_of(moved)) > 1e-6
    assert np.isfinite(out[inside]).all()
    assert inside.sum() > 6000


@pytest.mark.parametrize("reflex", range(4))
def test_concave_quad_fills_itself_and_nothing_else(reflex: int) -> None:
    ring = np.array([[15.0, 12.0], [100.0, 15.0], [97.0, 80.0], [18.0, 77.0]])
    ring[reflex] = 0.75 * ring[(reflex + 2) % 4] + 0.25 * ring[reflex]
    new = ring[[0, 1, 3, 2]].reshape(2, 2, 2)
    out = backward_quads(new, np.array([[[0.0, 0.0], [1.0, 0.0]], [[0.0, 1.0], [1.0, 1.0]]]), SIZE)
    distance = inside_polygon(ring)
    assert np.isfinite(out[distance > 1e-6]).all()
    assert np.isnan(out[distance < -1e-6]).all()
    assert (distance > 0).sum() > 1000


def test_vanishing_and_thin_quads_leave_no_gap() -> None:
    nodes = grid(5, 7)
    moved = nodes.copy()
    moved[:, 3] = moved[:, 2]  # one column of quads without area
    moved[2, 1:-1] = moved[1, 1:-1] + [0.0, 1e-7]  # one row a ten-millionth of a pixel thin
    out = backward_quads(moved, nodes, SIZE)
    inside = inside_polygon(ring_of(moved)) > 1e-6
    assert np.isfinite(out[inside]).all()


def test_sound_quads_lie_on_top_of_folded_ones() -> None:
    nodes = grid(4, 6)
    moved = nodes.copy()
    moved[:, 2, 0], moved[:, 3, 0] = nodes[:, 3, 0], nodes[:, 2, 0]  # the middle column of quads turned over
    out = backward_quads(moved, nodes, SIZE)
    x_old = nodes[0, :, 0]
    row = out[40]
    between = (pixels()[40, :, 0] > x_old[2]) & (pixels()[40, :, 0] < x_old[3])
    sources = row[between, 0]
    assert ((sources < x_old[2] + 1e-9) | (sources > x_old[3] - 1e-9)).all()


def test_map_is_continuous_across_every_edge() -> None:
    old = grid(7, 9)
    new = old + np.random.default_rng(8).uniform(-2.5, 2.5, old.shape)
    out = backward_quads(new, old, (SIZE[0], SIZE[1]))
    fine = backward_quads(new * 8 + 3.5, old, (SIZE[0] * 8, SIZE[1] * 8))
    steps = np.abs(np.diff(fine, axis=1))
    # A step of an eighth of a pixel cannot move the source farther than the most compressed quad allows.
    assert 0.1 < np.nanmax(steps) < 0.6
    assert np.nanmedian(np.abs(np.diff(out, axis=1)[..., 0])) == pytest.approx(1.0, abs=0.2)


def test_ring_reaches_half_a_pixel_beyond_the_page_and_no_farther() -> None:
    nodes = grid(6, 8)
    out = backward_quads(nodes, nodes, SIZE)
    x, y = np.moveaxis(pixels(), -1, 0)
    beyond = np.maximum.reduce([10.3 - x, x - 105.6, 8.7 - y, y - 80.2])
    assert np.isfinite(out[beyond < 0.499]).all()
    assert np.isnan(out[beyond > 0.501]).all()
    assert np.isnan(backward_quads(nodes + 500.0, nodes, SIZE)).all()


def test_mirrored_mesh_is_drawn_as_it_lies() -> None:
    nodes = grid(6, 8)
    mirrored = nodes.copy()
    mirrored[..., 0] = 116.0 - nodes[..., 0]
    out = backward_quads(mirrored, nodes, SIZE)
    drawn = np.isfinite(out[..., 0])
    np.testing.assert_allclose(out[drawn][:, 0], 116.0 - pixels()[drawn][:, 0], atol=1e-9)
    assert drawn.sum() > 6000


def test_cut_quads_are_not_drawn() -> None:
    nodes = grid(6, 8)
    cut = np.zeros((5, 7), dtype=bool)
    cut[:, 3] = True
    whole, torn = (np.isfinite(backward_quads(nodes, nodes, SIZE, c)[..., 0]) for c in (None, cut))
    gone = whole & ~torn
    x = pixels()[..., 0][gone]
    assert gone.any()
    assert nodes[0, 3, 0] - 0.6 < x.min() < nodes[0, 3, 0] + 1.1
    assert nodes[0, 4, 0] - 1.1 < x.max() < nodes[0, 4, 0] + 0.6
    assert not (torn & ~whole).any()

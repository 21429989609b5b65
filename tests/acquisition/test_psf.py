from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import erf

import data_synth
from deskew.acquisition import find_board
from deskew.acquisition.psf import FEWEST_EDGES, camera_psf, edge_blurs
from deskew.errors import InputError

SHAPE, SQUARE_PX = (9, 6), 24.0
PIXEL_VARIANCE = 1 / 12


def blurred_wave(x, sigma):
    """The wave +1, -1, +1 ... on unit cells, blurred by a Gaussian: a sum of error functions."""
    x = x % 2.0
    return np.asarray(sum((1 - 2 * (k % 2)) * erf((x - k) / (np.sqrt(2) * sigma)) for k in range(-1, 4)))


def drawn_board(lens_px, turn_deg=7.0, low=20.0, high=200.0, oversampling=5):
    """A checkerboard under a Gaussian lens, each pixel the mean over its area; with its true corners (ny, nx, 2)."""
    nx, ny = SHAPE
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    R, middle = np.array([[c, -s], [s, c]]), np.array([150.3, 110.6])
    corners = np.stack(np.meshgrid(np.arange(nx) - (nx - 1) / 2, np.arange(ny) - (ny - 1) / 2), axis=-1)
    sub = (np.arange(oversampling) + 0.5) / oversampling - 0.5
    x, y = np.meshgrid((np.arange(300)[:, None] + sub).ravel(), (np.arange(220)[:, None] + sub).ravel())
    u, v = np.moveaxis((np.stack([x, y], axis=-1) - middle) @ R / SQUARE_PX + (nx / 2 - 0.5, ny / 2 - 0.5), -1, 0)
    sigma = lens_px / SQUARE_PX
    grey = low + (high - low) * (1 + blurred_wave(u, sigma) * blurred_wave(v, sigma)) / 2
    return grey.reshape(220, oversampling, 300, oversampling).mean(axis=(1, 3)), SQUARE_PX * corners @ R.T + middle


@pytest.mark.parametrize(
    ("lens_px", "turn_deg"), [(0.4, 7.0), (0.6, 7.0), (0.75, 0.0), (0.75, 7.0), (0.75, 38.0), (1.0, 7.0), (1.5, 7.0)]
)
def test_the_footprint_is_the_lens_and_the_pixel_together(lens_px, turn_deg):
    blurs = edge_blurs(*drawn_board(lens_px, turn_deg))
    assert len(blurs) > 60
    assert np.median(blurs) == pytest.approx(np.hypot(lens_px, np.sqrt(PIXEL_VARIANCE)), rel=0.03)
    assert np.median(blurs) > 1.01 * lens_px  # nor is it the lens alone


def test_noise_and_rounding_do_not_widen_it():
    lit, corners = drawn_board(0.75)
    rng = np.random.default_rng(1)
    noisy = np.rint(lit + rng.normal(0, 4.0, lit.shape)) - np.rint(rng.normal(0, 2.0, lit.shape))
    blurs = edge_blurs(noisy, corners)
    assert 0.003 < blurs.std() < 0.06
    assert camera_psf(blurs) == pytest.approx(np.sqrt(0.75**2 + PIXEL_VARIANCE), rel=0.01)


@pytest.mark.parametrize("lens_px", [0.5, 0.75, 1.1])
def test_rendered_boards_give_the_rig_s_own_spread(lens_px):
    rig = data_synth.default_rig()
    rig = replace(rig, config=replace(rig.config, camera_psf_sigma_px=lens_px))
    blurs = []
    for number in (1, 3):
        capture = data_synth.render_board(rig, data_synth.board_poses(9)[number], seed=number)
        lit = capture.white.astype(float) - capture.black
        blurs.append(edge_blurs(lit, find_board(lit, data_synth.BOARD.shape), capture.white < 255))
    assert camera_psf(np.concatenate(blurs)) == pytest.approx(np.sqrt(lens_px**2 + PIXEL_VARIANCE), rel=0.02)


@given(st.floats(-3, 3).filter(lambda gain: abs(gain) > 0.05), st.floats(-50, 50))
@settings(max_examples=15, deadline=None)
def test_light_and_level_change_nothing(gain, level):
    lit, corners = DRAWN
    np.testing.assert_allclose(edge_blurs(gain * lit + level, corners), edge_blurs(lit, corners), rtol=1e-4)


def test_a_turned_picture_has_the_same_edges():
    lit, corners = DRAWN
    turned = np.stack([corners[..., 1], lit.shape[1] - 1 - corners[..., 0]], axis=-1)
    np.testing.assert_allclose(np.sort(edge_blurs(np.rot90(lit), turned)), np.sort(edge_blurs(lit, corners)), rtol=1e-4)


def test_errors_of_the_corners_are_taken_up_by_each_edge_s_own_place():
    lit, corners = DRAWN
    wrong = corners + np.random.default_rng(2).normal(0, 0.1, corners.shape)
    assert camera_psf(edge_blurs(lit, wrong)) == pytest.approx(camera_psf(edge_blurs(lit, corners)), rel=0.003)


def test_a_smudge_over_a_quarter_of_the_board_does_not_move_the_median():
    lit, corners = DRAWN
    smudged = lit.copy()
    smudged[:, :110] = np.random.default_rng(3).normal(100, 30, smudged[:, :110].shape)
    assert 40 < len(edge_blurs(smudged, corners)) < len(edge_blurs(lit, corners))
    assert camera_psf(edge_blurs(smudged, corners)) == pytest.approx(camera_psf(edge_blurs(lit, corners)), rel=0.01)


def test_edges_beside_clipped_paper_are_not_fitted():
    lit, corners = DRAWN
    clipped = lit > 150
    assert len(edge_blurs(np.minimum(lit, 150), corners, ~clipped)) == 0


def test_no_edges_give_no_spread():
    _, corners = DRAWN
    assert camera_psf(edge_blurs(np.full((220, 300), 80.0), corners)) is None
    assert camera_psf(np.full(FEWEST_EDGES - 1, 0.8)) is None
    assert camera_psf(np.full(FEWEST_EDGES, 0.8)) == 0.8
    # Squares of three pixels have no level between their edges, and corners outside the picture no pixels.
    assert len(edge_blurs(DRAWN[0], (corners - corners.mean((0, 1))) / 8 + 100)) == 0
    assert len(edge_blurs(DRAWN[0], corners + 1000)) == 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"lit": np.zeros((3, 4, 3))}, r"`lit` must be \(height, width\), got \(3, 4, 3\)"),
        ({"corners": np.zeros((5, 2))}, r"`corners` must be \(ny, nx, 2\), got \(5, 2\)"),
        ({"corners": np.full((3, 4, 2), np.nan)}, r"`corners` must be finite \[px\], got NaN"),
        ({"usable": np.ones((2, 2), bool)}, r"`usable` must have lit's shape \(220, 300\), got \(2, 2\)"),
    ],
    ids=["colour", "flat corners", "NaN", "another mask"],
)
def test_bad_input_is_named(change, message):
    lit, corners = DRAWN
    with pytest.raises(InputError, match=message):
        edge_blurs(**({"lit": lit, "corners": corners} | change))


DRAWN = drawn_board(0.75)

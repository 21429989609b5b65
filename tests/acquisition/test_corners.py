import numpy as np
import pytest
from scipy.special import erf

from deskew.acquisition.corners import (
    find_board,
    kitchen_rosenfeld_peaks,
    refine_kitchen_rosenfeld,
    refine_saddle,
)
from deskew.errors import InputError, StepError
from deskew.projection import pixel_grid

BLUR_PX = 1.0


def _x_corner(corner, angle, size=(41, 41), skew=0.0):
    """An ideal X-corner, blurred by a Gaussian, between 40 and 200 grey levels; its saddle is at `corner`."""
    d = pixel_grid(size) - corner
    u = np.cos(angle) * d[..., 0] + np.sin(angle) * d[..., 1]
    v = -np.sin(angle + skew) * d[..., 0] + np.cos(angle + skew) * d[..., 1]
    return 120 + 80 * erf(u / (BLUR_PX * np.sqrt(2))) * erf(v / (BLUR_PX * np.sqrt(2)))


def _board(shape, square_px, origin, angle, size, noise, rng):
    """A blurred checkerboard and its inner corners (ny, nx, 2)."""
    nx, ny = shape
    rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    place = (pixel_grid(size) - origin) @ rotation / square_px
    profile = [np.ones(place.shape[:2]), np.ones(place.shape[:2])]
    for axis, n in enumerate((nx, ny)):
        for line in range(n):
            profile[axis] = profile[axis] * erf((place[..., axis] - line) * square_px / (BLUR_PX * np.sqrt(2)))
    inside = (place > -1).all(-1) & (place[..., 0] < nx) & (place[..., 1] < ny)
    image = np.where(inside, 120 + 80 * profile[0] * profile[1], 200) + noise * rng.standard_normal(place.shape[:2])
    corners = np.stack(np.meshgrid(np.arange(nx), np.arange(ny)), -1) * square_px
    return np.clip(np.rint(image), 0, 255).astype(np.uint8), corners @ rotation.T + origin


OFFSETS = [(20.0, 20.0), (20.3, 19.6), (19.75, 20.5), (20.49, 20.49)]


@pytest.mark.parametrize("offset", OFFSETS)
@pytest.mark.parametrize("angle", [0.0, 0.3, 0.7])
def test_saddle_of_an_ideal_corner_is_exact(offset, angle):
    image = _x_corner(offset, angle)
    found = refine_saddle(image, np.array([[20.0, 20.0]]))
    assert np.abs(found[0] - offset).max() < 2e-3


@pytest.mark.parametrize("offset", OFFSETS)
@pytest.mark.parametrize("angle", [0.0, 0.3, 0.7])
def test_kitchen_rosenfeld_centroid_of_an_ideal_corner_is_within_a_thirtieth_pixel(offset, angle):
    image = _x_corner(offset, angle)
    found = refine_kitchen_rosenfeld(image, np.array([[20.0, 20.0]]))
    assert np.abs(found[0] - offset).max() < 1 / 30


def test_naive_kitchen_rosenfeld_peak_lies_two_pixels_off_the_corner():
    """The negative: the response is 0/0 at the corner itself, so its maximum is in one of the lobes around it."""
    rng = np.random.default_rng(3)
    errors = []
    for _ in range(60):
        corner = 20 + rng.uniform(-0.5, 0.5, 2)
        image = _x_corner(corner, rng.uniform(0, np.pi)) + 2 * rng.standard_normal((41, 41))
        errors.append(kitchen_rosenfeld_peaks(image, np.array([[20.0, 20.0]]))[0] - corner)
    assert 1.2 < np.sqrt(np.mean(np.sum(np.square(errors), axis=1))) < 2.4


@pytest.mark.parametrize(("refine", "most"), [(refine_saddle, 0.035), (refine_kitchen_rosenfeld, 0.05)])
def test_noise_of_two_grey_levels_moves_corners_by_a_few_hundredths(refine, most):
    rng = np.random.default_rng(7)
    errors = []
    for _ in range(60):
        corner, angle = 20 + rng.uniform(-0.5, 0.5, 2), rng.uniform(0, np.pi)
        image = _x_corner(corner, angle, skew=rng.uniform(-0.2, 0.2)) + 2 * rng.standard_normal((41, 41))
        errors.append(refine(image, np.array([[20.0, 20.0]]))[0] - corner)
    rms = np.sqrt(np.mean(np.sum(np.square(errors), axis=1)))
    assert 0.005 < rms < most


def test_saddle_is_found_from_a_seed_several_pixels_off():
    image = _x_corner((20.3, 19.6), 0.2)
    found = refine_saddle(image, np.array([[25.0, 15.0]]), search_px=8.0)
    assert np.abs(found[0] - (20.3, 19.6)).max() < 2e-3


def test_a_flat_image_or_a_seed_off_the_image_loses_the_corner():
    flat = np.full((41, 41), 100.0)
    flat[:, 20:] = 150  # an edge has no saddle
    seeds = np.array([[20.0, 20.0], [1.0, 20.0], [np.nan, 3.0]])
    assert np.isnan(refine_saddle(flat, seeds)).all()
    assert np.isnan(refine_kitchen_rosenfeld(flat, seeds)[1:]).all()


@pytest.mark.parametrize("turn", [0.0, 0.2, -0.4])
def test_board_is_found_with_x_to_the_right_and_rows_downwards(turn):
    image, corners = _board(
        (8, 5), 30.0, np.array([70.0, 90.0 + 100 * max(0, -turn)]), turn, (420, 360), 2.0, np.random.default_rng(1)
    )
    found = find_board(image, (8, 5))
    assert found.shape == (5, 8, 2)
    assert 0.003 < np.sqrt(np.mean(np.sum((found - corners) ** 2, -1))) < 0.06


@pytest.mark.parametrize("refine", [refine_saddle, refine_kitchen_rosenfeld])
def test_a_blank_page_has_no_corners(refine):
    rng = np.random.default_rng(5)
    shaded = 150 + 0.1 * pixel_grid((300, 300))[..., 0] + 2 * rng.standard_normal((300, 300))
    shaded[:, 150:] -= 30  # a crease
    seeds = np.stack(np.meshgrid(np.arange(30, 280, 25.0), np.arange(30, 280, 25.0)), -1).reshape(-1, 2)
    assert np.isnan(refine(np.clip(shaded, 0, 255).astype(np.uint8), seeds)).all()


def test_no_board_is_said_so():
    with pytest.raises(StepError, match="no board of 8 x 5 inner corners"):
        find_board(np.full((200, 200), 128, np.uint8), (8, 5))


def test_wrong_shapes_are_refused():
    with pytest.raises(InputError, match="`seeds` must have shape"):
        refine_saddle(np.zeros((20, 20)), np.zeros(2))
    with pytest.raises(InputError, match="`image` must be"):
        refine_saddle(np.zeros((20, 20, 3, 1)), np.zeros((1, 2)))
    with pytest.raises(InputError, match=r"`sigma_px` must be in \(0, 100\]"):
        refine_saddle(np.zeros((20, 20)), np.zeros((1, 2)), sigma_px=0.0)


@pytest.mark.parametrize("shape", [(2, 2), (5,), (5.5, 4), 5, (1001, 4)])
def test_a_board_of_no_sound_shape_is_refused(shape):
    with pytest.raises(InputError, match=r"`shape` must be \(nx, ny\) of at least 3 inner corners"):
        find_board(np.zeros((64, 64)), shape)


@pytest.mark.parametrize("side", [1, 2, 5, 15])
def test_an_image_too_small_for_a_board_is_refused(side):
    with pytest.raises(InputError, match="`image` must be at least 16 x 16 pixels"):
        find_board(np.zeros((side, 64)), (5, 4))


def test_a_small_image_without_a_board_is_a_failed_step():
    with pytest.raises(StepError, match="no board of 5 x 4"):
        find_board(np.zeros((16, 16)), (5, 4))


@pytest.mark.parametrize("refined", [refine_saddle, refine_kitchen_rosenfeld, kitchen_rosenfeld_peaks])
def test_an_image_without_pixels_has_no_corners_to_refine(refined):
    with pytest.raises(InputError, match="`image` must have at least 1 pixel"):
        refined(np.zeros((0, 0)), np.zeros((1, 2)))


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf, 1e9, "4"])
def test_windows_out_of_range_are_refused(value):
    seeds = np.zeros((1, 2))
    for name in ("search_px", "sigma_px"):
        with pytest.raises(InputError, match=rf"`{name}` must be in \(0, 100\] \[px\]"):
            refine_saddle(np.zeros((20, 20)), seeds, **{name: value})
    with pytest.raises(InputError, match=r"`radius_px` must be a whole number in \[1, 100\]"):
        refine_kitchen_rosenfeld(np.zeros((20, 20)), seeds, radius_px=value)

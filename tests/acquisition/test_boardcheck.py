"""Points of a scanned plane, and a board whose true lengths are known."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from deskew.acquisition import board_accuracy, board_border, board_points, scanned_points
from deskew.errors import StepError
from deskew.projection import ideal, pixel_grid, project, rays
from deskew.types import Board, DepthMap, Floats, Pinhole

SIZE = (160, 120)
K = np.array([[400.0, 0.0, 80.3], [0.0, 401.0, 59.6], [0.0, 0.0, 1.0]])
ROTATION = cv2.Rodrigues(np.array([3.0, 0.1, -0.2]))[0]
CAMERA = Pinhole(SIZE, K, np.array([-0.1, 0.05, 1e-3, -1e-3, 0.0]), ROTATION, np.array([5.0, -3.0, 800.0]))
NORMAL, OFFSET = np.array([0.1, -0.2, 0.97]) / np.linalg.norm([0.1, -0.2, 0.97]), 12.0
BOARD = Board((5, 4), 30.0)


def plane_depth(pixels: Floats) -> Floats:
    """Return the camera z at which the ideal camera's rays meet the plane NORMAL . x = OFFSET."""
    origin = -CAMERA.R.T @ CAMERA.t
    return np.asarray((OFFSET - origin @ NORMAL) / (rays(ideal(CAMERA), pixels) @ NORMAL))


def test_points_of_a_scanned_plane_lie_in_it_at_their_own_pixels() -> None:
    z = plane_depth(pixel_grid(SIZE))
    # Holes and wild values, as a scan has them.
    z[30:32, 40:60] = np.nan
    z[60, 80] += 40.0
    depth = DepthMap(z, (~np.isfinite(z)).astype(np.uint8), ideal(CAMERA))
    places = np.array([(50.25, 33.5), (80.7, 61.2), (100.0, 90.0)])
    points = scanned_points(depth, places, 6)
    assert np.abs(points @ NORMAL - OFFSET).max() < 0.02
    assert np.abs(project(depth.camera, points) - places).max() < 1e-6


def test_points_without_a_neighbourhood_are_missing() -> None:
    z = plane_depth(pixel_grid(SIZE))
    z[:, :40] = np.nan
    depth = DepthMap(z, (~np.isfinite(z)).astype(np.uint8), ideal(CAMERA))
    points = scanned_points(depth, np.array([(10.0, 60.0), (np.nan, 5.0), (100.0, 60.0), (36.0, 60.0)]), 6)
    assert np.isfinite(points).all(axis=1).tolist() == [False, False, True, False]


def posed() -> Floats:
    """Corners of the board in the plane, (20, 3)."""
    x = np.cross(NORMAL, [0.0, 1.0, 0.0])
    x = -x / np.linalg.norm(x)
    return board_points(BOARD) @ np.stack([x, np.cross(NORMAL, x), NORMAL]) + OFFSET * NORMAL


def scanned(scale: float = 1.0) -> DepthMap:
    z = scale * plane_depth(pixel_grid(SIZE))
    z[:, :10] = np.nan
    return DepthMap(z, (~np.isfinite(z)).astype(np.uint8), ideal(CAMERA))


def test_a_board_seen_as_it_is_has_no_error() -> None:
    found = board_accuracy(BOARD, project(CAMERA, posed()), CAMERA, scanned())
    assert found.length_rms_mm < 1e-6
    assert found.plane.max_mm < 1e-6
    assert found.coverage == 1.0


def test_lengths_see_a_wrong_scale_that_the_plane_is_blind_to() -> None:
    # From the camera's centre everything is 1 % farther, so 1 % longer; of 20 corners the ends are 150 mm apart.
    found = board_accuracy(BOARD, project(CAMERA, posed()), CAMERA, scanned(1.01), min_length=149.0, radius_px=4)
    diagonal = 30.0 * np.hypot(4, 3)
    assert found.length_rms_mm == pytest.approx(0.01 * diagonal, rel=1e-6)
    assert found.plane.max_mm < 1e-6


def test_pixels_without_depth_are_not_covered() -> None:
    depth, corners = scanned(), project(CAMERA, posed())
    border = board_border(BOARD, project(ideal(CAMERA), posed()))
    z = depth.z.copy()
    half = round(float(border[:, 0].mean()))
    z[:, half:] = np.nan
    cut = DepthMap(z, (~np.isfinite(z)).astype(np.uint8), depth.camera)
    assert 0.45 < board_accuracy(BOARD, corners, CAMERA, cut, min_length=20.0).coverage < 0.55
    # Of the border 1.9 squares lie beyond the inner corners, 0.9 to each side.
    step = np.linalg.norm(border[1] - border[0]) / np.linalg.norm(border[2] - border[1])
    assert step == pytest.approx((4 + 1.8) / (3 + 1.8), rel=0.05)


def test_a_board_without_depth_is_a_step_that_failed() -> None:
    z = np.full(SIZE[::-1], np.nan)
    dark = DepthMap(z, np.ones(z.shape, np.uint8), ideal(CAMERA))
    with pytest.raises(StepError, match="0 of 20 corners have depth around them"):
        board_accuracy(BOARD, project(CAMERA, posed()), CAMERA, dark)

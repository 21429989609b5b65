"""The pinhole against OpenCV, whose lens model it is."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from deskew.projection import distort, ideal, pixel_grid, project, rays, undistort
from deskew.types import Floats, Pinhole

SIZE = (640, 480)
LENSES = {
    "barrel": (-0.09, 0.12, 4e-4, -3e-4, 0.0),
    "pincushion": (0.2, -0.1, -2e-3, 1e-3, 0.05),
    "wide": (-0.28, 0.09, 1e-3, -8e-4, -0.01),
    "none": (0.0,) * 5,
}


def device(lens: str, turn: tuple[float, float, float] = (3.0, 0.1, -0.2), focal: float = 1200.0) -> Pinhole:
    K = np.array([[focal, 0.0, 331.7], [0.0, 1.002 * focal, 229.1], [0.0, 0.0, 1.0]])
    R = cv2.Rodrigues(np.array(turn))[0]
    return Pinhole(SIZE, K, np.array(LENSES[lens]), R, np.array([12.0, -7.0, 800.0]))


def opencv_pixels(camera: Pinhole, points: Floats) -> Floats:
    # Not by a rotation vector: OpenCV's own takes a turn of less than 1e-5 for none.
    local = (points @ camera.R.T + camera.t).reshape(-1, 1, 3)
    found = cv2.projectPoints(local, np.zeros(3), np.zeros(3), camera.K, camera.distortion)[0]
    return np.asarray(found).reshape(*points.shape[:-1], 2)


def opencv_normalised(camera: Pinhole, pixels: Floats) -> Floats:
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 200, 1e-16)
    found = cv2.undistortPoints(pixels.reshape(-1, 1, 2), camera.K, camera.distortion, criteria=criteria)
    return np.asarray(found).reshape(pixels.shape)


@pytest.mark.parametrize("lens", LENSES)
@settings(deadline=None)  # the first one may compile
@given(turn=st.tuples(*[st.floats(-3.0, 3.0)] * 3), seed=st.integers(0, 2**32 - 1))
def test_points_are_projected_where_opencv_projects_them(
    lens: str, turn: tuple[float, float, float], seed: int
) -> None:
    camera = device(lens, turn)
    local = np.random.default_rng(seed).uniform((-200.0, -150.0, 600.0), (200.0, 150.0, 1000.0), (4, 5, 3))
    points = (local - camera.t) @ camera.R
    assert np.abs(project(camera, points) - opencv_pixels(camera, points)).max() < 1e-9


@pytest.mark.parametrize("lens", LENSES)
def test_lenses_are_undone_as_opencv_undoes_them(lens: str) -> None:
    camera = device(lens)
    pixels = pixel_grid(SIZE)[::5, ::5] + 0.37
    normalised = undistort(camera, pixels)
    assert np.abs(normalised - opencv_normalised(camera, pixels)).max() * camera.K[0, 0] < 1e-9
    assert np.abs(distort(camera, normalised) - pixels).max() < 1e-9
    moved = np.abs(normalised - undistort(ideal(camera), pixels)).max() * camera.K[0, 0]
    assert moved == 0.0 if lens == "none" else moved > 1.0


def test_a_missing_pixel_stays_missing_and_moves_no_other() -> None:
    camera = device("barrel")
    pixels = pixel_grid(SIZE)[::100, ::100].copy()
    whole = undistort(camera, pixels)
    pixels[1, 2, 0] = np.nan
    holed = undistort(camera, pixels)
    assert np.isnan(holed[1, 2]).all()
    holed[1, 2] = whole[1, 2]
    assert np.array_equal(holed, whole)


def test_rays_reach_the_points_that_their_pixels_show() -> None:
    camera = device("wide")
    points = np.random.default_rng(3).uniform(-80.0, 80.0, (50, 3))
    depth = points @ camera.R[2] + camera.t[2]
    reached = -camera.R.T @ camera.t + depth[:, None] * rays(camera, project(camera, points))
    assert np.abs(reached - points).max() < 1e-9


def test_integer_and_strided_pixels_are_taken_as_they_are() -> None:
    camera = device("barrel")
    pixels = np.arange(24).reshape(3, 4, 2)
    expected = opencv_normalised(camera, pixels[:, ::2].astype(np.float64))
    assert np.abs(undistort(camera, pixels[:, ::2]) - expected).max() < 1e-12

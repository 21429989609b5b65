from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from deskew import acquisition
from deskew.types import Array
from experiments.studies.views import DETECTORS, map_error_mm, reflectance

CORNER = np.array([[40.3, 35.8]])


def corner(shade: float, distance: float) -> Array:
    """An X-corner, blurred, with a shading edge that passes it at a distance [px]: darker by a factor on one side."""
    y, x = np.mgrid[0:320, 0:320] / 4.0 - 0.375
    black = (x < CORNER[0, 0]) == (y < CORNER[0, 1])
    side = (x - CORNER[0, 0]) * 0.8 + (y - CORNER[0, 1]) * 0.6 > distance
    light = np.where(black, 14.0, 180.0) * np.where(side, shade, 1.0)
    return gaussian_filter(light, 3.0).reshape(80, 4, 80, 4).mean(axis=(1, 3))


@pytest.mark.parametrize("name", sorted(DETECTORS))
def test_corner_without_shade_is_found(name: str) -> None:
    found = DETECTORS[name](corner(1.0, 0.0), np.rint(CORNER))
    assert 0 <= np.linalg.norm(found - CORNER) < 0.12


def test_shading_edges_pull_corners_less_in_logarithms() -> None:
    plain, in_logarithms = [], []
    for shade in (0.45, 0.6, 0.75):
        for distance in (1.0, 2.0, 3.0, 4.0, 6.0):
            image = corner(shade, distance)
            plain.append(acquisition.refine_kitchen_rosenfeld(image, np.rint(CORNER)) - CORNER)
            in_logarithms.append(DETECTORS[""](image, np.rint(CORNER)) - CORNER)
    before, after = (np.linalg.norm(np.concatenate(errors), axis=1) for errors in (plain, in_logarithms))
    assert 0.1 < after.mean() < 0.85 * before.mean()
    assert after.max() < before.max()


def test_reflectance_does_not_know_how_bright_the_light_is() -> None:
    image = corner(1.0, 0.0)
    assert np.allclose(reflectance(image), reflectance(3.0 * image))


def test_a_picture_read_half_a_pixel_beside_its_map_is_so_far_from_it() -> None:
    """On a sheared map, with a corner off the page and one not found, which say nothing."""
    y, x = np.mgrid[0:60, 0:80].astype(float)
    uv = np.stack([0.5 * x + 0.1 * y, 0.5 * y], axis=-1)
    uv[:, 70:] = np.nan
    pixels = np.array([[10.25, 20.5], [33.0, 41.75], [75.0, 10.0], [np.nan, np.nan]])
    corners = np.stack([0.5 * pixels[:, 0] + 0.1 * pixels[:, 1], 0.5 * pixels[:, 1]], axis=-1)
    assert map_error_mm(uv, pixels, corners) < 1e-9
    assert map_error_mm(uv, pixels + 0.5, corners) == pytest.approx(np.hypot(0.3, 0.25))

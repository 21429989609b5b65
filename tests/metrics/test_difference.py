from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from deskew.errors import InputError, StepError
from deskew.metrics import image_difference, laid_onto
from deskew.types import Flattened, Floats, Status

Y, X = np.mgrid[0.0:40.0:5.0, 0.0:60.0:4.0]
GRID = np.stack([X, -Y, np.zeros_like(X)], axis=-1)


def moved(grid: Floats, angle: float, dx: float, dy: float) -> Floats:
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(grid @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) + [dx, dy, 0.0])


@settings(max_examples=20, deadline=None)
@given(st.floats(-3.0, 3.0), st.floats(-50, 50), st.floats(-50, 50))
def test_sheet_turned_and_moved_is_laid_back_with_its_surface(angle: float, dx: float, dy: float) -> None:
    there = Flattened(moved(GRID, angle, dx, dy), Status.AT_REST, surface=moved(GRID[::2, ::2], angle, dx, dy))
    back = laid_onto(there, Flattened(GRID, Status.AT_REST))
    assert np.allclose(back.vertices, GRID, atol=1e-9)
    assert back.surface is not None
    assert np.allclose(back.surface, GRID[::2, ::2], atol=1e-9)


def test_size_is_not_fitted_away() -> None:
    back = laid_onto(Flattened(1.02 * GRID, Status.AT_REST), Flattened(GRID, Status.AT_REST))
    assert np.ptp(back.vertices[..., 0]) == pytest.approx(1.02 * np.ptp(GRID[..., 0]))


def test_difference_counts_the_page_alone() -> None:
    first, second = np.full((4, 6), 10, np.uint8), np.full((4, 6), 13, np.uint8)
    page = np.zeros((4, 6), dtype=bool)
    page[:2] = True
    second[0] = 6
    second[3] = 255
    difference, figures = image_difference(first, second, page)
    assert figures["difference_rms_grey"] == pytest.approx(np.sqrt((4**2 + 3**2) / 2))
    assert np.array_equal(difference[:, 0], [4.0, -3.0, 0.0, 0.0])


def test_images_that_cannot_be_compared_are_refused() -> None:
    image, page = np.zeros((4, 6)), np.ones((4, 6), dtype=bool)
    with pytest.raises(InputError, match="`second` must have the first's shape"):
        image_difference(image, image[1:], page)
    with pytest.raises(InputError, match="`first` must be a grey image"):
        image_difference(image[..., None], image, page)
    with pytest.raises(InputError, match="`page` must have the images' shape"):
        image_difference(image, image, page[1:])
    with pytest.raises(StepError, match="no pixel shows the page in both"):
        image_difference(image, image, ~page)
    with pytest.raises(InputError, match="`flattened` must have the other's shape"):
        laid_onto(Flattened(GRID, Status.AT_REST), Flattened(GRID[1:], Status.AT_REST))

"""Pictures that were flattened by themselves, laid onto the control."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import data_synth
from data_synth import Checkerboard
from deskew import restoration
from deskew.errors import StepError
from deskew.types import Array, Floats
from experiments.studies.placed import Placed, board_corners
from experiments.trials.threads import one_thread

PAGE = Checkerboard()
VIEW = restoration.view_camera(data_synth.default_rig().camera)


def picture(width: int, height: int) -> tuple[Array, Floats]:
    """The flat page filling a picture, and where its corners lie in it [px]."""
    sides = np.array(PAGE.page_size_mm) / (width, height)
    x, y = (axis.ravel() + 0.5 for axis in np.meshgrid(np.arange(width), np.arange(height)))
    footprint = np.full(x.size, 2.0)
    albedo = PAGE.albedo(x * sides[0], y * sides[1], footprint * sides[0], footprint * sides[1])
    image = np.rint(230 * albedo).astype(np.uint8).reshape(height, width)
    return image, PAGE.corners.reshape(-1, 2) / sides - 0.5


@pytest.fixture(autouse=True)
def single() -> Iterator[None]:
    """As in a trial; OpenCV's detector is slower on two threads."""
    with one_thread():
        yield


@pytest.mark.parametrize("size", [(640, 480), (500, 480), (1300, 1000)])
def test_a_board_is_found_at_any_size_and_laid_where_the_control_has_it(size: tuple[int, int]) -> None:
    image, true = picture(*size)
    found = board_corners(image, PAGE.squares, VIEW.size)
    assert np.abs(found - true).max() < 0.1 * max(1.0, size[0] / 640)
    control, wanted = picture(*VIEW.size)
    placed = Placed.onto(VIEW, image, found, wanted)
    assert np.abs(placed.to_view.apply(true) - wanted).max() < 0.05
    assert np.abs(placed.to_own.apply(placed.to_view.apply(true)) - true).max() < 1e-9
    assert placed.image.shape == control.shape
    inside = np.s_[20:-20, 20:-20]
    assert np.corrcoef(placed.image[inside].ravel(), control[inside].ravel())[0, 1] > 0.97


def test_a_board_upside_down_keeps_its_corners_names() -> None:
    image, true = picture(640, 480)
    found = board_corners(image[::-1, ::-1], PAGE.squares, VIEW.size)
    assert np.abs((639, 479) - found - true).max() < 0.1


def test_a_picture_without_a_board_and_a_mirrored_one_are_errors() -> None:
    image, true = picture(320, 240)
    with pytest.raises(StepError, match="no whole board of 20 x 15 inner corners"):
        board_corners(np.full_like(image, 200), PAGE.squares, VIEW.size)
    with pytest.raises(StepError, match="mirrored"):
        Placed.onto(VIEW, image, true * (-1.0, 1.0), true)


def test_beyond_the_picture_nothing_is_shown() -> None:
    image, true = picture(640, 480)
    placed = Placed.onto(VIEW, np.full_like(image, 200), true, true / 2)
    assert (placed.image[:239, :319] == 200).all()
    assert (placed.image[242:] == 0).all()
    assert (placed.image[:, 322:] == 0).all()

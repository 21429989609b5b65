from __future__ import annotations

import numpy as np
import pytest

from deskew.errors import StepError
from deskew.projection import onto_bed, pixel_grid
from deskew.restoration import dots_per_inch, pixels_per_unit
from deskew.types import DepthMap, Pinhole, Scan, Sheet

DOWN = np.diag([1.0, -1.0, -1.0])


def camera(fx: float = 900.0, fy: float = 900.0, R: np.ndarray = DOWN) -> Pinhole:
    K = np.array([[fx, 0.0, 79.5], [0.0, fy, 59.5], [0.0, 0.0, 1.0]])
    return Pinhole((160, 120), K, np.zeros(5), R, -R @ np.array([0.0, 0.0, 600.0]))


def test_straight_from_above_it_is_the_focal_length_over_the_height() -> None:
    page = np.zeros((120, 160), bool)
    page[20:100, 30:130] = True
    assert pixels_per_unit(camera(), page) == pytest.approx((1.5, 1.5))
    assert pixels_per_unit(camera(900.0, 600.0), page) == pytest.approx((1.5, 1.0))


def test_a_page_turned_in_the_picture_keeps_it() -> None:
    turn = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    assert pixels_per_unit(camera(R=DOWN @ turn), np.ones((120, 160), bool)) == pytest.approx((1.5, 1.5))


def test_a_leaning_camera_has_the_mean_of_its_near_and_far_side() -> None:
    c, s = np.cos(0.3), np.sin(0.3)
    leaning = camera(R=np.array([[1.0, 0, 0], [0, c, -s], [0, s, c]]) @ DOWN)
    page = np.zeros((120, 160), bool)
    page[:, 20:140] = True
    places = onto_bed(leaning, pixel_grid((160, 120)))
    across = 1 / np.linalg.norm(np.diff(places, axis=1), axis=-1)
    x, _ = pixels_per_unit(leaning, page)
    assert across.min() < x < across.max()
    assert across.max() / across.min() > 1.03


@pytest.mark.parametrize("page", [np.zeros((120, 160), bool), np.eye(120, 160, dtype=bool)], ids=["none", "a line"])
def test_hardly_any_page_has_no_resolution(page: np.ndarray) -> None:
    with pytest.raises(StepError, match="The resolution cannot be told"):
        pixels_per_unit(camera(), page)


@pytest.mark.parametrize(("unit", "wanted"), [("mm", 25.4 * 1.5), ("cm", 2.54 * 1.5), ("in", 1.5), ("units", None)])
def test_dots_per_inch_follow_the_unit(unit: str, wanted: float | None) -> None:
    depth = DepthMap(np.full((120, 160), 600.0), np.zeros((120, 160), np.uint8), camera())
    sheet = Sheet(np.dstack([*np.meshgrid([0.0, 9.0], [9.0, 0.0]), np.zeros((2, 2))]))
    scan = Scan({}, depth, camera(), sheet, np.zeros((4, 2)), unit=unit)
    found = dots_per_inch(scan, camera(), np.zeros((120, 160, 2), np.float32))
    assert found == (None if wanted is None else pytest.approx((wanted, wanted)))

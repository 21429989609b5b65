"""What a movement covers, held against its area and against what it must not reach."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from deskew.editor.strokes import Stroke, Tool
from deskew.errors import InputError

EMPTY = np.zeros((200, 300), np.uint8)
PLACES = st.tuples(st.floats(-1e5, 1e5), st.floats(-1e5, 1e5))


def stroke(tool: Tool, *points: tuple[float, float], **settings: float) -> Stroke:
    return Stroke(tool, np.array(points, float), **settings)


def test_a_dab_of_the_brush_is_a_disc() -> None:
    covered = stroke(Tool.BRUSH, (150, 100), width=60).covered(EMPTY)
    assert covered.sum() == pytest.approx(math.pi * 30**2, rel=0.04)
    y, x = np.nonzero(covered)
    assert (x.mean(), y.mean()) == pytest.approx((150, 100), abs=0.01)


def test_a_path_of_the_brush_has_its_width_and_round_ends() -> None:
    covered = stroke(Tool.BRUSH, (60, 100), (240, 100), width=40).covered(EMPTY)
    assert covered.sum() == pytest.approx(180 * 40 + math.pi * 20**2, rel=0.04)
    assert covered[:, 150].sum() == pytest.approx(40, abs=1)


def test_a_rectangle_holds_both_its_corners_whichever_comes_first() -> None:
    covered = stroke(Tool.RECTANGLE, (20, 90), (10, 50)).covered(EMPTY)
    assert covered.sum() == 11 * 41
    assert covered[50:91, 10:21].all()


def test_a_polygon_has_its_area_and_its_border() -> None:
    covered = stroke(Tool.POLYGON, (20, 20), (220, 20), (20, 170)).covered(EMPTY)
    assert covered.sum() == pytest.approx(200 * 150 / 2 + (200 + 150 + 250) / 2, rel=0.005)


def page() -> np.ndarray:
    """A dark leaf, with words and an initial on it, in a light sleeve on a black desk."""
    picture = np.zeros((400, 600), np.uint8)
    picture[20:380, 20:580] = 200
    picture[100:300, 150:450] = 120
    picture[120:280:8, 170:430] = 40
    picture[150:180, 180:215] = 60
    return picture


def test_a_region_of_similar_colour_is_the_leaf_with_all_that_is_written_on_it() -> None:
    leaf = np.zeros((400, 600), bool)
    leaf[100:300, 150:450] = True
    covered = stroke(Tool.SIMILAR, (440, 110), tolerance=20).covered(page())
    assert (covered & leaf).sum() > 0.998 * leaf.sum()
    assert not (covered & ~leaf).any()


def test_a_large_photograph_is_flooded_where_a_small_one_is() -> None:
    large = np.kron(page(), np.ones((5, 5), np.uint8))
    small = stroke(Tool.SIMILAR, (440, 110), tolerance=20).covered(page())
    covered = stroke(Tool.SIMILAR, (440 * 5 + 2, 110 * 5 + 2), tolerance=20).covered(large)
    assert (covered != np.kron(small, np.ones((5, 5), bool))).mean() < 0.002


def test_a_sleeve_does_not_swallow_the_leaf_within_it() -> None:
    covered = stroke(Tool.SIMILAR, (50, 50), tolerance=20).covered(page())
    assert covered[30:90, 30:570].all()
    assert not covered[110:290, 160:440].any()
    assert not covered[:15].any()


def test_colour_tells_apart_what_is_equally_bright() -> None:
    picture = np.full((100, 200, 3), (120, 140, 100), np.uint8)
    picture[:, 100:] = (160, 100, 100)
    covered = stroke(Tool.SIMILAR, (30, 50), tolerance=15).covered(picture)
    assert covered[:, :98].all()
    assert not covered[:, 102:].any()


@given(tool=st.sampled_from(list(Tool)), points=st.lists(PLACES, min_size=3, max_size=6), width=st.floats(1, 4096))
def test_a_movement_beyond_the_photograph_covers_what_lies_on_it_or_is_refused(tool, points, width) -> None:
    moved = stroke(tool, *points, width=width, tolerance=10)
    x, y = points[0]
    if tool is Tool.SIMILAR and not (0 <= round(x) < 300 and 0 <= round(y) < 200):
        with pytest.raises(InputError, match="`points` must lie on the photograph of 300x200 px"):
            moved.covered(EMPTY)
    else:
        covered = moved.covered(EMPTY)
        assert (covered.shape, covered.dtype) == ((200, 300), np.bool_)


@pytest.mark.parametrize(
    ("tool", "points", "settings", "message"),
    [
        (Tool.POLYGON, [[1, 1], [2, 2]], {}, "`points` must be 3 to 20000 places"),
        (Tool.BRUSH, [[np.nan, 1]], {}, "`points` must lie within 100000 px, got NaN"),
        (Tool.BRUSH, [[2e5, 1]], {}, "`points` must lie within 100000 px, got farther ones"),
        (Tool.BRUSH, [[1, 1]], {"width": 0.0}, r"`width` must be in \[1, 4096\]"),
        (Tool.BRUSH, [[1, 1]], {"tolerance": math.nan}, r"`tolerance` must be in \[0, 255\]"),
        ("spray", [[1, 1]], {}, "`tool` must be one of brush, rectangle, polygon, similar, got 'spray'"),
    ],
)
def test_what_is_no_movement_is_refused(tool, points, settings, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Stroke(tool, np.array(points, float), **settings)

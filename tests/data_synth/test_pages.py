from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import data_synth as ds
from data_synth.pages import INK_ALBEDO, PAPER_ALBEDO, board_page, coverage
from deskew.errors import InputError
from deskew.types import Board

PAGE = ds.Checkerboard()


def sharp(u: float, v: float) -> float:
    """The print without anti-aliasing, from its definition."""
    column, row = np.floor((u - 3.0) / 13.0), np.floor((v - 4.0) / 13.0)
    printed = 0 <= column < 21 and 0 <= row < 16
    return INK_ALBEDO if printed and (column + row) % 2 == 0 else PAPER_ALBEDO


@given(
    u=st.floats(1.0, 278.0),
    v=st.floats(1.0, 215.0),
    du=st.floats(0.05, 1.9),
    dv=st.floats(0.05, 1.9),
)
@settings(deadline=None, max_examples=150)
def test_albedo_is_the_mean_over_the_footprint(u: float, v: float, du: float, dv: float) -> None:
    n = 60
    offsets = (np.arange(n) + 0.5) / n - 0.5
    brute = np.mean([sharp(u + a * du, v + b * dv) for a in offsets for b in offsets])
    exact = PAGE.albedo(np.array([u]), np.array([v]), np.array([du]), np.array([dv]))[0]
    # A midpoint grid misplaces at most one row and one column of its cells.
    assert exact == pytest.approx(brute, abs=2.1 * (PAPER_ALBEDO - INK_ALBEDO) / n)


def test_a_vanishing_footprint_shows_the_sharp_print() -> None:
    rng = np.random.default_rng(0)
    u, v = rng.uniform(0, 279, 500), rng.uniform(0, 216, 500)
    zero = np.zeros(500)
    assert np.allclose(PAGE.albedo(u, v, zero, zero), [sharp(a, b) for a, b in zip(u, v, strict=True)], atol=1e-3)


def test_corners_are_the_points_where_four_squares_meet() -> None:
    corners = PAGE.corners
    assert corners.shape == (15, 20, 2)
    assert corners[0, 0].tolist() == [16.0, 17.0]
    assert corners[-1, -1].tolist() == [263.0, 199.0]
    for signs, top_left in (((-1, -1), 0), ((1, -1), 1), ((-1, 1), 1), ((1, 1), 0)):
        point = corners[0, 0] + 2.0 * np.array(signs)
        assert sharp(*point) == (INK_ALBEDO, PAPER_ALBEDO)[top_left]
    grey = PAGE.albedo(corners[..., 0].ravel(), corners[..., 1].ravel(), np.full(300, 2.0), np.full(300, 2.0))
    assert np.allclose(grey, (INK_ALBEDO + PAPER_ALBEDO) / 2)


def test_a_blank_page_is_paper_everywhere() -> None:
    assert (ds.Blank().albedo(*np.ones((4, 7))) == PAPER_ALBEDO).all()


def test_coverage_is_the_share_of_the_footprint_on_the_page() -> None:
    u, v = np.array([0.0, -0.3, 279.25, 100.0, 279.0]), np.array([50.0, 50.0, 50.0, -9.0, 216.0])
    side = np.ones(5)
    assert np.allclose(coverage((279.0, 216.0), u, v, side, side), [0.5, 0.2, 0.25, 0.0, 0.25])


def test_a_board_has_one_square_more_than_corners_each_way() -> None:
    page = board_page(Board((5, 4), 10.0), margin_mm=3.0)
    assert page.squares == (6, 5)
    assert page.page_size_mm == (66.0, 56.0)
    assert page.corners.mean(axis=(0, 1)).tolist() == [33.0, 28.0]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: ds.Checkerboard(squares=(1, 5)), r"`squares` must be \(nx, ny\) of at least 2, got \(1, 5\)\."),
        (lambda: ds.Checkerboard(square_mm=-1.0), r"`square_mm` must be positive, got -1\.0\."),
        (lambda: ds.Checkerboard(square_mm=14.0), r"`squares` must leave a margin on a page of \(279\.0, 216\.0\) mm"),
        (lambda: board_page(ds.BOARD, 0.0), r"`margin_mm` must be positive, got 0\.0\."),
    ],
)
def test_bad_arguments_are_named(call: object, message: str) -> None:
    assert callable(call)
    with pytest.raises(InputError, match=message):
        call()

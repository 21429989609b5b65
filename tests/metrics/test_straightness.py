"""Lines of text that are straight, bent by a known sagitta, or turned."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from deskew.metrics import line_straightness, shifted
from deskew.types import Array
from tests.metrics.printed_pages import HEIGHT, MARGIN, WIDTH, Warp, printed_page, still, warped

N_LINES = 15


@pytest.fixture(scope="module")
def page() -> Array:
    return printed_page()


def test_straight_lines_are_straight(page: Array) -> None:
    figures = line_straightness(page)
    assert figures["text_lines"] == N_LINES
    assert 0.0 <= figures["line_straightness_px"] < 0.2
    assert 0.0 <= figures["line_spread_deg"] < 0.05


@pytest.mark.parametrize("sagitta", [2.0, 5.0, 12.0])
def test_a_parabola_bends_by_its_sagitta(page: Array, sagitta: float) -> None:
    """Root mean square of a parabola about its best line: sqrt(4 / 45) of the sagitta over the line's own length."""
    half = WIDTH / 2 - MARGIN
    down: Warp = lambda x, y: sagitta * ((x - WIDTH / 2) / half) ** 2  # noqa: E731
    figures = line_straightness(warped(page, still, down))
    assert figures["text_lines"] == N_LINES
    assert figures["line_straightness_px"] == pytest.approx(sagitta * np.sqrt(4 / 45), rel=0.15)


def test_lines_that_diverge_are_spread_and_straight(page: Array) -> None:
    """A fan of slopes even in [-.02, .02]."""
    down: Warp = lambda x, y: 0.04 * (y / HEIGHT - 0.5) * (x - WIDTH / 2)  # noqa: E731
    figures = line_straightness(warped(page, still, down))
    places = 60 + 40.0 * np.arange(N_LINES)
    assert figures["line_spread_deg"] == pytest.approx(np.degrees(np.std(0.04 * places / HEIGHT)), rel=0.1)
    assert figures["line_straightness_px"] < 0.4


@settings(max_examples=6, deadline=None)
@given(st.floats(-3.0, 3.0), st.integers(-15, 15), st.integers(-15, 15))
def test_a_page_turned_or_moved_as_a_whole_is_as_straight(angle: float, dx: int, dy: int) -> None:
    slope = np.tan(np.radians(angle))
    down: Warp = lambda x, y: slope * (x - WIDTH / 2)  # noqa: E731
    page = shifted(printed_page()[:, 30:], dx, dy)
    figures = line_straightness(warped(page, still, down))
    assert figures["text_lines"] >= N_LINES - 2  # the uppermost and the lowest may leave the picture
    assert figures["line_straightness_px"] < 0.35
    assert figures["line_spread_deg"] < 0.1


def test_light_does_not_matter(page: Array) -> None:
    x = np.linspace(0.4, 1.0, WIDTH)[None, :]
    figures = line_straightness(np.rint(page * x).astype(np.uint8))
    assert figures["text_lines"] == N_LINES
    assert figures["line_straightness_px"] < 0.25


def test_hanging_letters_and_points_are_no_bend() -> None:
    """Tails below the line on every fifth letter, and specks above it."""
    page = printed_page()
    straight = line_straightness(page)["line_straightness_px"]
    for x in range(100, WIDTH - 200, 110):
        page[60:67, x : x + 4] = 30
    assert line_straightness(page)["line_straightness_px"] < straight + 0.1


@pytest.mark.parametrize("level", [0, 235])
def test_a_page_without_text_has_no_lines(level: int) -> None:
    assert line_straightness(np.full((100, 200), level, np.uint8)) == {"text_lines": 0.0}
    rng = np.random.default_rng(3)
    noise = np.clip(rng.normal(200, 2, (200, 300)), 0, 255).astype(np.uint8)
    assert line_straightness(noise) == {"text_lines": 0.0}

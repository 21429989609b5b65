"""Pages without a scale: similar figures see all that is wrong with a page but its size, place and turn."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from deskew import metrics
from deskew.errors import StepError
from deskew.types import Dewarped, Floats, Pinhole

DOWN = np.array([1.0, -1.0])
# Straight above the bed, half a millimetre a pixel.
CAMERA = Pinhole(
    (200, 160),
    np.array([[1600.0, 0.0, 99.5], [0.0, 1600.0, 79.5], [0.0, 0.0, 1.0]]),
    np.zeros(5),
    np.diag([1.0, -1.0, -1.0]),
    np.array([0.0, 0.0, 800.0]),
)
GRID = np.stack(np.meshgrid(np.linspace(20, 180, 9), np.linspace(20, 140, 7)), axis=-1).reshape(-1, 2)


def turned(points: Floats, scale: float, angle: float) -> Floats:
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(scale * points @ np.array([[c, s], [-s, c]]) + (7.0, -3.0))


@settings(deadline=None)
@given(scale=st.floats(0.1, 10.0), angle=st.floats(-np.pi, np.pi))
def test_size_place_and_turn_of_a_picture_do_not_matter(scale: float, angle: float) -> None:
    figures = metrics.similar_corner_distance(turned(GRID, scale, angle), GRID, CAMERA)
    assert figures["corner_similar_max_mm"] < 1e-9


@settings(deadline=None)
@given(scale=st.floats(0.1, 10.0), angle=st.floats(-np.pi, np.pi), seed=st.integers(0, 99))
def test_a_similar_fit_is_the_best_of_its_kind(scale: float, angle: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    target = GRID + rng.normal(0, 2.0, GRID.shape)

    def error(matrix: Floats, offset: Floats) -> float:
        return float(((GRID @ matrix.T + offset - target) ** 2).sum())

    fit = metrics.fit_similar(GRID, target)
    best = error(fit.matrix, fit.offset)
    assert np.allclose(fit.matrix @ fit.matrix.T, np.linalg.det(fit.matrix) * np.eye(2))
    c, s = scale * np.cos(angle), scale * np.sin(angle)
    for step in (1e-3, 1.0):
        other = fit.matrix + step * np.array([[c, -s], [s, c]])
        assert error(other, fit.offset) > best
        assert error(fit.matrix, fit.offset + step) > best


def test_a_wrong_aspect_shows_in_millimetres() -> None:
    # 1 % between the sides: half of it to each after the fit, and half a millimetre a pixel.
    figures = metrics.similar_corner_distance(GRID * (1.005, 0.995), GRID, CAMERA)
    far = 0.5 * 0.005 * np.hypot(80.0, 60.0)
    assert figures["corner_similar_max_mm"] == pytest.approx(far, rel=0.35)
    assert 0.0 < figures["corner_similar_mean_mm"] < figures["corner_similar_max_mm"]


def page(**change: Any) -> tuple[Dewarped, Floats]:
    """A picture of 60 x 48 mm at 2 px/mm with its map, and the truth at each of its pixels."""
    y, x = np.mgrid[0:100, 0:124].astype(np.float64)
    uv = np.stack([(x - 2.0) / 2, (y - 2.0) / 2], axis=-1)
    uv[((uv < 0) | (uv > (60.0, 48.0))).any(axis=-1)] = np.nan
    image = np.zeros((100, 124), np.uint8)
    return Dewarped(image, np.stack([x, y], axis=-1).astype(np.float32)), uv


def test_every_pixel_counts_where_a_picture_says_what_it_shows() -> None:
    dewarped, uv = page()
    figures = metrics.similar_dense_error(dewarped, uv, (60.0, 48.0))
    assert figures["dense_similar_max_mm"] < 1e-9
    assert figures["page_coverage"] == pytest.approx(1.0, abs=0.01)
    bent = uv + 0.5 * np.sin(uv[..., :1] / 60.0 * 2 * np.pi) * (0.0, 1.0)
    assert 0.1 < metrics.similar_dense_error(dewarped, bent, (60.0, 48.0))["dense_similar_mean_mm"] < 0.5
    half = Dewarped(dewarped.image, np.where(np.arange(124)[:, None] < 62, dewarped.backward_map, np.nan))
    assert metrics.similar_dense_error(half, uv, (60.0, 48.0))["page_coverage"] == pytest.approx(0.5, abs=0.01)


def test_a_mirrored_page_and_one_that_shows_nothing_are_errors() -> None:
    with pytest.raises(StepError, match="mirrored"):
        metrics.similar_corner_distance(GRID * (-1.0, 1.0), GRID, CAMERA)
    few = np.full_like(GRID, np.nan)
    few[:5] = GRID[:5]
    with pytest.raises(StepError, match="5 corners found in both images"):
        metrics.similar_corner_distance(few, GRID, CAMERA)
    dewarped, uv = page()
    with pytest.raises(StepError, match="mirrored"):
        metrics.similar_dense_error(dewarped, uv[:, ::-1], (60.0, 48.0))
    with pytest.raises(StepError, match="0 pixels show the page"):
        metrics.similar_dense_error(dewarped, uv * np.nan, (60.0, 48.0))
    with pytest.raises(StepError, match="no backward map"):
        metrics.similar_dense_error(Dewarped(dewarped.image), uv, (60.0, 48.0))

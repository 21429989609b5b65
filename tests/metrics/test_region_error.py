"""Figures by region against pages whose change is known in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from deskew.errors import InputError, StepError
from deskew.metrics import dense_error, region_error
from tests.metrics.test_dense_error import PAGE, off_page, on_page, page_places, restoration

# A leaf in the middle half of the page's width, from top to bottom.
LEAF = (PAGE[0] / 4, 3 * PAGE[0] / 4)


def in_leaf(uv: np.ndarray) -> np.ndarray:
    return np.asarray((uv[..., 0] > LEAF[0]) & (uv[..., 0] < LEAF[1]))


def grown_leaf(uv: np.ndarray, share: float) -> np.ndarray:
    """True places of a page that shows its leaf `share` too wide: what it shows there belongs nearer to the middle."""
    truth = on_page(uv)
    middle = PAGE[0] / 2
    truth[..., 0] = np.where(in_leaf(uv), middle + (uv[..., 0] - middle) * (1 - share), truth[..., 0])
    return truth


def test_page_without_change_is_without_error_whatever_is_said_to_have_changed() -> None:
    uv = page_places(0.1, (2.0, -1.0))
    figures = region_error(restoration(), on_page(uv), in_leaf(uv))
    assert max(figures.values()) < 1e-9
    assert set(figures) == {"kept_mean_mm", "kept_p95_mm", "changed_mean_mm", "changed_p95_mm", "dense_affine_mean_mm"}


@settings(max_examples=10, deadline=None)
@given(st.floats(-0.3, 0.3), st.floats(-5, 5), st.floats(-5, 5), st.floats(0.005, 0.05))
def test_change_of_a_region_shows_there_alone(angle: float, dx: float, dy: float, share: float) -> None:
    straight = page_places()
    uv = page_places(angle, (dx, dy))
    figures = region_error(restoration(), grown_leaf(uv, share), ~in_leaf(uv))
    assert figures["kept_p95_mm"] < 1e-9
    # A leaf w wide, s too wide: distances spread evenly from 0 to s w / 2.
    most = share * (LEAF[1] - LEAF[0]) / 2
    assert figures["changed_mean_mm"] == pytest.approx(most / 2, rel=0.05)
    assert figures["changed_p95_mm"] == pytest.approx(0.95 * most, rel=0.05)
    still = region_error(restoration(), grown_leaf(straight, share), ~in_leaf(straight))
    assert figures["changed_mean_mm"] == pytest.approx(still["changed_mean_mm"], rel=0.05)


def test_rigid_fit_over_all_blames_what_kept_its_size_too() -> None:
    uv = page_places()
    truth = on_page(uv)
    leaf = uv[..., 0] > PAGE[0] / 2
    truth[..., 0] = np.where(leaf & ~off_page(uv), truth[..., 0] + 0.5, truth[..., 0])
    truth[(truth > np.array(PAGE)).any(axis=-1)] = np.nan
    figures = region_error(restoration(), truth, ~leaf)
    assert figures["kept_mean_mm"] < 1e-9
    assert figures["changed_mean_mm"] == pytest.approx(0.5, rel=1e-6)
    assert dense_error(restoration(), truth, PAGE)["dense_mean_mm"] == pytest.approx(0.25, rel=0.02)


def test_affine_alignment_hides_a_wrong_size() -> None:
    uv = page_places(scale=1.02)
    everywhere = np.ones(uv.shape[:2], dtype=bool)
    figures = region_error(restoration(), on_page(uv), everywhere)
    assert figures["dense_affine_mean_mm"] < 1e-9
    assert figures["kept_mean_mm"] > 0.5
    assert "changed_mean_mm" not in figures


def test_wrong_input_and_a_lost_region_are_clear_errors() -> None:
    uv = page_places()
    nowhere = np.zeros(uv.shape[:2], dtype=bool)
    with pytest.raises(StepError, match="Region error: 0 restored pixels show what kept its size, at least 100"):
        region_error(restoration(), on_page(uv), nowhere)
    with pytest.raises(InputError, match=r"`kept` must be bool of shape \(240, 320\)"):
        region_error(restoration(), on_page(uv), nowhere[1:])
    with pytest.raises(StepError, match="Region error: the restored page is mirrored"):
        region_error(restoration(), on_page(np.stack([PAGE[0] - uv[..., 0], uv[..., 1]], axis=-1)), ~nowhere)

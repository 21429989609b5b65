from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import data_synth as ds
from data_synth.pages import PAPER_ALBEDO
from deskew.types import Floats

WIDTH, HEIGHT = ds.PAGE_SIZE_MM


@pytest.fixture(scope="module")
def page() -> ds.VellumPage:
    return ds.VellumPage(3)


def means(page: ds.VellumPage, side_mm: float) -> tuple[Floats, Floats]:
    """Albedo in squares that cover the page, and the depth of their middles in the leaf."""
    n, m = round(HEIGHT / side_mm), round(WIDTH / side_mm)
    u, v = np.meshgrid((np.arange(m) + 0.5) * WIDTH / m, (np.arange(n) + 0.5) * HEIGHT / n)
    du, dv = np.full(u.size, WIDTH / m), np.full(u.size, HEIGHT / n)
    return page.albedo(u.ravel(), v.ravel(), du, dv).reshape(n, m), page.leaf.depth(u, v)


def test_the_vellum_is_darker_than_the_sleeve_and_mottled(page: ds.VellumPage) -> None:
    albedo, depth = means(page, 1.0)
    sleeve, margin = albedo[depth < -2], albedo[(depth > 2) & (depth < 14)]
    assert np.abs(sleeve - PAPER_ALBEDO).max() < 3e-3
    assert 0.5 < np.median(margin) < 0.66
    assert 0.01 < np.std(margin) < 0.06
    assert np.percentile(margin, 97) < PAPER_ALBEDO - 0.15  # the tendril hangs in the margin


def test_the_text_is_dark_and_the_initial_stands_out(page: ds.VellumPage) -> None:
    albedo, depth = means(page, 0.5)
    written = albedo[depth > 20]
    assert 0.05 < (written < 0.3).mean() < 0.2
    # A square of 45 mm in 170 x 215 mm, with gold and white lead lighter than any vellum.
    assert 0.01 < (written > 0.72).mean() < 0.06


@given(
    u=st.floats(5.0, 274.0),
    v=st.floats(5.0, 211.0),
    du=st.floats(0.2, 9.0),
    dv=st.floats(0.2, 9.0),
    n=st.integers(2, 5),
)
@settings(deadline=None, max_examples=60)
def test_a_footprint_reflects_what_its_parts_reflect(
    page: ds.VellumPage, u: float, v: float, du: float, dv: float, n: int
) -> None:
    parts = (np.arange(n) + 0.5) / n - 0.5
    a, b = (x.ravel() for x in np.meshgrid(u + parts * du, v + parts * dv))
    mean = page.albedo(a, b, np.full(n * n, du / n), np.full(n * n, dv / n)).mean()
    whole = page.albedo(*(np.array([x]) for x in (u, v, du, dv)))
    assert whole[0] == pytest.approx(mean, abs=1e-9)


def test_footprints_over_the_border_show_what_of_them_is_on_the_page(page: ds.VellumPage) -> None:
    u, v = np.array([0.0, WIDTH, -1.0, WIDTH + 2.0]), np.array([0.0, HEIGHT, 50.0, HEIGHT + 2.0])
    assert np.abs(page.albedo(u, v, np.full(4, 0.5), np.full(4, 0.5)) - PAPER_ALBEDO).max() < 3e-3


def test_every_seed_has_its_own_text_and_skin_and_always_the_same(page: ds.VellumPage) -> None:
    assert np.array_equal(ds.VellumPage(3).integral, page.integral)
    here, depth = means(page, 0.5)
    there, _ = means(ds.VellumPage(4), 0.5)
    assert (np.abs(there - here)[depth > 20] > 0.2).mean() > 0.1
    assert np.corrcoef(here[(depth > 2) & (depth < 14)], there[(depth > 2) & (depth < 14)])[0, 1] < 0.8

"""Leaves in sleeves, drawn with a known border: text, an initial, uneven light and noise must not move it."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from deskew.acquisition import page_leaf
from deskew.errors import InputError, StepError
from deskew.types import Array

SHAPE = (288, 384)
Y, X = np.mgrid[: SHAPE[0], : SHAPE[1]].astype(np.float64)
PAGE = (X > 20) & (X < 364) & (Y > 15) & (Y < 273)


def inside(left: int = 70, top: int = 60, right: int = 310, bottom: int = 230) -> Array:
    return (left <= X) & (right > X) & (top <= Y) & (bottom > Y)


def photograph(leaf: Array, vellum: float = 0.6, paper: float = 0.85, written: bool = True) -> Array:
    """A desk, a page and a leaf with lines of text and a large initial: reflectances."""
    picture = np.where(PAGE, np.where(leaf, vellum, paper), 0.03)
    if written:
        for line in range(80, 215, 9):
            for word in range(85, 290, 16):
                picture[line : line + 4, word : word + 12 : 3] = 0.1
        picture[80:125, 85:120] = 0.15
    return cv2.GaussianBlur(picture, (0, 0), 0.8)


def exposed(reflectance: Array, seed: int = 3) -> Array:
    grey = 235 * reflectance + 4 + np.random.default_rng(seed).normal(0, 1.5, SHAPE)
    return np.clip(np.rint(grey), 0, 255).astype(np.uint8)


def wrong(found: Array, leaf: Array) -> float:
    """Share of the page that was taken for the other material."""
    return float((found != leaf)[PAGE].mean())


def test_written_leaf_is_found_to_its_border() -> None:
    found = page_leaf(exposed(photograph(inside())), PAGE)
    assert 0 < wrong(found, inside()) < 0.005
    assert not found[~PAGE].any()
    assert cv2.connectedComponents(found.astype(np.uint8))[0] == 2


@settings(max_examples=10, deadline=None)
@given(
    left=st.integers(30, 90),
    top=st.integers(25, 70),
    right=st.integers(300, 352),
    bottom=st.integers(220, 262),
    vellum=st.floats(0.45, 0.7),
    tilt=st.floats(-0.05, 0.05),
)
def test_leaf_is_found_wherever_it_lies_in_somewhat_uneven_light(
    left: int, top: int, right: int, bottom: int, vellum: float, tilt: float
) -> None:
    leaf = inside(left, top, right, bottom)
    picture = photograph(leaf, vellum) * (1 + tilt * (X / SHAPE[1] - 0.5) + tilt * (Y / SHAPE[0] - 0.5))
    assert wrong(page_leaf(exposed(picture), PAGE), leaf) < 0.01


def test_colour_and_depth_do_not_matter() -> None:
    grey = exposed(photograph(inside()))
    plain = page_leaf(grey, PAGE)
    assert np.array_equal(page_leaf(np.stack([grey] * 3, axis=-1), PAGE), plain)
    assert np.array_equal(page_leaf(grey.astype(np.uint16) * 256, PAGE), plain)


@pytest.mark.parametrize(
    ("picture", "what"),
    [
        (photograph(inside(), written=False, vellum=0.85), "a blank page"),
        (photograph(inside(), vellum=0.82), "materials hardly apart"),
        (photograph(inside(70, 60, 84, 74), written=False), "a stain"),
    ],
)
def test_page_of_one_material_is_told_so(picture: Array, what: str) -> None:
    with pytest.raises(StepError, match="Materials: the page does not show two of them"):
        page_leaf(exposed(picture), PAGE)


def test_wrong_input_is_refused() -> None:
    grey = exposed(photograph(inside()))
    with pytest.raises(InputError, match=r"`page` must be bool of shape \(288, 384\)"):
        page_leaf(grey, PAGE[1:])
    with pytest.raises(InputError, match=r"`page` must be bool"):
        page_leaf(grey, PAGE.astype(np.uint8))
    with pytest.raises(InputError, match="`page` must show a page, got no pixel"):
        page_leaf(grey, np.zeros(SHAPE, dtype=bool))

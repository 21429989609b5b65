from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from data_synth import Leaf
from deskew.errors import InputError


@pytest.mark.parametrize(("share", "corner_mm"), [(0.6, 5.0), (0.4, 30.0), (0.8, 0.0)])
def test_the_leaf_covers_its_share_of_the_page(share: float, corner_mm: float) -> None:
    leaf = Leaf(share=share, corner_mm=corner_mm)
    u, v = np.meshgrid(*((np.arange(n) + 0.5) / n * extent for n, extent in zip((900, 700), (279, 216), strict=True)))
    assert leaf.holds(u, v).mean() == pytest.approx(share, abs=2e-3)


@given(u=st.floats(0, 279), v=st.floats(0, 216), angle=st.floats(0, 6.28), step=st.floats(0, 20))
def test_depth_is_a_distance(u: float, v: float, angle: float, step: float) -> None:
    leaf = Leaf()
    moved = leaf.depth(np.array(u + step * np.cos(angle)), np.array(v + step * np.sin(angle)))
    assert abs(float(moved) - float(leaf.depth(np.array(u), np.array(v)))) <= step + 1e-9


def test_depth_at_known_points() -> None:
    leaf = Leaf((200.0, 100.0), share=0.25, corner_mm=0.0)
    u, v = np.array([100.0, 52.0, 50.0, 47.0, 46.0]), np.array([50.0, 50.0, 40.0, 50.0, 22.0])
    assert np.allclose(leaf.depth(u, v), [25.0, 2.0, 0.0, -3.0, -5.0])
    round_ = Leaf(corner_mm=5.0)
    width, height = round_.size_mm
    corner = np.array([(279 - width) / 2 + 5]), np.array([(216 - height) / 2 + 5])
    assert round_.depth(*corner)[0] == pytest.approx(5.0)


def test_leaves_out_of_range_are_named() -> None:
    with pytest.raises(InputError, match=r"`share` must be in \[0.1, 0.9\], got 1.2"):
        Leaf(share=1.2)
    with pytest.raises(InputError, match="`corner_mm` must be"):
        Leaf(corner_mm=60.0)

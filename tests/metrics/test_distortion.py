"""Local, aligned and line distortion on warps whose every displacement is known."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from deskew.errors import InputError
from deskew.metrics import flow_distortion, shifted
from deskew.metrics.distortion import dis_flow
from deskew.types import Array, Floats
from tests.metrics.printed_pages import HEIGHT, WIDTH, Warp, printed_page, still, warped


@pytest.fixture(scope="module")
def page() -> Array:
    return printed_page()


def waves(amplitude: float) -> tuple[Warp, Warp]:
    """A smooth warp of the page, one wave either way."""

    def along(x: Floats, y: Floats) -> Floats:
        return np.asarray(amplitude * np.sin(2 * np.pi * y / HEIGHT) * np.cos(np.pi * x / WIDTH))

    def down(x: Floats, y: Floats) -> Floats:
        return np.asarray(amplitude * np.cos(2 * np.pi * x / WIDTH) * np.sin(np.pi * y / HEIGHT))

    return along, down


def mean_displacement(along: Warp, down: Warp) -> float:
    """Mean over the scan of how far its pixels lie off in the warped picture."""
    x, y = np.meshgrid(np.arange(float(WIDTH)), np.arange(float(HEIGHT)))
    dx, dy = 0 * x, 0 * y
    for _ in range(20):
        dx, dy = along(x + dx, y + dy), down(x + dx, y + dy)
    return float(np.hypot(dx, dy).mean())


def test_equal_pictures_are_not_distorted(page: Array) -> None:
    assert flow_distortion(page, page) == pytest.approx({"ld_dis_px": 0.0, "ad_dis": 0.0, "lid_dis_px": 0.0}, abs=5e-3)


@pytest.mark.parametrize(("dx", "dy"), [(2, 0), (0, -2), (6, 8), (0, 40)])
def test_a_shift_is_local_distortion_and_no_aligned_one(page: Array, dx: int, dy: int) -> None:
    """By one pixel of the flow, which is two of the compared pictures': an LD of 1."""
    figures = flow_distortion(shifted(page, dx, dy), page)
    assert figures["ld_dis_px"] == pytest.approx(np.hypot(dx, dy) / 2, rel=0.05)
    assert 0.0 <= figures["ad_dis"] < 0.02
    assert 0.0 <= figures["lid_dis_px"] < 0.1


@pytest.mark.parametrize(("sx", "sy"), [(1.02, 1.02), (0.98, 1.01)])
def test_scale_along_the_axes_is_aligned_away(page: Array, sx: float, sy: float) -> None:
    along: Warp = lambda x, y: (1 - 1 / sx) * (x - WIDTH / 2)  # noqa: E731
    down: Warp = lambda x, y: (1 - 1 / sy) * (y - HEIGHT / 2)  # noqa: E731
    figures = flow_distortion(warped(page, along, down), page)
    assert figures["ld_dis_px"] == pytest.approx(mean_displacement(along, down) / 2, rel=0.15)
    assert 0.0 < figures["ad_dis"] < 0.02


@pytest.mark.parametrize("amplitude", [2.0, 6.0, 16.0])
def test_a_known_warp_has_its_mean_displacement(page: Array, amplitude: float) -> None:
    figures = flow_distortion(warped(page, *waves(amplitude)), page)
    assert figures["ld_dis_px"] == pytest.approx(mean_displacement(*waves(amplitude)) / 2, rel=0.1)
    # Weighted by the gradient over the whole page: a small part of what it moves.
    assert 0.005 * amplitude < figures["ad_dis"] < 0.1 * amplitude


def test_line_distortion_is_the_bend_of_straight_lines(page: Array) -> None:
    """Rows shifted as a whole bend no row; a sine down the columns bends each by its standard deviation."""
    bent: Warp = lambda x, y: 8.0 * np.sin(2 * np.pi * x / WIDTH)  # noqa: E731
    figures = flow_distortion(warped(page, still, bent), page)
    assert figures["lid_dis_px"] == pytest.approx(8.0 / np.sqrt(2) / 2 / 2, rel=0.1)
    sheared: Warp = lambda x, y: 6.0 * (y / HEIGHT - 0.5)  # noqa: E731
    figures = flow_distortion(warped(page, sheared, still), page)
    assert figures["lid_dis_px"] == pytest.approx(6.0 / np.sqrt(12) / 2 / 2, rel=0.2)


def test_lighting_the_page_otherwise_moves_nothing(page: Array) -> None:
    x = np.linspace(0.0, 1.0, WIDTH)[None, :]
    for lit in (0.6 * page, 0.8 * page + 20.0, page * (0.5 + 0.5 * x)):
        figures = flow_distortion(np.rint(lit).astype(np.uint8), page)
        assert figures["ld_dis_px"] < 0.1
        assert figures["ad_dis"] < 0.01
    rng = np.random.default_rng(5)
    noisy = np.clip(page + rng.normal(0.0, 4.0, page.shape), 0, 255).astype(np.uint8)
    assert flow_distortion(noisy, page)["ld_dis_px"] < 0.1


def test_bare_paper_goes_with_the_ink_near_it() -> None:
    """One block of text in a corner of an empty page says where all of it lies."""
    page = np.full((HEIGHT // 2, WIDTH // 2), 235, np.uint8)
    page[100:180, 120:260] = printed_page()[60:140, 60:200]
    flow = dis_flow(page, shifted(page, 3, -2))
    off = np.linalg.norm(flow - [3.0, -2.0], axis=-1)
    assert off[40:80, 80:300].max() < 0.1  # bare, 20 pixels and more from any ink
    assert off[40:240, 80:300].mean() < 0.05


def test_nothing_but_paper_moves_nowhere_and_is_no_scan(page: Array) -> None:
    blank = np.full((HEIGHT, WIDTH), 235, np.uint8)
    assert not dis_flow(blank, page).any()
    with pytest.raises(InputError, match="`scan` must show something, got one grey level throughout"):
        flow_distortion(page, blank)
    assert np.isfinite(flow_distortion(blank, page)["ld_dis_px"])


def test_threads_change_nothing(page: Array) -> None:
    before = cv2.getNumThreads()
    other = warped(page, *waves(6.0))
    try:
        found = []
        for n in (1, 2, 5):
            cv2.setNumThreads(n)
            found.append(flow_distortion(other, page))
    finally:
        cv2.setNumThreads(before)
    assert found[0] == found[1] == found[2]

"""MS-SSIM against the pair with known figures, and against a plain implementation of both formulas."""

from __future__ import annotations

import os
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import convolve1d

from deskew.errors import InputError
from deskew.io import read_image
from deskew.metrics import ms_ssim, shifted
from deskew.metrics.docunet import AREA_PX, compared, resized
from deskew.types import Array, Floats
from tests.metrics.printed_pages import HEIGHT, WIDTH, printed_page

PAIR = Path(os.environ.get("DESKEW_METRIC_PAIR", Path(__file__).parents[3] / "shared/real/docunet_metric_pair"))
WEIGHTS = (0.0448, 0.2856, 0.3001, 0.2363, 0.1333)


@pytest.fixture(scope="module")
def page() -> Array:
    return printed_page()


@pytest.mark.skipif(
    not PAIR.is_dir(), reason="DESKEW_METRIC_PAIR names no folder with DocAligner-Distortion's demo pair 36_2"
)
def test_the_known_pair_has_its_known_figures() -> None:
    figures = ms_ssim(read_image(PAIR / "36_2_dewarpnet.png"), read_image(PAIR / "36_2_target.png"))
    assert figures["ms_ssim_docunet"] == pytest.approx(0.325, abs=0.005)
    assert figures["ms_ssim_wang"] == pytest.approx(0.241, abs=0.005)


def plain_ssim(x: Floats, y: Floats) -> tuple[float, float]:
    """SSIM and its contrast and structure, with the window written out."""
    window = np.exp(-(np.arange(-5, 6) ** 2) / 4.5)
    window /= window.sum()

    def mean(values: Floats) -> Floats:
        return np.asarray(
            convolve1d(convolve1d(values, window, axis=0, mode="nearest"), window, axis=1, mode="nearest")
        )

    mx, my = mean(x), mean(y)
    vx, vy, c = mean((x - 100) ** 2) - (mx - 100) ** 2, mean(y**2) - my**2, mean(x * y) - mx * my
    structure = (2 * c + 58.5225) / (vx + vy + 58.5225)
    return float((structure * (2 * mx * my + 6.5025) / (mx**2 + my**2 + 6.5025)).mean()), float(structure.mean())


def plain_halves(image: Floats, kernel: list[float]) -> Floats:
    """Filter and keep every second pixel; borders mirrored with their own pixel."""
    taps = np.array(kernel) / sum(kernel)
    reach = len(taps) // 2
    before, after = (reach, reach) if len(taps) % 2 else (0, 1)
    for axis in (0, 1):
        image = np.moveaxis(image, axis, 0)
        n = (len(image) + 1) // 2
        padded = np.pad(image, ((before, after + 1), (0, 0)), mode="symmetric")
        image = sum(w * padded[k : k + 2 * n : 2][:n] for k, w in enumerate(taps))
        image = np.moveaxis(image, 0, axis)
    return image


def test_both_formulas_agree_with_a_plain_implementation(page: Array) -> None:
    """The two are told apart by far more than the tolerance, and neither is the other's formula on its own scales."""
    other = cv2.GaussianBlur(shifted(page, 3, 1), (0, 0), 1.2)
    burt, mean = [1.0, 4.0, 6.0, 4.0, 1.0], [1.0, 1.0]
    x, y = page.astype(float), other.astype(float)
    scales = []
    for _ in range(5):
        scales.append(plain_ssim(x, y)[0])
        x, y = (np.floor(plain_halves(image, burt) + 0.5) for image in (x, y))
    expected_sum = float(np.dot(WEIGHTS, scales) / sum(WEIGHTS))
    x, y, factors = page.astype(float), other.astype(float), []
    for k in range(5):
        whole, structure = plain_ssim(x, y)
        factors.append(structure if k < 4 else whole)
        x, y = plain_halves(x, mean), plain_halves(y, mean)
    expected_product = float(np.prod(np.array(factors) ** WEIGHTS))
    figures = ms_ssim(other, page)
    assert figures["ms_ssim_docunet"] == pytest.approx(expected_sum, abs=2e-4)
    assert figures["ms_ssim_wang"] == pytest.approx(expected_product, abs=2e-4)
    assert abs(expected_sum - expected_product) > 0.01
    assert 0.2 < expected_product < 0.9


def test_agrees_with_figures_of_scikit_image() -> None:
    """SSIM of scikit-image 0.26 on either formula's scales, whole maps; it mirrors borders, which costs the .0005."""
    x, y = np.mgrid[0.0:HEIGHT, 0.0:WIDTH]
    wave = 128 + 60 * np.sin(x / 9) * np.cos(y / 13)
    first, second = wave, wave + 25 * np.sin(x * y / 4000)
    figures = ms_ssim(np.rint(second).astype(np.uint8), np.rint(first).astype(np.uint8))
    assert figures["ms_ssim_docunet"] == pytest.approx(0.84806, abs=5e-4)
    assert figures["ms_ssim_wang"] == pytest.approx(0.84336, abs=5e-4)


def test_equal_pictures_have_one_and_two_exchanged_the_same(page: Array) -> None:
    moved = shifted(page, 2, -1)
    assert ms_ssim(page, page) == {"ms_ssim_docunet": pytest.approx(1.0), "ms_ssim_wang": pytest.approx(1.0)}
    there, back = ms_ssim(moved, page), ms_ssim(page, moved)
    assert there == pytest.approx(back, abs=1e-12)


def test_each_pixel_of_a_shift_lowers_both(page: Array) -> None:
    by_shift = [ms_ssim(shifted(page, dx), page) for dx in range(4)]
    for name in by_shift[0]:
        values = [figures[name] for figures in by_shift]
        assert all(after < before - 0.01 for before, after in pairwise(values))
        assert 0.9 < values[1] < 0.98


def test_opposed_pictures_are_not_alike(page: Array) -> None:
    figures = ms_ssim(255 - page, page)
    assert -1.0 <= figures["ms_ssim_docunet"] < 0.3
    assert figures["ms_ssim_wang"] == 0.0


@settings(max_examples=5, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 3))
def test_enlarging_both_alike_changes_little(seed: int, factor: int) -> None:
    """Both are brought to one area; pixels repeated are not quite the same picture after that."""
    rng = np.random.default_rng(seed)
    page = cv2.resize(printed_page(int(rng.integers(100))), (WIDTH // 2, HEIGHT // 2), interpolation=cv2.INTER_AREA)
    other = shifted(page, 1)
    large = [np.repeat(np.repeat(image, factor, axis=0), factor, axis=1) for image in (other, page)]
    small = ms_ssim(other, page)
    for name, value in ms_ssim(*large).items():
        assert value == pytest.approx(small[name], abs=0.03)


def test_colour_depth_and_channels_do_not_matter(page: Array) -> None:
    other = shifted(page, 1)
    figures = ms_ssim(other, page)
    assert ms_ssim(np.dstack([other] * 3), np.dstack([page] * 3)) == pytest.approx(figures, abs=1e-9)
    deep = ms_ssim(other.astype(np.uint16) * 257, page.astype(np.uint16) * 257)
    assert deep == pytest.approx(figures, abs=1e-9)


@settings(max_examples=10, deadline=None)
@given(st.integers(50, 900), st.integers(50, 900))
def test_pictures_are_compared_at_the_fields_area(height: int, width: int) -> None:
    scan = np.zeros((height, width), np.uint8)
    restored, resized_scan = compared(np.zeros((50, 70), np.uint8), scan)
    assert restored.shape == resized_scan.shape
    assert resized_scan.size == pytest.approx(AREA_PX, rel=0.005)


def test_resizing_keeps_constants_and_ramps_and_does_not_alias() -> None:
    ramp = np.arange(300.0)[None, :] + np.zeros((200, 1))
    half = resized(ramp, (100, 150))
    assert np.allclose(half[:, 10:-10], np.arange(0.5, 300.0, 2.0)[10:-10], atol=1e-9)
    assert np.allclose(resized(np.full((50, 60), 7.0), (83, 41)), 7.0)
    fine = 100.0 + 100.0 * (np.indices((200, 300)).sum(axis=0) % 2)
    assert np.abs(resized(fine, (67, 100))[3:-3, 3:-3] - 150.0).max() < 2.0


@pytest.mark.parametrize(
    ("restored", "scan", "message"),
    [
        (np.zeros((9, 9)), np.zeros((9, 9), np.uint8), "`restored` must be .* got float64 of shape"),
        (
            np.zeros((9, 9), np.uint8),
            np.zeros((9, 9, 4), np.uint8),
            r"`scan` must be .* got uint8 of shape \(9, 9, 4\)",
        ),
        (np.zeros((9, 9), np.uint8), np.zeros((0, 9), np.uint8), "`scan` must be"),
        (np.zeros((9, 9), np.uint8), np.zeros((5, 100), np.uint8), "`scan` must have sides in a ratio up to 19"),
    ],
)
def test_what_is_no_picture_is_refused(restored: Array, scan: Array, message: str) -> None:
    with pytest.raises(InputError, match=message):
        ms_ssim(restored, scan)

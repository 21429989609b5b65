"""Reading between pixels: exact for quadratics, faithful to every dtype, and free of OpenCV's 1/32 pixel rounding."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from deskew.errors import InputError
from deskew.restoration.sampling import sample_image


def places(n: int = 400, low: float = 3.0, high: float = 26.0) -> np.ndarray:
    return np.random.default_rng(2).uniform(low, high, (n, 1, 2)).astype(np.float32)


def test_quadratics_are_read_exactly() -> None:
    y, x = np.mgrid[:30, :30].astype(float)
    image = 3.0 + 0.5 * x - 0.2 * y + 0.03 * x * x - 0.05 * x * y + 0.02 * y * y
    at = places()
    px, py = at[..., 0].astype(float), at[..., 1].astype(float)
    want = 3.0 + 0.5 * px - 0.2 * py + 0.03 * px * px - 0.05 * px * py + 0.02 * py * py
    np.testing.assert_allclose(sample_image(image, at, (30, 30), 1.0), want, atol=1e-10)


def test_is_closer_to_a_band_limited_scene_than_opencvs_cubic() -> None:
    y, x = np.mgrid[:30, :30].astype(float)
    at = places()

    def scene(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        return np.sin(0.9 * u) * np.cos(0.7 * v)

    want = scene(at[..., 0], at[..., 1])
    ours = np.abs(sample_image(scene(x, y), at, (30, 30), 1.0) - want).mean()
    theirs = np.abs(cv2.remap(scene(x, y), at[..., 0], at[..., 1], cv2.INTER_CUBIC) - want).mean()
    linear = np.abs(cv2.remap(scene(x, y), at[..., 0], at[..., 1], cv2.INTER_LINEAR) - want).mean()
    assert 0 < ours < 0.5 * linear
    assert ours < theirs


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.int16, np.float32, np.float64])
@pytest.mark.parametrize("channels", [None, 1, 3, 4])
def test_dtype_and_channels_are_kept_and_whole_pixels_returned_unchanged(dtype: type, channels: int | None) -> None:
    shape = (20, 24) if channels is None else (20, 24, channels)
    image = np.random.default_rng(0).uniform(0, 250, shape).astype(dtype)
    at = np.stack(np.meshgrid(np.arange(24), np.arange(20)), axis=-1).astype(np.float32)
    out = sample_image(image, at, (24, 20), 1.0)
    assert out.dtype == image.dtype
    np.testing.assert_array_equal(out, image)


def test_overshoot_at_an_edge_is_clipped_not_wrapped() -> None:
    image = np.zeros((12, 12), dtype=np.uint8)
    image[:, 6:] = 255
    at = np.stack(np.meshgrid(np.linspace(2, 9, 200), [6.0]), axis=-1).astype(np.float32)
    row = sample_image(image, at, (12, 12), 1.0)[0].astype(int)
    assert np.abs(np.diff(row)).max() < 20
    assert (row.min(), row.max()) == (0, 255)


def test_nan_reads_as_zero_and_the_border_repeats() -> None:
    image = np.full((10, 10), 7.0)
    at = np.array([[[np.nan, 2.0], [-0.5, 4.0], [9.5, 9.5]]], dtype=np.float32)
    np.testing.assert_allclose(sample_image(image, at, (10, 10), 1.0), [[0.0, 7.0, 7.0]])


def test_image_of_higher_resolution_is_read_at_the_same_places() -> None:
    """A ramp over the view, drawn at twice the resolution: pixel centres at quarter and three-quarter places."""
    ramp = (np.arange(60) + 0.5) / 2 - 0.5
    image = np.tile(ramp, (40, 1))
    at = places(50, 5.0, 14.0)
    np.testing.assert_allclose(sample_image(image, at, (30, 20), 0.5), at[..., 0], atol=1e-6)
    np.testing.assert_allclose(sample_image(image, at, (30, 20), 1.0), at[..., 0], atol=1e-6)


def test_detail_finer_than_the_view_is_smoothed_not_aliased() -> None:
    stripes = np.tile(np.array([0.0, 100.0] * 120), (160, 1))
    at = np.stack(np.meshgrid(np.arange(5, 25), np.arange(5, 15)), axis=-1).astype(np.float32)
    out = sample_image(stripes, at, (30, 20), 1.0)
    assert out.std() < 2.0
    assert out.mean() == pytest.approx(50.0, abs=1.0)


def test_other_aspect_or_type_is_refused() -> None:
    at = places(4)
    with pytest.raises(InputError, match="`image` must have the aspect of the camera's 30 x 20"):
        sample_image(np.zeros((30, 30)), at, (30, 20), 1.0)
    with pytest.raises(InputError, match="`image` must hold integers or floats, got complex128"):
        sample_image(np.zeros((20, 30), dtype=complex), at, (30, 20), 1.0)

"""Registration against scenes that are known between the pixels, so that the true map is exact."""

from __future__ import annotations

import numpy as np
import pytest

from deskew.errors import InputError, StepError
from deskew.restoration import Registration, register, register_textures
from deskew.types import Floats

SIZE = (320, 240)
SCALE, OFFSET = np.array([2.31, 2.22]), np.array([-21.4, 13.7])
TEXTURE_SIZE = (700, 560)


def scene(x: Floats, y: Floats, seed: int = 0) -> Floats:
    """Soft blobs at scan pixels (x, y), on a page with a dark desk round it."""
    rng = np.random.default_rng(seed)
    level = np.zeros_like(x)
    for i, (cx, cy) in enumerate(rng.uniform((15, 15), (305, 225), (150, 2))):
        level += (-1) ** i * 45 * np.exp(-((x - cx) ** 2 + (y - cy) ** 2) / (2 * 2.2**2))
    return 130 + level


def picture(size: tuple[int, int], scale: Floats, offset: Floats, seed: int = 0) -> Floats:
    """The scene in a format where scan pixel p lies at ``scale p + offset``."""
    y, x = np.mgrid[0 : size[1], 0 : size[0]].astype(float)
    return scene((x - offset[0]) / scale[0], (y - offset[1]) / scale[1], seed)


def noisy(image: Floats, seed: int) -> np.ndarray:
    return np.clip(np.rint(image + np.random.default_rng(seed).normal(0, 2.0, image.shape)), 0, 255).astype(np.uint8)


SCAN = noisy(picture(SIZE, np.ones(2), np.zeros(2)), 1)
TEXTURE = noisy(picture(TEXTURE_SIZE, SCALE, OFFSET), 2)


def error_px(found: Registration) -> float:
    pixels = np.stack(np.meshgrid(np.linspace(0, 319, 9), np.linspace(0, 239, 9)), axis=-1)
    off = found.to_texture(pixels) - (pixels * SCALE + OFFSET)
    return float(np.sqrt((off**2).sum(axis=-1).mean()))


@pytest.mark.parametrize("light", ["same", "reversed", "dim", "shaded", "colour"])
def test_the_map_is_found_under_any_light(light: str) -> None:
    texture = TEXTURE.astype(float)
    if light == "reversed":
        texture = 255 - texture
    elif light == "dim":
        texture = 20 + 0.3 * texture
    elif light == "shaded":
        texture = texture * np.linspace(0.4, 1.0, texture.shape[1])
    elif light == "colour":
        texture = np.stack([texture, 0.5 * texture, 0.8 * texture], axis=-1)
    found = register(texture.astype(np.uint8), SCAN)
    assert 0.0 < error_px(found) < 0.05
    # What is stated is no less than the error and of its size.
    assert error_px(found) / 4 < found.uncertainty_px < 0.05
    assert 0.0 < found.residual_px < 0.25
    assert found.correlation > 0.9


def test_another_page_is_refused_with_a_remedy() -> None:
    other = noisy(picture(TEXTURE_SIZE, SCALE, OFFSET, seed=9), 2)
    with pytest.raises(StepError, match=r"`uv` does not fit the scan's white image.*move nothing"):
        register(other, SCAN, "uv")


def test_blank_images_are_refused() -> None:
    blank = np.full((300, 400), 128, np.uint8)
    with pytest.raises(StepError, match="does not fit"):
        register(blank, np.full((240, 320), 128, np.uint8))


def test_a_thumbnail_is_refused() -> None:
    with pytest.raises(InputError, match="`texture` must be an image of at least 64 x 64 pixels"):
        register(TEXTURE[:50], SCAN)


def test_lights_of_one_format_share_the_surest_map() -> None:
    faint = np.full_like(TEXTURE, 90)
    found = register_textures({"above": TEXTURE, "uv": faint, "plain": SCAN}, SCAN)
    assert found.keys() == {"above", "uv"}
    assert found["uv"] is found["above"]
    assert error_px(found["uv"]) < 0.05

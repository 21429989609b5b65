"""Many lights through one flattening: pixel on pixel, whatever format they were taken in."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from deskew import projection
from deskew.errors import InputError, StepError
from deskew.restoration import UNSHADED, Registration, restore_textures, texture_quads
from deskew.types import DepthMap, Flattened, Floats, Pinhole, Scan, Sheet, Status

SIZE = (240, 180)
K = np.array([[480.0, 0.0, 118.0], [0.0, 483.0, 91.0], [0.0, 0.0, 1.0]])
LENS = np.array([-0.2, 0.08, 0.001, -0.0007, 0.0])
CAMERA = Pinhole(SIZE, K, LENS, np.diag([1.0, -1.0, -1.0]), np.array([2.0, -1.0, 800.0]))
SCALE, OFFSET = np.array([2.2, 2.1]), np.array([7.0, -5.0])
BLOBS = np.random.default_rng(3).uniform((8, 8), (232, 172), (130, 2))


def scene(pixels: Floats) -> Floats:
    """Grey levels of raw camera pixels, known between them."""
    level = np.full(pixels.shape[:-1], 120.0)
    for i, blob in enumerate(BLOBS):
        level += (-1) ** i * 50 * np.exp(-((pixels - blob) ** 2).sum(axis=-1) / (2 * 2.5**2))
    return level


def scan() -> Scan:
    x, y = np.meshgrid(np.linspace(-130.2, 128.9, 12), np.linspace(97.4, -99.1, 9))
    sheet = Sheet(np.stack([x, y, np.zeros_like(x)], axis=-1))
    white = scene(projection.pixel_grid(SIZE))
    fine = scene((projection.pixel_grid((520, 370)) - OFFSET) / SCALE)
    images = {"white": white, "uv": 255 - white, "fine": fine, "fine_uv": 255 - fine}
    depth = DepthMap(np.full((180, 240), 800.0), np.zeros((180, 240), np.uint8), projection.ideal(CAMERA))
    return Scan(images, depth, CAMERA, sheet, np.zeros((4, 2)))


PAGE = scan()
FLAT = Flattened(PAGE.sheet.vertices + np.array([3.3, -2.1, 0.0]), Status.AT_REST)


@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_lights_of_the_scans_size_need_no_alignment(scale: float) -> None:
    found = restore_textures(PAGE, FLAT, ["white", "uv"], scale)
    for light in ("white", "uv"):
        alone = texture_quads(PAGE.images[light], CAMERA, PAGE.sheet, FLAT, scale)
        assert np.array_equal(found.images[light], alone.image)
        assert np.array_equal(found.backward_map, alone.backward_map, equal_nan=True)
    assert not found.registrations


def test_registrations_found_before_are_taken_as_they_are() -> None:
    given = {"fine": Registration(SCALE, OFFSET)}
    found = restore_textures(PAGE, FLAT, ["fine"], 2.0, given)
    assert found.registrations == given
    shown = np.isfinite(found.backward_map).all(axis=-1)
    true = scene(found.backward_map.astype(float))[shown]
    assert 0 < np.sqrt(((found.images["fine"][shown] - true) ** 2).mean()) < 0.5
    shifted = restore_textures(PAGE, FLAT, ["fine"], 2.0, {"fine": Registration(SCALE, OFFSET + np.array([3.0, 0.0]))})
    assert np.sqrt(((shifted.images["fine"][shown] - true) ** 2).mean()) > 5.0


def test_another_format_is_registered_to_the_page_without_shading_where_there_is_one() -> None:
    white = PAGE.images["white"]
    dark = replace(PAGE, images={**PAGE.images, "white": np.full_like(white, 90.0)})
    with pytest.raises(StepError, match="fine"):
        restore_textures(dark, FLAT, ["fine"])
    found = restore_textures(replace(dark, images={**dark.images, UNSHADED: white}), FLAT, ["fine"])
    assert np.allclose(found.registrations["fine"].scale, SCALE, atol=1e-3)


def test_another_format_lands_on_the_same_pixels() -> None:
    found = restore_textures(PAGE, FLAT, scale=2.0)
    assert found.registrations.keys() == {"fine", "fine_uv"}
    assert list(found.images) == ["white", "uv", "fine", "fine_uv"]
    shown = np.isfinite(found.backward_map).all(axis=-1)
    true = scene(found.backward_map.astype(float))[shown]
    # A tenth of a texture pixel would be 0.9 grey levels RMS on these blobs.
    assert np.sqrt(((found.images["fine"][shown] - true) ** 2).mean()) < 0.5
    assert np.sqrt(((found.images["fine_uv"][shown] - (255 - true)) ** 2).mean()) < 0.5
    assert (found.images["fine"][~shown] == 0).all()


def test_a_light_that_is_not_there_is_refused() -> None:
    with pytest.raises(InputError, match="`light` must be one of white, uv, fine, fine_uv, got ir"):
        restore_textures(PAGE, FLAT, ["ir"])

from __future__ import annotations

import numpy as np
import pytest

from deskew.errors import InputError
from deskew.restoration import as_picture, combined, maximum, mean, principal_components, ratio

RNG = np.random.default_rng(0)
A, B, C = (RNG.integers(20, 250, (30, 40)).astype(np.uint8) for _ in range(3))
PAGE = np.zeros((30, 40), bool)
PAGE[3:-3, 5:-5] = True


def test_mean_and_maximum_do_not_overflow_and_take_colour_for_its_mean() -> None:
    assert np.array_equal(mean([A, B]), (A.astype(float) + B) / 2)
    assert np.array_equal(maximum([A, B, C]), np.maximum(np.maximum(A, B), C))
    colour = np.stack([A, B, C], axis=-1)
    assert np.allclose(mean([colour, A]), (mean([A, B, C]) + A) / 2)


def test_a_ratio_cancels_what_both_lights_share() -> None:
    shading, writing = RNG.uniform(0.2, 1.0, (30, 40)), RNG.choice([1.0, 2.0], (30, 40))
    found = ratio(60 * shading * writing, 120 * shading, PAGE)
    assert np.allclose(found, writing / 2, rtol=1e-12)


def test_a_ratio_does_not_blow_up_in_shadow() -> None:
    dark = np.where(np.arange(40) == 20, 0.0, 100.0) * np.ones((30, 1))
    assert ratio(A, dark, PAGE).max() <= 250 / (0.05 * 100)


def test_components_are_uncorrelated_orthonormal_and_complete() -> None:
    lights = [A.astype(float), A * 0.5 + B * 0.1, A + 0.3 * C]
    found = principal_components(lights, PAGE)
    assert np.allclose(found.loadings @ found.loadings.T, np.eye(3), atol=1e-12)
    covariance = np.cov(found.scores[:, PAGE], bias=True)
    assert np.allclose(covariance, np.diag(3 * found.shares), atol=1e-9)
    assert found.shares[0] > found.shares[1] > found.shares[2] > 0
    # numpy's own correlation matrix has the same spectrum.
    spectrum = np.linalg.eigvalsh(np.corrcoef([light[PAGE] for light in lights]))[::-1]
    assert np.allclose(found.shares, spectrum / 3, atol=1e-12)
    assert (found.scores[:, ~PAGE] == 0).all()


def test_components_do_not_heed_a_lights_brightness() -> None:
    first, second = (principal_components([A, B, k * C.astype(float) + 7], PAGE).scores for k in (1.0, 0.01))
    assert np.allclose(first, second, atol=1e-9)


def test_a_picture_keeps_the_order_of_values_and_the_pages_border() -> None:
    values = RNG.normal(0, 1e-3, (30, 40))
    found = as_picture(values, PAGE)
    assert (found[~PAGE] == 0).all()
    assert found[PAGE].min() == 1
    assert found[PAGE].max() == 255
    order = np.argsort(values[PAGE])
    assert (np.diff(found[PAGE][order].astype(int)) >= 0).all()


@pytest.mark.parametrize("how", ["mean", "max", "ratio:uv/white", "components"])
def test_a_combination_has_the_bits_of_its_finest_light(how: str) -> None:
    fine = {"white": A * np.uint16(257), "uv": B}
    eight, sixteen = (combined(images, PAGE, how) for images in ({"white": A, "uv": B}, fine))
    assert {image.dtype for image in eight.values()} == {np.dtype(np.uint8)}
    for image in sixteen.values():
        assert image.dtype == np.uint16
        assert (image[PAGE].min(), image[PAGE].max()) == (1, 65535)
    # The same picture in finer steps: where 8 bits are rounded, 16 are within half such a step.
    for name, image in sixteen.items():
        assert np.abs(eight[name][PAGE] - (1 + (image[PAGE] - 1.0) * 254 / 65534)).max() <= 0.51


def test_every_combination_has_its_name() -> None:
    images = {"white": A, "uv": B, "raking": C}
    for how, names in {
        "mean": ["mean"],
        "max": ["max"],
        "ratio:uv/white": ["ratio-uv-white"],
        "components": ["component-1", "component-2", "component-3"],
    }.items():
        found = combined(images, PAGE, how)
        assert list(found) == names
        assert all(image.dtype == np.uint8 and image.shape == A.shape for image in found.values())


@pytest.mark.parametrize("how", ["sum", "ratio", "ratio:uv", "ratio:/uv", "ratio:uv/ir", ""])
def test_an_unknown_combination_is_refused(how: str) -> None:
    with pytest.raises(InputError, match="`combine"):
        combined({"white": A, "uv": B}, PAGE, how)


def test_images_of_different_shape_are_refused() -> None:
    with pytest.raises(InputError, match="`images` must be of one shape"):
        mean([A, B[:-1]])

"""New textures made of those under several lights (section 2.4): mean, maximum, ratio and principal components."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deskew.errors import require
from deskew.restoration.registration import grey
from deskew.types import Array, Floats

COMBINATIONS = "mean, max, ratio:LIGHT/LIGHT, components"

# A ratio's denominator is at least this share of its median on the page: shadows do not blow up.
_FLOOR = 0.05
# What a picture of computed values leaves above white and below black, in percent of the page.
_CLIPPED = 0.5


def mean(images: Sequence[Array]) -> Floats:
    """Return the mean of the images' grey levels, (height, width): noise and each light's shading average out."""
    return np.asarray(np.mean(_stack(images), axis=0))


def maximum(images: Sequence[Array]) -> Floats:
    """Return each pixel's brightest grey level, (height, width): what one light leaves in shadow another fills."""
    return np.asarray(_stack(images).max(axis=0))


def ratio(image: Array, by: Array, page: npt.NDArray[np.bool_]) -> Floats:
    """Return an image over another, (height, width): what both show alike cancels, shading and print among it.

    Parameters
    ----------
    image, by : (height, width[, channels]) arrays
        Of one shape.
    page : (height, width) bool array
        Pixels of the page.
    """
    upper, lower = _stack([image, by])
    _require_page(page, upper)
    # Never below a grey level: a denominator without light says nothing of what it would have shown.
    floor = max(_FLOOR * float(np.median(lower[page])), 1.0)
    return np.asarray(upper / np.maximum(lower, floor))


@dataclass(frozen=True, slots=True)
class Components:
    """Principal components of the grey levels that a pixel has under the lights.

    Attributes
    ----------
    scores : (n, height, width) array
        Uncorrelated over the page, in units of one light's standard deviation, the widest first; 0 outside the page.
    loadings : (n, n) array
        Row k: weight of each light, standardised over the page, in component k; its largest entry is positive.
    shares : (n,) array
        Of the standardised lights' whole variance.
    """

    scores: Floats
    loadings: Floats
    shares: Floats


def principal_components(images: Sequence[Array], page: npt.NDArray[np.bool_]) -> Components:
    """Turn n lights into n uncorrelated images: what all share comes first, what one alone shows later.

    Each light is standardised over the page first, or the brightest would decide.

    Parameters
    ----------
    images : sequence of (height, width[, channels]) arrays
        At least two, of one shape.
    page : (height, width) bool array
        Pixels of the page; the others are left out.
    """
    stack = _stack(images)
    require(len(stack) >= 2, "images", "be at least 2 to have components", len(stack))
    _require_page(page, stack[0])
    values = stack[:, page]
    spread = values.std(axis=1, keepdims=True)
    require(bool((spread > 0).all()), "images", "vary over the page", "an image of one grey level")
    standard = (values - values.mean(axis=1, keepdims=True)) / spread
    variances, vectors = np.linalg.eigh(standard @ standard.T / standard.shape[1])
    loadings = vectors[:, ::-1].T
    largest = np.abs(loadings).argmax(axis=1)
    loadings = loadings * np.sign(loadings[np.arange(len(loadings)), largest])[:, None]
    scores = np.zeros(stack.shape)
    scores[:, page] = loadings @ standard
    return Components(scores, loadings, variances[::-1] / variances.sum())


def as_picture(values: Floats, page: npt.NDArray[np.bool_], dtype: npt.DTypeLike = np.uint8) -> Array:
    """Spread computed values (height, width) over 1 to 255, or 65535 in 16 bits, a few extremes clipped; else 0."""
    _require_page(page, values)
    low, high = np.percentile(values[page], [_CLIPPED, 100.0 - _CLIPPED])
    spread = np.clip((values - low) / max(float(high - low), 1e-12), 0.0, 1.0)
    white = float(np.iinfo(dtype).max)
    return np.asarray(np.where(page, np.rint(1.0 + (white - 1.0) * spread), 0.0).astype(dtype))


def require_combination(how: str, lights: Collection[str]) -> None:
    """Raise an InputError unless :func:`combined` can make `how` of these lights: to be asked before long work."""
    parts = _ratio_parts(how)
    known = how in ("mean", "max", "components") or parts is not None
    require(known, "combine", f"be one of {COMBINATIONS}", how)
    for light in parts or ():
        require(light in lights, f"combine {how}", f"name two of {', '.join(lights)}", light)
    require(parts is None or parts[0] != parts[1], f"combine {how}", "name two different lights", how)
    enough = parts is not None or len(lights) >= 2
    require(enough, f"combine {how}", "be of at least 2 lights", f"only {', '.join(lights)}")


def lights_of(how: str, lights: Sequence[str]) -> list[str]:
    """Name the lights that a combination of `lights` looks at: a ratio at its two, the others at all."""
    return list(_ratio_parts(how) or lights)


def pictures_of(how: str, lights: Sequence[str]) -> list[str]:
    """Name the pictures that :func:`combined` makes of these lights."""
    parts = _ratio_parts(how)
    if parts is not None:
        return [f"ratio-{parts[0]}-{parts[1]}"]
    return [f"component-{k + 1}" for k in range(len(lights))] if how == "components" else [how]


def combined(images: Mapping[str, Array], page: npt.NDArray[np.bool_], how: str) -> dict[str, Array]:
    """Make pictures of one combination, by name.

    Parameters
    ----------
    images : mapping of light name to (height, width[, channels]) array
        Of one shape.
    page : (height, width) bool array
        Pixels of the page.
    how : str
        `mean`; `max`; `ratio:A/B` of the lights A and B; or `components`, which gives one picture a light.

    Returns
    -------
    dict of name to (height, width) array
        Spread over the grey levels by :func:`as_picture`: 16 bits if any of the images has as many, else 8.
    """
    require_combination(how, list(images))
    depth = np.uint16 if any(image.dtype == np.uint16 for image in images.values()) else np.uint8
    if depth is np.uint16:  # white is white in 8 bits as in 16
        images = {name: image * np.uint16(257) if image.dtype == np.uint8 else image for name, image in images.items()}
    every = list(images.values())
    if how == "components":
        scores = principal_components(every, page).scores
        names = pictures_of(how, list(images))
        return {name: as_picture(score, page, depth) for name, score in zip(names, scores, strict=True)}
    parts = _ratio_parts(how)
    if parts is not None:
        over, under = parts
        return {f"ratio-{over}-{under}": as_picture(ratio(images[over], images[under], page), page, depth)}
    return {how: as_picture(mean(every) if how == "mean" else maximum(every), page, depth)}


def _ratio_parts(how: str) -> tuple[str, str] | None:
    over, slash, under = how.removeprefix("ratio:").partition("/")
    return (over, under) if how.startswith("ratio:") and slash and over and under else None


def _stack(images: Sequence[Array]) -> Floats:
    require(len(images) >= 1, "images", "be at least 1", len(images))
    shapes = sorted({image.shape[:2] for image in images})
    require(len(shapes) == 1, "images", "be of one shape", shapes)
    return np.stack([grey(image) for image in images])


def _require_page(page: npt.NDArray[np.bool_], image: Array) -> None:
    require(page.shape == image.shape, "page", f"have the images' shape {image.shape}", page.shape)
    require(bool(page.any()), "page", "hold at least 1 pixel", "none")

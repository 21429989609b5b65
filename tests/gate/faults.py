"""Faults to be planted in the running program, none of which raises an error by itself.

Their size is what the literature and this project's own history name, not what the gate happens to see. They replace
functions that compiled code does not call, so no cache of compiled code hides them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from typing import Any
from unittest.mock import patch

import numpy as np
from rapidfuzz.distance import Levenshtein

from deskew import acquisition, metrics
from deskew.flattening import methods, sections, spring, springs
from deskew.flattening.dynamics import settle
from deskew.flattening.outside import Acceleration, Outside
from deskew.flattening.settings import ParticleSettings
from deskew.metrics import misses, stretch
from deskew.restoration import textures, warp
from deskew.types import Array, Capture, Correspondence, Flattened, Floats, Pinhole, Sheet
from experiments.studies import views

Function = Callable[..., Any]
_ROW, _DIAGONALS = 0, slice(2, 4)


@contextmanager
def _wrapped(places: list[tuple[Any, str]], wrap: Callable[[Function], Function]) -> Iterator[None]:
    with ExitStack() as stack:
        for module, name in places:
            stack.enter_context(patch.object(module, name, wrap(getattr(module, name))))
        yield


_LENGTHS: list[tuple[Any, str]] = [(springs, "chord_lengths"), (springs, "unfolded_lengths")]


@contextmanager
def anisotropic_rest_lengths() -> Iterator[None]:
    """Rest lengths along the rows are 1 % too long, along the diagonals half as much; of meshes those along X."""

    def wrap(lengths: Function) -> Function:
        def stretched(*arguments: Any) -> Floats:
            rest: Floats = lengths(*arguments).copy()
            rest[_ROW] *= 1.01
            rest[_DIAGONALS] *= 1.005
            return rest

        return stretched

    def wrap_mesh(lengths: Function) -> Function:
        def stretched(vertices: Floats, *arguments: Any) -> tuple[Array, Floats]:
            edges, rest = lengths(vertices, *arguments)
            along = vertices[edges[:, 1]] - vertices[edges[:, 0]]
            return edges, rest * (1.0 + 0.01 * along[:, 0] ** 2 / (along**2).sum(axis=1))

        return stretched

    with _wrapped(_LENGTHS, wrap), _wrapped([(spring, "surface_lengths")], wrap_mesh):
        yield


@contextmanager
def shrunken_rest_lengths() -> Iterator[None]:
    """Every rest length is 5 % too short, which is what one wrong sign in another program's hinges came to."""
    with _wrapped(_LENGTHS, lambda lengths: lambda *arguments: 0.95 * lengths(*arguments)):
        yield


@contextmanager
def wrong_sign_in_chords() -> Iterator[None]:
    """A spring's length is the root of dx^2 + dy^2 - dz^2."""

    def chords(vertices: Floats) -> Floats:
        signed = np.array([1.0, 1.0, -1.0])
        rest = np.zeros((4, *vertices.shape[:2]))
        for family in range(4):
            (i, j), (p, q) = springs.TAILS[family], springs.HEADS[family]
            rows, columns = vertices.shape[0] - max(i, p), vertices.shape[1] - max(j, q)
            step = vertices[p : rows + p, q : columns + q] - vertices[i : rows + i, j : columns + j]
            rest[family, :rows, :columns] = np.sqrt(np.abs((signed * step**2).sum(axis=-1)))
        return rest

    with _wrapped([(springs, "chord_lengths"), (sections, "chord_lengths")], lambda _: chords):
        yield


def _half_a_texel_beside(sample: Function) -> Function:
    return lambda image, pixels, *arguments: sample(image, pixels + np.float32(0.5), *arguments)


@contextmanager
def half_texel_everywhere() -> Iterator[None]:
    """Every undistorted and restored picture is read half a pixel beside the place."""
    with _wrapped([(warp, "sample_image")], _half_a_texel_beside):
        yield


@contextmanager
def half_texel_in_restored() -> Iterator[None]:
    """Restored pictures alone are read half a pixel beside the place."""

    def wrap(render: Function) -> Function:
        def rendered(*arguments: Any) -> Any:
            with half_texel_everywhere():
                return render(*arguments)

        return rendered

    with _wrapped([(textures, "texture_quads")], wrap):
        yield


@contextmanager
def decoder_bias() -> Iterator[None]:
    """Decoded projector columns are 0.03 px too large."""

    def wrap(decode: Function) -> Function:
        def biased(capture: Capture, *arguments: Any) -> Correspondence:
            found: Correspondence = decode(capture, *arguments)
            return replace(found, column=found.column + np.float32(0.03))

        return biased

    with _wrapped([(acquisition, "decode")], wrap):
        yield


@contextmanager
def integer_forces() -> Iterator[None]:
    """The paper's explicit Euler, with forces in an array of whole numbers of mN."""

    def flatten(sheet: Sheet, **settings: Any) -> Flattened:
        chosen = ParticleSettings(**settings)

        def step(x: Array, v: Array, acceleration: Acceleration, dt: float) -> tuple[Array, Array]:
            force = np.zeros(x.shape, dtype=int)
            force[:] = chosen.mass * acceleration(x, v)
            return x + dt * v, v + dt * force / chosen.mass

        return settle(sheet, Outside("tests.gate.faults:step", step), chosen)

    with patch.dict(methods.METHODS, {"paper_euler": flatten}):
        yield


@contextmanager
def lost_corners() -> Iterator[None]:
    """Of each picture the tenth of the corners that lie farthest from where they were looked for is lost."""

    def wrap(detect: Function) -> Function:
        def lossy(image: Array, seeds: Floats) -> Floats:
            found: Floats = detect(image, seeds).copy()
            found[np.argsort(-np.linalg.norm(found - seeds, axis=1))[: len(found) // 10]] = np.nan
            return found

        return lossy

    with patch.dict(views.DETECTORS, {name: wrap(detect) for name, detect in views.DETECTORS.items()}):
        yield


@contextmanager
def uncounted_lost_corners() -> Iterator[None]:
    """Corners are lost, and those that are count as no part of the page."""

    def wrap(distance: Function) -> Function:
        def flattered(restored: Floats, control: Floats, camera: Pinhole) -> dict[str, float]:
            both = np.isfinite(restored).all(axis=1) & np.isfinite(control).all(axis=1)
            figures: dict[str, float] = distance(restored[both], control[both], camera)
            return figures

        return flattered

    with lost_corners(), _wrapped([(metrics, "corner_distance")], wrap):
        yield


@contextmanager
def free_substitutions() -> Iterator[None]:
    """A letter read as another costs nothing in the edit distance."""

    class Free:
        @staticmethod
        def distance(true: str, read: str, weights: tuple[int, int, int]) -> int:
            return Levenshtein.distance(true, read, weights=(*weights[:2], 0))

    with patch.object(misses, "Levenshtein", Free):
        yield


@contextmanager
def unsigned_areas() -> Iterator[None]:
    """A triangle that is turned over has the area of one that is not."""
    with _wrapped([(stretch, "signed_areas")], lambda areas: lambda *arguments: np.abs(areas(*arguments))):
        yield


FAULTS = {
    fault.__name__: fault
    for fault in (
        anisotropic_rest_lengths,
        shrunken_rest_lengths,
        wrong_sign_in_chords,
        half_texel_everywhere,
        half_texel_in_restored,
        decoder_bias,
        integer_forces,
        lost_corners,
        uncounted_lost_corners,
        free_substitutions,
        unsigned_areas,
    )
}

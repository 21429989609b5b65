"""Surfaces at the edge of what is one: those that are flattened like any other, and those that are refused by name."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import deskew
from deskew.errors import InputError
from deskew.io import grid_faces
from deskew.types import Array, Sheet, Status
from tests.flattening.bent_sheets import cylinder, flat_grid, rigid_error

GRID = cylinder(30.0, (12, 16))[0]


def as_triangles(grid: Array) -> tuple[Array, Array]:
    return grid.reshape(-1, 3), grid_faces(*grid.shape[:2])


def folded_onto_itself() -> Array:
    grid = flat_grid((11, 21), (20.0, 10.0))
    over = grid[..., 0] > 10
    grid[over, 0] = 20 - grid[over, 0]
    return grid


def accordion() -> Array:
    grid = flat_grid((11, 21), (20.0, 10.0))
    grid[..., 0] = np.abs((np.arange(21) + 5) % 10 - 5)
    return grid


FLAT_ENOUGH: dict[str, Callable[[], Array]] = {
    **{f"{r} x {c}": lambda r=r, c=c: cylinder(30.0, (r, c))[0] for r, c in ((2, 2), (2, 7), (7, 2), (3, 4), (2, 300))},  # type: ignore[misc]
    "on edge": lambda: flat_grid()[..., [2, 0, 1]],
    "on its other edge": lambda: flat_grid()[..., [0, 2, 1]],
    "upside down": lambda: GRID * [1.0, -1.0, -1.0],
    "rows upwards": lambda: GRID[::-1],
    "folded by 180 degrees": folded_onto_itself,
    "folded like an accordion": accordion,
    "cells of 1 to 1000": lambda: flat_grid((12, 12), (11.0, 11_000.0)),
    "a micron wide": lambda: 1e-5 * GRID,
    "a kilometre wide": lambda: 1e4 * GRID,
    "a kilometre away": lambda: GRID + 1e6,
    "float32": lambda: GRID.astype(np.float32),
    "whole numbers": lambda: (10 * flat_grid((5, 6), (50.0, 40.0))).astype(np.int16),
    "Fortran's order": lambda: np.asfortranarray(GRID),
    "every second of a larger array": lambda: np.repeat(GRID, 2, axis=1)[:, ::2],
}


@pytest.mark.parametrize("as_mesh", [False, True], ids=["grid", "mesh"])
@pytest.mark.parametrize("name", FLAT_ENOUGH)
def test_is_laid_flat_without_stretch_and_left_as_it_was(name: str, as_mesh: bool) -> None:
    given = FLAT_ENOUGH[name]()
    before, shape = given.copy(), given.shape
    surface = as_triangles(given) if as_mesh else (given,)
    flat = deskew.flatten(*surface, rest="chord")
    assert flat.status is Status.AT_REST
    places, bent = flat.vertices.reshape(shape), np.asarray(given, dtype=float)
    assert not places[..., 2].any()
    for axis in (0, 1):
        lengths, wanted = (np.linalg.norm(np.diff(points, axis=axis), axis=-1) for points in (places, bent))
        assert np.abs(lengths - wanted).max() < 3e-3 * wanted.mean()
    assert np.array_equal(given, before)


@pytest.mark.parametrize("angle_deg", [60.0, 80.0, 88.0, 89.9, 90.0, 91.0, 120.0, 180.0])
@pytest.mark.parametrize("noise_mm", [0.0, "auto"])
def test_bent_page_turned_until_it_is_seen_edge_on_keeps_its_size(angle_deg: float, noise_mm: float | str) -> None:
    """Turned about X, a bend about Y is seen from the side."""
    bent, flat = cylinder(30.0, (25, 41))
    c, s = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    turned = bent @ np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])
    found = deskew.flatten(*as_triangles(turned), noise_mm=noise_mm).vertices.reshape(bent.shape)[..., :2]
    seen = flat * [1.0, -1.0] if angle_deg > 105 else flat  # overturned, it is seen from behind
    assert rigid_error(found, seen).max() < 0.03


REFUSED: dict[str, tuple[Callable[[], Sheet], str]] = {
    "NaN": (lambda: Sheet(np.where(GRID.max() - 1e-9 < GRID, np.nan, GRID)), "`vertices` must be finite, got 1"),
    "infinite": (lambda: Sheet(np.where(GRID.max() - 1e-9 < GRID, np.inf, GRID)), "`vertices` must be finite, got 1"),
    "beyond all measure": (lambda: Sheet(*as_triangles(1e200 * GRID)), r"`vertices` must lie within 1e\+09 mm"),
    "no grid": (lambda: Sheet(GRID[:1]), r"`vertices` must have shape \(R, C, 3\) with R, C >= 2"),
    "all in one place": (lambda: Sheet(0 * GRID), "`vertices` must be distinct along every edge and diagonal"),
    "neighbours in one place": (lambda: Sheet(GRID.repeat(2, axis=0)), "`vertices` must be distinct along every edge"),
    "all on a line": (
        lambda: Sheet(np.arange(192.0).reshape(12, 16)[..., None] * [1.0, 2.0, 3.0]),
        "`vertices` must span an area, got quads without area only",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_surface_is_refused_by_name(name: str) -> None:
    make, message = REFUSED[name]
    with pytest.raises(InputError, match=message):
        deskew.flattening.flatten(make())


@pytest.mark.parametrize("other", [(0, 2), (0, 9), (9, 9), (5, 0)])
def test_a_grid_that_meets_itself_is_flattened_or_said_to_fold(other: tuple[int, int]) -> None:
    """Vertices in one place that no spring joins; on a coarser grid one may."""
    grid = cylinder(30.0, (10, 10))[0]
    grid[0, 0] = grid[other]
    flat = deskew.flatten(grid)
    assert flat.status in (Status.AT_REST, Status.FOLDED)
    assert np.isfinite(flat.vertices).all()


def test_a_mesh_of_noise_ends_folded_and_says_so() -> None:
    rng = np.random.default_rng(2)
    flat = deskew.flatten(*as_triangles(rng.normal(size=(12, 12, 3))))
    assert flat.status is Status.FOLDED
    assert flat.counters["flips"] > 0
    assert np.isfinite(flat.vertices).all()


@pytest.mark.parametrize(
    ("faces", "places"),
    [
        ([[0, 1, 2]], [[0, 0, 0], [9, 0, 0], [0, 9, 3]]),
        ([[0, 1, 2], [2, 1, 3]], [[0, 0, 0], [9, 0, 0], [0, 9, 3], [9, 9, 0]]),
        ([[0, 1, 2], [2, 1, 3]], [[0, 0, 0], [9, 0, 0], [9, 1e-7, 0], [9, 9, 0]]),
    ],
    ids=["one face", "two faces", "two faces and an edge of hardly any length"],
)
@pytest.mark.parametrize("noise_mm", [0.0, "auto", 0.3, 1000.0])
def test_a_face_or_two_are_flat_whatever_noise_they_have(
    faces: list[list[int]], places: list[list[float]], noise_mm: float | str
) -> None:
    vertices = np.array(places, dtype=float)
    flat = deskew.flatten(vertices, np.array(faces), noise_mm=noise_mm)
    assert flat.status is Status.AT_REST
    assert np.isfinite(flat.vertices).all()


@pytest.mark.parametrize("stiffness", [lambda p: 1 / 0, lambda p: p, lambda p: None, lambda p: "stiff", exit])
def test_whatever_a_function_of_stiffness_does_is_one_line(stiffness: Callable[..., Array]) -> None:
    with pytest.raises(InputError, match="`stiffness` must return one number a middle, got ") as error:
        deskew.flatten(GRID, stiffness=stiffness)
    assert "\n" not in str(error.value)

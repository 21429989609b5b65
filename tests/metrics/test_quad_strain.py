"""Strain of each quad: what is known in closed form, and where a chord would lie."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from deskew.errors import InputError
from deskew.metrics import quad_strain
from deskew.types import Flattened, Floats, Sheet, Status

FACTOR = 8


def grid(rows: int, columns: int) -> Floats:
    x, y = np.meshgrid(np.arange(columns) * 5.0, np.arange(rows) * 4.0)
    return np.stack([x, y, 0 * x], axis=-1)


def bent(flat: Floats, radius: float = 20.0) -> Floats:
    """Roll a flat grid round a cylinder: no length along the surface changes."""
    angle = flat[..., 0] / radius
    return np.stack([radius * np.sin(angle), flat[..., 1], radius * (1 - np.cos(angle))], axis=-1)


def laid(vertices: Floats, surface: Floats | None = None) -> Flattened:
    return Flattened(vertices, Status.AT_REST, surface=surface)


@given(scale=st.floats(0.5, 2.0), turn=st.floats(-3.0, 3.0))
def test_scale_is_the_strain_everywhere_and_motion_is_none(scale: float, turn: float) -> None:
    flat = grid(4, 6)
    c, s = np.cos(turn), np.sin(turn)
    moved = scale * flat @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + [3.0, -7.0, 0.0]
    assert np.allclose(quad_strain(Sheet(flat), laid(moved)), scale - 1, atol=1e-12)


def test_one_stretched_row_is_found_where_it_lies() -> None:
    flat = grid(5, 6)
    longer = flat.copy()
    longer[3:, :, 1] += 0.9
    strain = quad_strain(Sheet(flat), laid(longer))
    assert np.allclose(strain[2], 2 * 0.9 / 18)
    assert np.allclose(np.delete(strain, 2, axis=0), 0, atol=1e-12)


def test_lengths_are_those_along_the_surface() -> None:
    fine = np.stack(np.meshgrid(np.linspace(0, 25, 5 * FACTOR + 1), np.linspace(0, 12, 3 * FACTOR + 1)), axis=-1)
    fine = np.concatenate([fine, np.zeros((*fine.shape[:2], 1))], axis=-1)
    flat, surface = fine[::FACTOR, ::FACTOR], bent(fine)
    sheet = Sheet(surface[::FACTOR, ::FACTOR], surface=surface)
    along = quad_strain(sheet, laid(flat, fine))
    chords = quad_strain(replace(sheet, surface=None), laid(flat))
    assert 0 <= along.min() <= along.max() < 5e-5
    assert chords.min() > 1e-3


def test_cut_quads_have_no_strain() -> None:
    flat = grid(4, 6)
    cut = np.zeros((3, 5), bool)
    cut[1, 2] = True
    assert np.array_equal(np.isnan(quad_strain(Sheet(flat, cut=cut), laid(flat))), cut)


def test_meshes_and_other_shapes_are_refused() -> None:
    flat = grid(4, 6)
    with pytest.raises(InputError, match="`sheet` must be a grid, got a triangle mesh"):
        quad_strain(Sheet(np.eye(3), np.array([[0, 1, 2]])), laid(np.eye(3)))
    with pytest.raises(InputError, match=r"`flattened` must have the sheet's shape \(4, 6, 3\)"):
        quad_strain(Sheet(flat), laid(flat[1:]))

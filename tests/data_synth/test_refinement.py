"""Refinement goes through every vertex, bends as the surface does, and keeps planes plane."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from data_synth import PAGE_SIZE_MM, TrueSheet, refined
from data_synth.developables import cylinder
from data_synth.sheets import flat_sheet, page_grid_of, to_world
from deskew.types import Floats

R_MM, SHAPE = 200.0, (73, 94)  # vertices 3 mm apart on a circular cylinder


def sheets(shape: tuple[int, int]) -> TrueSheet:
    flat = page_grid_of(shape, PAGE_SIZE_MM)
    angle = flat[..., 0] / R_MM
    return TrueSheet(np.stack([R_MM * np.sin(angle), -flat[..., 1], R_MM * np.cos(angle)], axis=-1), flat)


def _bent(radius_mm: float, spacing_mm: float) -> tuple[Floats, Floats]:
    """Chords of `spacing_mm` inscribed in a circle, page coordinates that count the chords: vertices and flat."""
    flat = page_grid_of((4, 31), (30 * spacing_mm, 3 * spacing_mm))
    angle = 2 * np.arcsin(spacing_mm / 2 / radius_mm) * np.arange(31)
    x, z = radius_mm * np.sin(angle), radius_mm * np.cos(angle)
    return np.stack([np.broadcast_to(x, (4, 31)), -flat[..., 1], np.broadcast_to(z, (4, 31))], axis=-1), flat


def test_a_cylinder_is_met_a_hundred_times_closer_than_by_facets() -> None:
    fine = refined(sheets(SHAPE), 0.3)
    assert fine.vertices.shape == (721, 931, 3)
    error = np.abs(np.hypot(fine.vertices[..., 0], fine.vertices[..., 2]) - R_MM)
    facet = R_MM * (1 - np.cos(3.0 / R_MM / 2))  # a chord's sagitta
    assert 0 < error.max() < facet / 100
    assert np.allclose(fine.flat, page_grid_of((721, 931), PAGE_SIZE_MM), atol=1e-9)


def test_arcs_become_as_long_as_the_chords_were() -> None:
    # A polygon of chords of 3 mm inscribed in a circle of 20 mm: its arcs are (h / R)^2 / 24, or .94 per mille, longer.
    sheet = TrueSheet(*_bent(20.0, 3.0))
    along = (refined(sheet, 0.1, chords=chords).vertices for chords in (False, True))
    lengths = [np.linalg.norm(np.diff(V[0, 300:-300], axis=0), axis=-1).mean() / 0.1 - 1 for V in along]
    assert lengths[0] == pytest.approx((3.0 / 20.0) ** 2 / 24, rel=0.05)
    assert abs(lengths[1]) < 0.02 * lengths[0]


def test_every_vertex_stays() -> None:
    sheet = cylinder(np.random.default_rng(1), (37, 48))
    fine = refined(sheet, 1.5)
    step = (fine.vertices.shape[0] - 1) / 36, (fine.vertices.shape[1] - 1) / 47
    rows = [i for i in range(37) if (i * step[0]).is_integer()]
    columns = [j for j in range(48) if (j * step[1]).is_integer()]
    assert len(rows) > 2
    assert len(columns) > 1
    at = np.ix_(*[np.round(np.array(k) * s).astype(int) for k, s in zip((rows, columns), step, strict=True)])
    assert np.abs(fine.vertices[at] - sheet.vertices[np.ix_(rows, columns)]).max() < 1e-9


@given(rows=st.integers(2, 40), columns=st.integers(2, 40), tilt=st.floats(-1.0, 1.0))
def test_a_plane_stays_plane_on_any_grid(rows: int, columns: int, tilt: float) -> None:
    flat = page_grid_of((rows, columns), PAGE_SIZE_MM)
    world = to_world(flat, PAGE_SIZE_MM)
    world[..., 2] = tilt * world[..., 0]
    fine = refined(TrueSheet(world, flat), 3.0)
    assert np.abs(fine.vertices[..., 2] - tilt * fine.vertices[..., 0]).max() < 1e-9
    assert np.abs(to_world(fine.flat, PAGE_SIZE_MM)[..., :2] - fine.vertices[..., :2]).max() < 1e-9


def test_a_fine_sheet_is_left_alone_and_only_the_coarse_axis_is_refined() -> None:
    sheet = flat_sheet()
    assert refined(sheet) is sheet
    assert refined(sheets((721, 94)), 0.3).vertices.shape == (721, 931, 3)

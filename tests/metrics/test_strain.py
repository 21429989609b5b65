"""Strain, folds and the flat vertices' error, each against its closed form."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from deskew.errors import InputError, StepError
from deskew.metrics import flat_error, sheet_strain
from deskew.types import Flattened, Floats, Sheet, Status


def flat_grid(rows: int = 7, columns: int = 9, pitch: float = 5.0) -> Floats:
    X, Y = np.meshgrid(pitch * np.arange(columns), -pitch * np.arange(rows))
    return np.stack([X, Y, np.zeros_like(X)], axis=-1)


def flattened(vertices: Floats) -> Flattened:
    return Flattened(vertices, Status.AT_REST)


@settings(deadline=None)
@given(st.floats(-3, 3), st.floats(-100, 100))
def test_rigidly_moved_sheet_has_no_strain(angle: float, shift: float) -> None:
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    figures = sheet_strain(Sheet(flat_grid()), flattened(flat_grid() @ turn.T + shift))
    assert figures == pytest.approx(
        {"strain_rms": 0.0, "length_change": 0.0, "flips": 0.0, "folded_quads": 0.0}, abs=1e-9
    )


def test_uniform_scale_is_the_strain() -> None:
    figures = sheet_strain(Sheet(flat_grid()), flattened(0.97 * flat_grid()))
    assert figures["strain_rms"] == pytest.approx(0.03)
    assert figures["length_change"] == pytest.approx(-0.03)


def test_stretch_along_one_axis_strains_structural_and_shear_springs() -> None:
    """Square quads stretched by e along X: rows e, columns 0, diagonals sqrt(((1 + e)^2 + 1) / 2) - 1."""
    e, rows, columns = 0.1, 7, 9
    vertices = flat_grid(rows, columns) * [1 + e, 1, 1]
    n_row, n_column, n_shear = rows * (columns - 1), (rows - 1) * columns, 2 * (rows - 1) * (columns - 1)
    shear = np.sqrt(((1 + e) ** 2 + 1) / 2) - 1
    want = np.sqrt((n_row * e**2 + n_shear * shear**2) / (n_row + n_column + n_shear))
    assert sheet_strain(Sheet(flat_grid()), flattened(vertices))["strain_rms"] == pytest.approx(want)


def test_one_vertex_pulled_across_its_neighbour_folds_its_quads() -> None:
    vertices = flat_grid()
    vertices[3, 4] += [6.0, 0.0, 0.0]
    figures = sheet_strain(Sheet(flat_grid()), flattened(vertices))
    assert figures["folded_quads"] == 2.0
    assert figures["flips"] > 0


def test_sheet_turned_over_is_all_flips() -> None:
    figures = sheet_strain(Sheet(flat_grid()), flattened(flat_grid() * [-1, 1, 1]))
    assert (figures["flips"], figures["folded_quads"]) == (96.0, 48.0)
    assert figures["strain_rms"] < 1e-12


def test_triangle_mesh_gives_what_its_triangles_show() -> None:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    sheet = Sheet(vertices, faces=np.array([[0, 1, 2], [1, 3, 2]]))
    moved = vertices.copy()
    moved[3] = [0.2, 0.2, 0.0]
    figures = sheet_strain(sheet, flattened(moved))
    assert figures["flips"] == 1.0
    assert "folded_quads" not in figures
    new = np.sqrt(0.8**2 + 0.2**2)
    assert figures["strain_rms"] == pytest.approx(np.sqrt(2 * (new - 1) ** 2 / 5))


def test_flat_error_sees_scale_rigidly_and_not_affinely() -> None:
    uv = flat_grid()[..., :2] * [1, -1]
    figures = flat_error(1.02 * flat_grid(), uv)
    radius = np.linalg.norm((flat_grid() - flat_grid().reshape(-1, 3).mean(0))[..., :2], axis=-1)
    assert figures["flat_max_mm"] < 1e-9
    assert figures["flat_rigid_mean_mm"] == pytest.approx(0.02 * radius.mean())
    assert figures["flat_rigid_max_mm"] == pytest.approx(0.02 * radius.max())


def test_flat_error_refuses_a_mirrored_sheet_and_skips_vertices_off_the_page() -> None:
    uv = flat_grid()[..., :2] * [1, -1]
    with pytest.raises(StepError, match="Flat error: the restored page is mirrored"):
        flat_error(flat_grid() * [-1, 1, 1], uv)
    vertices, partly = flat_grid(), uv.copy()
    vertices[0, 0] += 50.0
    partly[0, 0] = np.nan
    assert flat_error(vertices, partly)["flat_rigid_max_mm"] < 1e-9


def test_disagreeing_shapes_and_coincident_vertices_are_refused() -> None:
    with pytest.raises(InputError, match="`flattened` must have the sheet's shape"):
        sheet_strain(Sheet(flat_grid()), flattened(flat_grid(6)))
    with pytest.raises(InputError, match="`flattened` must have finite vertices"):
        sheet_strain(Sheet(flat_grid()), flattened(flat_grid() * np.nan))
    twice = flat_grid()
    twice[0, 1] = twice[0, 0]
    with pytest.raises(InputError, match="`sheet` must have no two joined vertices in one place, got 1 pairs"):
        sheet_strain(Sheet(twice), flattened(flat_grid()))
    with pytest.raises(InputError, match="`true_uv` must have shape"):
        flat_error(flat_grid(), flat_grid())


def test_what_happens_in_a_cut_is_no_strain() -> None:
    cut = np.zeros((6, 8), dtype=bool)
    cut[:, 3] = True
    apart = flat_grid()
    apart[:, 4:, 0] += 2.0
    assert sheet_strain(Sheet(flat_grid(), cut=cut), flattened(apart))["strain_rms"] == pytest.approx(0.0, abs=1e-9)
    crossed = flat_grid()
    crossed[:, 4:, 0] -= 7.0
    assert sheet_strain(Sheet(flat_grid(), cut=cut), flattened(crossed))["folded_quads"] == 0
    assert sheet_strain(Sheet(flat_grid()), flattened(crossed))["folded_quads"] == 6

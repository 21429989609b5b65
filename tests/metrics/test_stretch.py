"""Sander's stretch both ways, areas and angles, each against its closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from deskew.errors import InputError
from deskew.metrics import sheet_stretch
from deskew.types import Flattened, Floats, Sheet, Status

PERFECT = {
    "stretch_l2": 1.0,
    "stretch_linf": 1.0,
    "stretch_inverse_l2": 1.0,
    "stretch_inverse_linf": 1.0,
    "area_error": 0.0,
    "angle_mean_deg": 0.0,
    "flips": 0.0,
    "folds": 0.0,
}


def flat_grid(rows: int = 5, columns: int = 6) -> Floats:
    X, Y = np.meshgrid(3.0 * np.arange(columns), -3.0 * np.arange(rows))
    return np.stack([X, Y, np.zeros_like(X)], axis=-1)


def bent_grid(radius: float = 7.0) -> Floats:
    """The same grid on a prism whose edges are its columns: each quad stays flat and keeps its size."""
    flat = flat_grid()
    turn = 2 * np.arcsin(3.0 / (2 * radius))
    angle = turn * np.arange(flat.shape[1])
    X, Z = radius * np.sin(angle - 1.0), radius * np.cos(angle - 1.0)
    return np.stack([X + 0 * flat[..., 0], flat[..., 1], Z + 0 * flat[..., 0]], axis=-1)


def mapped(matrix: Floats, sheet: Floats | None = None) -> dict[str, float]:
    """Figures of a bent sheet whose flat state is moved by a linear map."""
    flat = flat_grid()
    flat[..., :2] = flat[..., :2] @ np.asarray(matrix).T
    return sheet_stretch(Sheet(bent_grid() if sheet is None else sheet), Flattened(flat, Status.AT_REST))


@settings(deadline=None, max_examples=25)
@given(st.floats(-3, 3), st.floats(-100, 100))
def test_an_isometry_is_perfect_wherever_it_lies(angle: float, shift: float) -> None:
    turn = np.array([[math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1]])
    figures = sheet_stretch(Sheet(bent_grid()), Flattened(flat_grid() @ turn.T + shift, Status.AT_REST))
    assert figures == pytest.approx(PERFECT, abs=1e-6)


@pytest.mark.parametrize("scale", [0.5, 0.97, 1.1, 3.0])
def test_a_uniform_scale_is_the_stretch_one_way_and_its_reciprocal_the_other(scale: float) -> None:
    assert mapped(np.eye(2) * scale) == pytest.approx(
        {
            "stretch_l2": 1 / scale,
            "stretch_linf": 1 / scale,
            "stretch_inverse_l2": scale,
            "stretch_inverse_linf": scale,
            "area_error": abs(scale**2 - 1),
            "angle_mean_deg": 0.0,
            "flips": 0.0,
            "folds": 0.0,
        },
        abs=1e-6,
    )


def test_an_anisotropic_map_has_its_two_factors() -> None:
    """Factors 2 along and 0.8 across: the reciprocals from the plane back to the surface, larger first."""
    figures = mapped(np.diag([2.0, 0.8]))
    assert figures["stretch_linf"] == pytest.approx(1 / 0.8)
    assert figures["stretch_l2"] == pytest.approx(math.sqrt((1 / 0.8**2 + 1 / 2.0**2) / 2))
    assert figures["stretch_inverse_linf"] == pytest.approx(2.0)
    assert figures["stretch_inverse_l2"] == pytest.approx(math.sqrt((2.0**2 + 0.8**2) / 2))
    assert figures["area_error"] == pytest.approx(0.6)


@pytest.mark.parametrize("shear", [0.1, 1.0])
def test_a_shear_has_the_golden_pair_of_singular_values_and_keeps_areas(shear: float) -> None:
    """Of [[1, k], [0, 1]] they are (sqrt(k^2 + 4) +- k) / 2, each the other's reciprocal."""
    largest = (math.sqrt(shear**2 + 4) + shear) / 2
    figures = mapped(np.array([[1.0, shear], [0.0, 1.0]]))
    l2 = math.sqrt((largest**2 + largest**-2) / 2)
    assert figures["stretch_linf"] == pytest.approx(largest)
    assert figures["stretch_inverse_linf"] == pytest.approx(largest)
    assert (figures["stretch_l2"], figures["stretch_inverse_l2"]) == pytest.approx((l2, l2))
    assert figures["area_error"] == pytest.approx(0.0, abs=1e-9)
    # Right angles open or close by atan k, whichever way the diagonal runs the other two change by that in sum.
    assert figures["angle_mean_deg"] == pytest.approx(2 * math.degrees(math.atan(shear)) / 3)


def test_half_a_sheet_scaled_is_the_mean_over_its_area_on_the_surface() -> None:
    """Not over the area in the plane, where the larger half would count four times."""
    surface = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 0, 0], [6, 0, 0], [5, 1, 0]])
    flat = surface.copy()
    flat[3:] *= 2.0
    sheet = Sheet(surface, faces=np.array([[0, 1, 2], [3, 4, 5]]))
    figures = sheet_stretch(sheet, Flattened(flat, Status.AT_REST))
    assert figures["stretch_l2"] == pytest.approx(math.sqrt((1 + 0.25) / 2))
    assert figures["stretch_inverse_l2"] == pytest.approx(math.sqrt((1 + 4) / 2))
    assert (figures["stretch_linf"], figures["stretch_inverse_linf"]) == pytest.approx((1.0, 2.0))
    assert figures["area_error"] == pytest.approx(1.5)


@pytest.mark.parametrize("place", ["beyond", "on the line"])
def test_a_triangle_flipped_or_gone_is_never_perfect(place: str) -> None:
    """The flipped one has the right edge lengths: an unsigned area would give it full marks."""
    surface = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    flat = surface.copy()
    flat[3] = [1.0, 0.0, 0.0] if place == "beyond" else [0.5, 0.5, 0.0]
    sheet = Sheet(surface, faces=np.array([[0, 1, 2], [0, 2, 3]]))
    figures = sheet_stretch(sheet, Flattened(flat, Status.AT_REST))
    infinite = ("stretch_l2", "stretch_linf", "stretch_inverse_l2", "stretch_inverse_linf")
    assert [figures[name] for name in infinite] == [math.inf] * 4
    assert (figures["flips"], figures["folds"]) == (1.0, 1.0)
    assert figures["area_error"] == pytest.approx(1.0 if place == "beyond" else 0.5)


def test_a_sheet_turned_over_is_all_flips() -> None:
    figures = mapped(np.diag([-1.0, 1.0]), flat_grid())
    assert (figures["flips"], figures["area_error"]) == (40.0, pytest.approx(2.0))
    assert figures["folds"] == 0.0  # nowhere does it fold over: it lies on its face
    assert figures["stretch_l2"] == math.inf


@settings(deadline=None, max_examples=25)
@given(st.lists(st.floats(-2, 2), min_size=4, max_size=4))
def test_any_linear_map_gives_what_a_singular_value_decomposition_gives(entries: list[float]) -> None:
    assume(entries[0] * entries[3] - entries[1] * entries[2] > 0.05)  # numpy's own determinant warns of subnormals
    matrix = np.array(entries).reshape(2, 2)
    factors = np.linalg.svd(matrix, compute_uv=False)
    figures = mapped(matrix)
    assert figures["stretch_inverse_linf"] == pytest.approx(factors[0])
    assert figures["stretch_linf"] == pytest.approx(1 / factors[1])
    assert figures["stretch_inverse_l2"] == pytest.approx(math.sqrt((factors**2).mean()))
    assert figures["stretch_l2"] == pytest.approx(math.sqrt((1 / factors**2).mean()))


def test_triangles_without_area_are_left_out_and_nothing_else_is_refused() -> None:
    surface = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 1, 0], [2, 0, 0]])
    faces = np.array([[0, 1, 2], [1, 2, 3], [0, 1, 4], [3, 2, 0]])
    sheet = Sheet(surface, faces=faces)
    assert sheet_stretch(sheet, Flattened(surface, Status.AT_REST)) == pytest.approx(PERFECT)
    with pytest.raises(InputError, match="`sheet` must have triangles of some area, got none"):
        sheet_stretch(Sheet(surface, faces=faces[1:3]), Flattened(surface, Status.AT_REST))
    with pytest.raises(InputError, match="`flattened` must have finite vertices"):
        sheet_stretch(sheet, Flattened(surface * np.nan, Status.DIVERGED))
    with pytest.raises(InputError, match="`flattened` must have the sheet's shape"):
        sheet_stretch(sheet, Flattened(surface[:4], Status.AT_REST))

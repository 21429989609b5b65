"""A flattening against its truth, whichever way their axes and faces run."""

from __future__ import annotations

import numpy as np
import pytest

from deskew.errors import InputError, StepError
from deskew.metrics import score_flattening
from deskew.types import Floats, Sheet

V_UP, V_DOWN = np.array([1.0, 1.0]), np.array([1.0, -1.0])


def cylinder() -> tuple[Sheet, Floats]:
    """A page of 40 x 30 mm on a cylinder, its front outside, and its flat state with x right and y up from there."""
    s, y = (axis.ravel() for axis in np.meshgrid(np.linspace(0, 40, 81), np.linspace(0, -30, 7)))
    bent = np.stack([25 * np.sin(s / 25 - 0.8), y, 25 * np.cos(s / 25 - 0.8)], axis=-1)
    at = np.arange(s.size).reshape(7, 81)
    a, b, c, d = (corner.ravel() for corner in (at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]))
    faces = np.concatenate([np.stack([a, d, b], -1), np.stack([b, d, c], -1)])
    normals = np.cross(bent[faces[:, 1]] - bent[faces[:, 0]], bent[faces[:, 2]] - bent[faces[:, 0]])
    assert (normals[:, 2] > 0).mean() > 0.9
    return Sheet(bent, faces), np.stack([s, y], axis=-1)


def turned(points: Floats, angle: float = 2.0) -> Floats:
    return points @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]) + [7.0, -3.0]


@pytest.mark.parametrize("axes", [V_UP, V_DOWN], ids=["v up", "v down"])
def test_a_perfect_flattening_scores_so_whichever_way_the_truths_v_runs(axes: Floats) -> None:
    sheet, flat = cylinder()
    figures = score_flattening(sheet, flat * axes, turned(flat))
    for name in ("flat_mean_mm", "flat_max_mm", "flat_rigid_mean_mm", "flat_rigid_max_mm", "flips"):
        assert figures[name] == pytest.approx(0.0, abs=1e-9)
    # Chords of 0.5 mm on a radius of 25 mm are shorter than their arcs by 1 - d^2 / 24 r^2.
    assert figures["stretch_inverse_linf"] == pytest.approx(1 + 0.5**2 / (24 * 25**2), rel=1e-7)


@pytest.mark.parametrize("axes", [V_UP, V_DOWN], ids=["v up", "v down"])
@pytest.mark.parametrize("mirror", [[-1.0, 1.0], [1.0, -1.0]], ids=["left to right", "top to bottom"])
def test_the_back_of_the_surface_is_mirrored_whichever_way_the_truths_v_runs(axes: Floats, mirror: Floats) -> None:
    sheet, flat = cylinder()
    with pytest.raises(StepError, match="mirrored"):
        score_flattening(sheet, flat * axes, turned(flat * mirror))


@pytest.mark.parametrize("axes", [V_UP, V_DOWN], ids=["v up", "v down"])
def test_a_page_is_looked_at_from_above_however_its_faces_are_wound(axes: Floats) -> None:
    sheet, flat = cylinder()
    assert sheet.faces is not None
    behind = Sheet(sheet.vertices, sheet.faces[:, ::-1])
    figures = score_flattening(behind, flat * axes, flat)
    assert figures == pytest.approx(score_flattening(sheet, flat * axes, flat))
    assert (figures["flips"], figures["flat_rigid_max_mm"]) == (0.0, 0.0)
    with pytest.raises(StepError, match="mirrored"):
        score_flattening(behind, flat * axes, flat * [-1.0, 1.0])


@pytest.mark.parametrize("axes", [V_UP, V_DOWN], ids=["v up", "v down"])
def test_a_surface_without_an_upper_side_is_looked_at_from_its_front(axes: Floats) -> None:
    """On edge nothing is above: the front is where the faces turn counterclockwise."""
    sheet, flat = cylinder()
    assert sheet.faces is not None
    on_edge = sheet.vertices[:, [0, 2, 1]] * [1.0, -1.0, 1.0]
    assert score_flattening(Sheet(on_edge, sheet.faces), flat * axes, turned(flat))["flat_rigid_max_mm"] < 1e-9
    behind = Sheet(on_edge, sheet.faces[:, ::-1])
    assert score_flattening(behind, flat * axes, flat * [-1.0, 1.0])["flat_rigid_max_mm"] < 1e-9
    with pytest.raises(StepError, match="mirrored"):
        score_flattening(behind, flat * axes, flat)


@pytest.mark.parametrize("axes", [V_UP, V_DOWN], ids=["v up", "v down"])
def test_a_file_scored_against_itself_is_perfect(axes: Floats) -> None:
    sheet, flat = cylinder()
    figures = score_flattening(sheet, flat * axes, flat * axes, same_axes=True)
    assert (figures["flat_rigid_max_mm"], figures["flips"]) == (0.0, 0.0)
    assert figures["area_error"] < 1e-3
    # A truth whose v runs up needs no grace, and none is given.
    assert score_flattening(sheet, flat * axes, flat, same_axes=True)["flat_rigid_max_mm"] < 1e-9
    with pytest.raises(StepError, match="mirrored"):
        score_flattening(sheet, flat, flat * V_DOWN, same_axes=True)


def test_scale_is_seen_rigidly_and_in_the_stretch_but_not_affinely() -> None:
    sheet, flat = cylinder()
    figures = score_flattening(sheet, flat, 1.02 * flat)
    radius = np.linalg.norm(flat - flat.mean(axis=0), axis=1)
    assert figures["flat_max_mm"] < 1e-9
    assert figures["flat_rigid_mean_mm"] == pytest.approx(0.02 * radius.mean())
    assert figures["stretch_inverse_linf"] == pytest.approx(1.02, abs=1e-4)
    assert figures["stretch_l2"] == pytest.approx(1 / 1.02, abs=1e-4)


def test_a_vertex_pulled_across_its_neighbours_is_a_flip() -> None:
    sheet, truth = cylinder()
    flat = truth.copy()
    flat[100] += [1.2, 0.0]
    figures = score_flattening(sheet, truth * V_DOWN, flat)
    assert figures["flips"] > 0
    assert figures["stretch_l2"] == np.inf


@pytest.mark.parametrize("axes", [V_UP, V_DOWN], ids=["v up", "v down"])
def test_faces_wound_otherwise_than_their_neighbours_are_no_folds(axes: Floats) -> None:
    sheet, flat = cylinder()
    assert sheet.faces is not None
    untidy = sheet.faces.copy()
    untidy[::7] = untidy[::7, ::-1]
    figures = score_flattening(Sheet(sheet.vertices, untidy), flat * axes, flat)
    assert figures == pytest.approx(score_flattening(sheet, flat * axes, flat))


def test_vertices_that_no_face_uses_do_not_count() -> None:
    sheet, flat = cylinder()
    more = Sheet(np.concatenate([sheet.vertices, [[9.0, 9, 9]]]), sheet.faces)
    with_stray = np.concatenate([flat, [[0.0, 0.0]]])
    assert score_flattening(more, with_stray, with_stray + np.array([0.0, 1.0]))["flat_rigid_max_mm"] < 1e-9
    with_stray[-1] = 500.0
    assert score_flattening(more, np.concatenate([flat, [[0.0, 0.0]]]), with_stray)["flat_rigid_max_mm"] < 1e-9


def test_wrong_inputs_are_refused() -> None:
    sheet, flat = cylinder()
    with pytest.raises(InputError, match=r"`flat` must have shape \(567, 2\), got \(566, 2\)"):
        score_flattening(sheet, flat, flat[1:])
    with pytest.raises(InputError, match="`truth` must be finite"):
        score_flattening(sheet, flat * np.nan, flat)
    with pytest.raises(InputError, match=r"`truth` must lie within 1e\+09 mm of the origin"):
        score_flattening(sheet, flat * 1e200, flat)
    for nothing in (flat * 0.0, flat * [1.0, 0.0], flat * 1e-200):
        with pytest.raises(InputError, match="`truth` must span a plane"):
            score_flattening(sheet, nothing, flat)
        with pytest.raises(InputError, match="`flat` must span a plane"):
            score_flattening(sheet, flat, nothing)
    with pytest.raises(InputError, match="`sheet` must be a triangle mesh, got a grid"):
        score_flattening(Sheet(sheet.vertices.reshape(7, 81, 3)), flat, flat)

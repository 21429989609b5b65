from __future__ import annotations

import numpy as np
import pytest

from deskew.errors import InputError
from deskew.flattening.chords import chord_lengths
from deskew.flattening.sections import section_lengths, unfolded_lengths
from deskew.flattening.settings import SpringSettings
from deskew.flattening.springs import grid_springs
from deskew.types import Array, Sheet
from tests.flattening.bent_sheets import cylinder, flat_grid


def joined(grid: tuple[int, int]) -> set[frozenset[int]]:
    """Every pair that figure 2b joins, found by asking each two vertices of each quad."""
    index = np.arange(grid[0] * grid[1]).reshape(grid)
    quads = [index[r : r + 2, c : c + 2].ravel() for r in range(grid[0] - 1) for c in range(grid[1] - 1)]
    return {frozenset((int(a), int(b))) for quad in quads for a in quad for b in quad if a != b}


@pytest.mark.parametrize("grid", [(2, 2), (2, 5), (4, 3), (6, 7)])
def test_every_quad_has_its_hull_and_both_diagonals_once(grid: tuple[int, int]) -> None:
    a, b, rest, k_s = grid_springs(Sheet(flat_grid(grid)), SpringSettings(3.0)).pairs()
    pairs = [frozenset((int(i), int(j))) for i, j in zip(a, b, strict=True)]
    assert len(pairs) == len(set(pairs))
    assert set(pairs) == joined(grid)
    assert (rest > 0).all()
    assert (k_s == 3.0).all()


def test_rest_lengths_are_the_chords_of_the_scan() -> None:
    vertices = flat_grid() + np.random.default_rng(1).normal(0, 1, (9, 11, 3))
    a, b, rest, _ = grid_springs(Sheet(vertices), SpringSettings(1.0)).pairs()
    points = vertices.reshape(-1, 3)
    np.testing.assert_allclose(rest, np.linalg.norm(points[a] - points[b], axis=1), rtol=1e-14)


def test_stiffness_of_a_quad_reaches_only_its_own_springs() -> None:
    stiffness = np.ones((8, 10))
    stiffness[3, 4] = 9.0
    a, b, _, k_s = grid_springs(Sheet(flat_grid(), stiffness=stiffness), SpringSettings(100.0)).pairs()
    index = np.arange(99).reshape(9, 11)
    corners = set(index[3:5, 4:6].ravel().tolist())
    changed = {frozenset((int(i), int(j))) for i, j, k in zip(a, b, k_s, strict=True) if k != 1.0}
    assert changed == {frozenset((i, j)) for i in corners for j in corners if i != j}
    assert sorted(k_s[k_s != 1.0].tolist()) == [5.0, 5.0, 5.0, 5.0, 9.0, 9.0]


def test_springs_on_the_border_take_their_only_quads_stiffness() -> None:
    stiffness = np.full((8, 10), 2.0)
    assert set(grid_springs(Sheet(flat_grid(), stiffness=stiffness), SpringSettings(1.0)).pairs()[3].tolist()) == {2.0}


def test_coincident_neighbours_are_refused() -> None:
    vertices = flat_grid()
    vertices[2, 3] = vertices[3, 4]
    with pytest.raises(InputError, match=r"`vertices` must be distinct .* got 1 coincident pairs"):
        grid_springs(Sheet(vertices), SpringSettings(1.0))


def test_triangle_mesh_is_refused() -> None:
    mesh = Sheet(np.eye(3), faces=np.array([[0, 1, 2]]))
    with pytest.raises(InputError, match=r"`sheet` must be an \(R, C, 3\) grid"):
        grid_springs(mesh, SpringSettings(1.0))


def test_a_cut_quad_has_no_springs_of_its_own_and_its_neighbours_keep_theirs() -> None:
    x, y = np.meshgrid(np.arange(5.0), np.arange(4.0))
    cut = np.zeros((3, 4), dtype=bool)
    cut[:, 2] = True
    springs = grid_springs(Sheet(np.stack([x, y, 0 * x], -1), cut=cut), SpringSettings(10.0))
    assert np.array_equal(springs.cut, cut)
    a, b, rest, k_s = springs.pairs()
    joined = k_s > 0
    assert np.array_equal(joined, rest > 0)
    assert not (joined & ((a % 5 <= 2) != (b % 5 <= 2))).any()  # nothing joins the two pieces
    left, right = joined & (a % 5 <= 2), joined & (a % 5 > 2)
    for piece, columns in ((left, 3), (right, 2)):  # each has every spring of a sheet of its own
        assert piece.sum() == 4 * (columns - 1) + 3 * columns + 2 * 3 * (columns - 1)


def test_a_sheet_in_one_piece_has_the_springs_of_a_sheet_that_says_nothing() -> None:
    x, y = np.meshgrid(np.arange(5.0), np.arange(4.0))
    vertices = np.stack([x, y, np.sin(x)], -1)
    plain = grid_springs(Sheet(vertices), SpringSettings(10.0))
    told = grid_springs(Sheet(vertices, cut=np.zeros((3, 4), dtype=bool)), SpringSettings(10.0))
    assert np.array_equal(plain.k_s, told.k_s)
    assert np.array_equal(plain.rest, told.rest)


def test_sections_follow_an_arc_and_chords_cut_it_short() -> None:
    bent, _ = cylinder(20.0, (9, 161))
    coarse = Sheet(bent[::8, ::8], surface=bent)
    arc = 100.0 / 20
    section = grid_springs(coarse, SpringSettings(rest="section")).rest[0, :, :-1]
    chord = grid_springs(coarse, SpringSettings(rest="chord")).rest[0, :, :-1]
    assert np.abs(section / arc - 1).max() < 1e-4
    assert np.all(chord < arc * (1 - 2e-3))


def ridge(place: float, noise_mm: float = 0.0) -> Array:
    """A sheet of 100 x 60 mm with one crease of 50 degrees across it, 49 x 29 vertices, exactly isometric."""
    flat = flat_grid((29, 49), (100.0, 60.0))
    across = np.array([0.94, -0.342, 0.0])
    beyond = flat @ across - place
    steep = np.radians(25.0)
    bent = flat + ((np.cos(steep) - 1.0) * beyond)[..., None] * across
    bent[..., 2] -= np.sin(steep) * np.abs(beyond)
    return bent + np.random.default_rng(0).normal(0.0, noise_mm, bent.shape) * [0, 0, 1]


def test_unfolded_lengths_give_back_on_average_what_chords_cut_off_at_a_crease() -> None:
    true = chord_lengths(flat_grid((8, 13), (100.0, 60.0)))
    cut, left = [], []
    for place in np.linspace(30.0, 70.0, 41):
        surface = ridge(place)
        cut.append((true - section_lengths(surface, 4)).sum())
        left.append((true - unfolded_lengths(surface, 4)).sum())
    assert np.mean(cut) > 1.0
    assert abs(np.mean(left)) < 0.1 * np.mean(cut)


def test_a_surface_that_noise_makes_longer_is_followed_no_further_than_it_pays() -> None:
    true = chord_lengths(flat_grid((8, 13), (100.0, 60.0)))
    for place in (37.0, 50.0, 61.0):
        noisy = ridge(place, 0.4)
        longer = section_lengths(noisy, 4).sum() - true.sum()
        assert longer > 20.0  # of 1,600 mm of springs
        assert abs(unfolded_lengths(noisy, 4).sum() - true.sum()) < 0.4 * longer


@pytest.mark.parametrize(("rows", "columns"), [(5, 7), (3, 3)])
def test_springs_of_two_steps_join_vertices_two_apart(rows: int, columns: int) -> None:
    sheet = Sheet(flat_grid((rows, columns), (6.0 * (columns - 1), 6.0 * (rows - 1))))
    a, b, rest, k_s = grid_springs(sheet, SpringSettings(2.0, bending=0.5, more=0.25)).pairs()
    places = sheet.vertices.reshape(-1, 3)
    assert np.allclose(np.linalg.norm(places[a] - places[b], axis=1), rest)
    lengths, counts = np.unique(np.round(rest, 6), return_counts=True)
    assert np.allclose(lengths, [6.0, 6 * np.sqrt(2), 12.0, 12 * np.sqrt(2)])
    shear = (rows - 1) * (columns - 1) * 2
    far = rows * (columns - 2) + (rows - 2) * columns, 2 * (rows - 2) * (columns - 2)
    assert counts.tolist() == [rows * (columns - 1) + (rows - 1) * columns, shear, *far]
    assert set(k_s[np.isclose(rest, 12.0)]) == {1.0}
    assert set(k_s[np.isclose(rest, 12 * np.sqrt(2))]) == {0.5}

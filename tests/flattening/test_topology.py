from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from deskew.errors import InputError
from deskew.flattening.edges import border_loops, edges_of
from deskew.flattening.meshes import flatten_mesh
from deskew.flattening.topology import disc_of
from deskew.types import Array, Sheet, Status
from tests.flattening.bent_meshes import error_mm, folded_mesh, halves, irregular_fold, moebius, torus

N = 12
V, F, FLAT = folded_mesh(N)


def two_pieces() -> tuple[Array, Array]:
    return np.concatenate([V, V + 500.0]), np.concatenate([F, F + len(V)])


def bow_tie() -> tuple[Array, Array]:
    other = F + len(V)
    return np.concatenate([V, V + 500.0]), np.concatenate([F, np.where(other == len(V), len(V) - 1, other)])


def crowded() -> tuple[Array, Array]:
    return np.concatenate([V, [[0.0, 0.0, 99.0]]]), np.concatenate([F, [[N + 5, N + 6, len(V)]]])


def handle() -> tuple[Array, Array]:
    vertices, faces = torus()
    return vertices, faces[1:]


def line() -> tuple[Array, Array]:
    return V * (1.0, 0.0, 0.0), F


REFUSED: dict[str, tuple[Callable[[], tuple[Array, Array]], str]] = {
    "closed": (torus, "must have a border, got a closed surface"),
    "pieces": (two_pieces, "must be one piece, got 2 pieces"),
    "edge": (crowded, "at most two faces at an edge, got 1 non-manifold edges"),
    "bow tie": (bow_tie, r"one fan of faces at a vertex, got 1 non-manifold vertices \(bow ties\)"),
    "moebius": (moebius, "must have two sides, got a surface with one side"),
    "handle": (handle, "lie flat as a disc with holes, got 1 handles"),
    "point": (lambda: (0 * V, F), "not all lie in one place"),
    "speck": (lambda: (1e-12 * V, F), "not all lie in one place, within 1e-09 mm"),
    "line": (line, "must span an area"),
    "corners": (lambda: (V, np.array([[0, 0, 1]])), "corners given twice only"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refuses_by_name_what_cannot_lie_flat(name: str) -> None:
    make, message = REFUSED[name]
    with pytest.raises(InputError, match=message):
        flatten_mesh(Sheet(*make()))


def test_edges_are_sorted_pairs_and_know_their_faces() -> None:
    edges = edges_of(F)
    keys = [tuple(e) for e in edges.ends.tolist()]
    assert keys == sorted(set(keys))
    assert all(a < b for a, b in keys)
    for k in range(3):
        pairs = np.sort(F[:, (k, (k + 1) % 3)], axis=1)
        np.testing.assert_array_equal(edges.ends[edges.of_face[:, k]], pairs)
    inner = np.flatnonzero(edges.opposite >= 0)
    np.testing.assert_array_equal(edges.opposite[edges.opposite[inner]], inner)
    assert (edges.opposite < 0).sum() == 4 * (N - 1)


def test_border_loops_follow_the_border_longest_first() -> None:
    centres = FLAT[F].mean(axis=1)
    faces = F[np.hypot(*(centres - FLAT.mean(axis=0)).T) > 50]
    loops = border_loops(faces, edges_of(faces))
    assert len(loops) == 2
    assert len(loops[0]) == 4 * (N - 1) > len(loops[1])
    for loop in loops:
        start, end = faces[loop // 3, loop % 3], faces[loop // 3, (loop + 1) % 3]
        np.testing.assert_array_equal(end, np.roll(start, -1))


def test_coincident_neighbours_are_healed_with_a_count() -> None:
    vertices = V.copy()
    vertices[40], vertices[0] = vertices[41], vertices[1]
    found = flatten_mesh(Sheet(vertices, F))
    assert found.status is Status.AT_REST
    assert found.counters["healed_vertices"] == 2
    assert found.counters["healed_faces"] == 4 - 1  # the corner vertex has one face on that edge
    np.testing.assert_array_equal(found.vertices[40], found.vertices[41])


def test_a_far_vertex_without_a_face_merges_no_others() -> None:
    disc = disc_of(Sheet(np.concatenate([1e-2 * V, [[1e9, 0.0, 0.0]]]), F))
    assert (len(disc.vertices), disc.counts["healed_vertices"]) == (len(V), 1)


def test_unjoined_triangles_are_joined() -> None:
    soup = Sheet(V[F].reshape(-1, 3), np.arange(3 * len(F)).reshape(-1, 3))
    found = flatten_mesh(soup)
    whole = flatten_mesh(Sheet(V, F))
    assert found.counters["healed_vertices"] == 3 * len(F) - len(V)
    assert error_mm(found.vertices, whole.vertices[F, :2].reshape(-1, 2)).max() < 1e-3


def test_touching_ends_of_a_roll_stay_apart() -> None:
    angle, y = np.meshgrid(np.linspace(0, 2 * np.pi, 41), np.linspace(0, -20, 6))
    vertices = np.stack([10 * np.cos(angle), y, 10 * np.sin(angle)], axis=-1)
    vertices[:, -1] = vertices[:, 0]
    found = flatten_mesh(Sheet(vertices.reshape(-1, 3), halves(6, 41)))
    assert found.status is Status.AT_REST
    assert found.counters["healed_vertices"] == 0
    chord = 20 * np.sin(np.pi / 40)
    assert error_mm(found.vertices, np.stack([angle / angle[0, 1] * chord, y], axis=-1).reshape(-1, 2)).max() < 1e-9


def test_repeated_faces_are_dropped_and_turned_ones_turned_back() -> None:
    clean = flatten_mesh(Sheet(V, F)).vertices
    repeated = flatten_mesh(Sheet(V, np.concatenate([F, F[:5, (1, 2, 0)], [[3, 3, 4]]])))
    assert repeated.counters["healed_faces"] == 6
    np.testing.assert_allclose(repeated.vertices, clean, atol=1e-9)
    faces = F.copy()
    faces[::5] = faces[::5, ::-1]
    turned = flatten_mesh(Sheet(V, faces))
    assert turned.counters["healed_faces"] == len(F[::5])
    np.testing.assert_allclose(turned.vertices, clean, atol=1e-9)


def test_vertex_without_a_face_lies_at_its_nearest_neighbours_place() -> None:
    found = flatten_mesh(Sheet(np.concatenate([V, V[17:18] + 0.1]), F))
    assert found.counters["healed_vertices"] == 1
    np.testing.assert_array_equal(found.vertices[-1], found.vertices[17])


@pytest.mark.parametrize("energy", ["arap", "springs"])
def test_needles_break_nothing(energy: str) -> None:
    vertices, faces, _ = irregular_fold(200)
    mid = (vertices[faces[50, 0]] + vertices[faces[50, 1]]) / 2
    # A vertex on an edge, joined to one of its faces: the other one becomes a face and one without area.
    a, b, c = faces[50]
    n = len(vertices)
    faces = np.concatenate([np.delete(faces, 50, axis=0), [[a, n, c], [n, b, c], [a, b, n]]])
    found = flatten_mesh(Sheet(np.concatenate([vertices, mid[None]]), faces), energy=energy)
    assert np.isfinite(found.vertices).all()
    assert found.counters["healed_faces"] == 1
    assert found.status is Status.AT_REST


def test_disc_maps_every_vertex_and_face_back() -> None:
    disc = disc_of(Sheet(V, F))
    np.testing.assert_array_equal(disc.representative, np.arange(len(V)))
    np.testing.assert_array_equal(disc.faces, F[disc.kept])

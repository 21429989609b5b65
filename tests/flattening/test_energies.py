from __future__ import annotations

import numpy as np
import pytest

from deskew.flattening.edges import edges_of
from deskew.flattening.energies import ENERGIES, Energy
from deskew.flattening.intrinsic import bearings, triangles
from deskew.flattening.laplace import Laplacian, laplacian
from deskew.types import Array
from tests.flattening.bent_meshes import irregular_fold

V, F, FLAT = irregular_fold(60)
EDGES = edges_of(F)
LENGTHS = np.linalg.norm(V[EDGES.ends[:, 1]] - V[EDGES.ends[:, 0]], axis=1)
SHAPES = triangles(LENGTHS, EDGES)


def built(name: str) -> tuple[Energy, Array]:
    model = ENERGIES[name](SHAPES, F, EDGES, np.random.default_rng(1).uniform(0.5, 2.0, len(F)))
    return model, laplacian(EDGES.ends, model.weights, len(V)).toarray()


@pytest.mark.parametrize("name", ENERGIES)
def test_pull_is_what_the_laplacian_lacks_of_the_gradient(name: str) -> None:
    model, L = built(name)
    x = FLAT * 1.1 + np.random.default_rng(0).normal(0, 1, FLAT.shape)
    v = np.random.default_rng(2).normal(0, 1, FLAT.shape)
    h = 1e-5
    slope = (model.value(x + h * v) - model.value(x - h * v)) / (2 * h)
    assert slope == pytest.approx(((L @ x - model.pull(x)) * v).sum(), rel=1e-7)


@pytest.mark.parametrize("name", ENERGIES)
def test_softening_completes_the_hessian_where_nothing_is_compressed(name: str) -> None:
    model, L = built(name)
    x, h = FLAT * 3.0, 1e-4
    v = np.random.default_rng(2).normal(0, 1, FLAT.shape)
    vertices, terms = model.softening(x)
    along = (terms * v[vertices]).sum(axis=(1, 2))
    curved = (L @ v * v).sum() - (along**2).sum()
    numeric = (((L @ (2 * h * v)) - model.pull(x + h * v) + model.pull(x - h * v)) * v).sum() / (2 * h)
    assert curved == pytest.approx(numeric, rel=1e-6)


@pytest.mark.parametrize("name", ENERGIES)
def test_hessian_stays_positive_where_faces_are_compressed(name: str) -> None:
    model, L = built(name)
    vertices, terms = model.softening(FLAT * 0.3)
    H = np.kron(L, np.eye(2))
    for at, g in zip(vertices, terms, strict=True):
        index = (2 * at[:, None] + np.arange(2)).ravel()
        H[np.ix_(index, index)] -= np.outer(g, g)
    assert np.linalg.eigvalsh(H)[0] > -1e-9 * np.abs(H).max()


def test_triangles_keep_their_lengths_areas_and_angles() -> None:
    a, x, y = SHAPES.laid.T
    sides = np.stack([a, np.hypot(x - a, y), np.hypot(x, y)], axis=-1)
    np.testing.assert_allclose(sides, LENGTHS[EDGES.of_face], rtol=1e-12)
    areas = np.linalg.norm(np.cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]]), axis=1) / 2
    np.testing.assert_allclose(SHAPES.areas, areas, rtol=1e-9)
    u, v = V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]]
    np.testing.assert_allclose(SHAPES.cotangents[:, 1], (u * v).sum(axis=1) / (2 * areas), rtol=1e-7, atol=1e-9)


def test_bearings_of_a_plane_are_its_directions() -> None:
    d = FLAT[EDGES.ends[:, 1]] - FLAT[EDGES.ends[:, 0]]
    shapes = triangles(np.hypot(*d.T), EDGES)
    bearing = bearings(shapes, F, EDGES, len(V))
    true = np.stack([np.arctan2(d[:, 1], d[:, 0]), np.arctan2(-d[:, 1], -d[:, 0])], axis=-1)
    turn = np.zeros((len(V), 1), complex)
    np.add.at(turn, EDGES.ends.ravel(), np.exp(1j * (true - bearing)).reshape(-1, 1))
    turn = turn[:, 0] / np.abs(turn[:, 0])
    left = np.exp(1j * (bearing - true)) * turn[EDGES.ends] - 1
    assert 0 < np.abs(left).max() < 1e-7


def test_laplacian_is_solved_with_mean_zero() -> None:
    pull = np.random.default_rng(0).normal(0, 1, (len(V), 2))
    pull -= pull.mean(axis=0)
    system = Laplacian(EDGES.ends, SHAPES.lengths, len(V))
    x = system.solve(pull)
    np.testing.assert_allclose(system.matrix @ x, pull, atol=1e-10)
    np.testing.assert_allclose(x.mean(axis=0), 0, atol=1e-12)

from __future__ import annotations

import numpy as np
import pytest

from deskew.flattening.multigrid import coarse_index, coarse_size, framed, hierarchy, prolong, unframed, v_cycle
from deskew.flattening.springs import Springs, spring_constants
from deskew.types import Array

SHAPES = [(9, 11), (8, 10), (12, 7), (3, 30), (2, 100), (6, 6)]


def laplacian(k_s: Array) -> Array:
    """Sum of k (e_a - e_b)(e_a - e_b)^T over the springs, from their list."""
    a, b, _, k = Springs(np.zeros_like(k_s), k_s).pairs()
    matrix = np.zeros((k_s[0].size, k_s[0].size))
    for i, j, value in zip(a, b, k, strict=True):
        matrix[np.ix_((i, j), (i, j))] += value * np.array([[1.0, -1.0], [-1.0, 1.0]])
    return matrix


def uneven(shape: tuple[int, int]) -> Array:
    quads = np.random.default_rng(4).uniform(0.5, 2.0, (shape[0] - 1, shape[1] - 1))
    return spring_constants(shape, 1.0, quads)


@pytest.mark.parametrize("shape", SHAPES)
def test_cycles_solve_the_springs_laplacian(shape: tuple[int, int]) -> None:
    k_s = uneven(shape)
    matrix, levels = laplacian(k_s), hierarchy(k_s)
    force = np.random.default_rng(1).normal(size=(*shape, 2))
    force -= force.mean(axis=(0, 1))
    x = np.zeros_like(force)
    left = [np.linalg.norm(force)]
    for _ in range(12):
        levels.levels[0].force[:] = framed(force - (matrix @ x.reshape(-1, 2)).reshape(x.shape))
        v_cycle(levels)
        x += unframed(levels.levels[0].correction)
        left.append(float(np.linalg.norm(force - (matrix @ x.reshape(-1, 2)).reshape(x.shape))))
    assert 0 <= left[-1] < 1e-5 * left[0]
    # A geometric hierarchy gains a factor that does not depend on the grid: here four a cycle.
    assert left[6] < 0.4**5 * left[1] + 1e-12


@pytest.mark.parametrize("shape", [(9, 11), (8, 10), (12, 7)])
def test_coarse_matrix_is_the_galerkin_product(shape: tuple[int, int]) -> None:
    k_s = uneven(shape)
    fine, coarse = hierarchy(k_s).levels[:2]
    n = coarse.grid[0] * coarse.grid[1]
    prolongation = np.zeros((k_s[0].size, n))
    for i in range(n):
        unit = np.zeros((n, 2))
        unit[i] = 1.0
        column = framed(np.zeros((*fine.grid, 2)))
        prolong(framed(unit.reshape(*coarse.grid, 2)), column)
        prolongation[:, i] = unframed(column)[..., 0].ravel()
    assert np.allclose(prolongation.sum(axis=1), 1.0)
    w = coarse.weights[1:-1, 1:-1]
    families = np.zeros((4, *coarse.grid))
    families[0], families[1], families[2] = w[..., 0], w[..., 1], w[..., 2]
    families[3, :, :-1] = w[:, 1:, 3]
    assert np.allclose(laplacian(families), prolongation.T @ laplacian(k_s) @ prolongation, atol=1e-12)


@pytest.mark.parametrize("n", [2, 3, 4, 5, 44, 45])
def test_coarse_grid_keeps_both_ends(n: int) -> None:
    kept = coarse_index(n)
    assert len(kept) == coarse_size(n)
    assert (kept[0], kept[-1]) == (0, n - 1)
    assert set(np.diff(kept)) <= {1, 2}


def test_force_on_a_cut_off_vertex_breaks_nothing() -> None:
    cut = np.zeros((8, 8), dtype=bool)
    cut[3:5, 3:5] = True
    k_s = spring_constants((9, 9), 1.0, cut=cut)
    levels = hierarchy(k_s)
    levels.levels[0].force[:, 1:-1, 1:-1] = 1.0
    v_cycle(levels)
    assert np.isfinite(levels.levels[0].correction).all()

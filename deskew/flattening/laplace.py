"""Weighted Laplacians of meshes, factored once."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.sparse import coo_array, csc_array
from scipy.sparse.linalg import SuperLU, splu

from deskew.flattening.edges import Indices
from deskew.types import Floats


def factor(matrix: Any) -> SuperLU:
    """Factor a symmetric positive definite sparse matrix without pivoting, in an order of least degree."""
    return splu(csc_array(matrix), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})


def laplacian(ends: Indices, weights: Floats, n_vertices: int) -> csc_array:
    """Matrix (V, V) of the quadratic form sum of w (x_b - x_a)^2 over the edges (E, 2)."""
    a, b = ends[:, 0], ends[:, 1]
    diagonal = np.bincount(a, weights, n_vertices) + np.bincount(b, weights, n_vertices)
    own = np.arange(n_vertices)
    rows = np.concatenate([a, b, own])
    columns = np.concatenate([b, a, own])
    values = np.concatenate([-weights, -weights, diagonal])
    return csc_array(coo_array((values, (rows, columns)), shape=(n_vertices, n_vertices)))


class Laplacian:
    """A factored Laplacian of a connected mesh; its solutions have mean 0.

    Parameters
    ----------
    ends : (E, 2) int array
        Vertices of each edge.
    weights : (E,) array
        Weight of each edge.
    n_vertices : int
        V, at least 2.
    """

    def __init__(self, ends: Indices, weights: Floats, n_vertices: int) -> None:
        inner = ends[:, 1] < n_vertices - 1  # the last vertex is held: constants cost nothing
        held = ends[~inner, 0]
        matrix = laplacian(ends[inner], weights[inner], n_vertices - 1)
        extra = np.bincount(held, weights[~inner], n_vertices - 1)
        matrix.setdiag(matrix.diagonal() + extra)
        self._lu = factor(matrix)
        self._ends, self._weights, self._n_vertices = ends, weights, n_vertices

    @property
    def matrix(self) -> csc_array:
        """The Laplacian itself, (V, V)."""
        return laplacian(self._ends, self._weights, self._n_vertices)

    def solve(self, pull: Floats) -> Floats:
        """Solve for (V, n) values with mean 0 from a right-hand side (V, n) that sums to 0."""
        out = np.zeros_like(pull)
        out[:-1] = self._lu.solve(pull[:-1])
        return np.asarray(out - out.mean(axis=0))

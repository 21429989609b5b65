"""Grids that a plate is relaxed on: flat, from one density to the next, and turned back into a page on the bed.

A plate's grid has its longer axis first, a page's its rows (see :mod:`data_synth.plate`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from data_synth.folds import best_rotation
from data_synth.plate import Plate, unbent, unchanged
from data_synth.sheets import page_grid_of, to_world
from deskew.types import Floats

_LEAST_THICKNESS = 0.06  # of the spacing: a ridge narrower than a cell would cling to the grid


@dataclass(frozen=True, slots=True)
class Handles:
    """Points of a sheet that springs pull to heights.

    Attributes
    ----------
    places : (k, 2) array
        As shares of the (long, short) side.
    heights : (k,) array
        In [-1, 1], in units of an amplitude.
    pull : float
        Stiffness of each spring, in units of the membrane's.
    """

    places: Floats
    heights: Floats
    pull: float

    def on(self, shape: tuple[int, int], amplitude_mm: float) -> tuple[Floats, Floats]:
        """Stiffness and height of the spring at each vertex of a grid: two (n, m) arrays."""
        pull, heights = np.zeros(shape), np.zeros(shape)
        at = tuple(np.round(self.places * (np.array(shape) - 1)).astype(int).T)
        pull[at], heights[at] = self.pull, amplitude_mm * self.heights
        return pull, heights


def flat_plate(shape: tuple[int, int], sizes: tuple[float, float]) -> Floats:
    """Return the flat page of `sizes` (along, across) centred over the origin: (n, m, 3) [mm]."""
    x, y = (np.linspace(-size / 2, size / 2, n) for size, n in zip(sizes, shape, strict=True))
    return np.stack([*np.meshgrid(x, y, indexing="ij"), np.zeros(shape)], axis=-1)


def free_plate(shape: tuple[int, int], sizes: tuple[float, float], thickness_mm: float) -> Plate:
    """Return a sheet on a grid of `shape` that nothing bends, pulls or has grown.

    Its thickness is at least .06 of the spacing.
    """
    spacing = (sizes[0] / (shape[0] - 1), sizes[1] / (shape[1] - 1))
    thickness = max(thickness_mm, _LEAST_THICKNESS * max(spacing))
    return Plate(spacing, thickness, unbent(shape), np.zeros(shape), np.zeros(shape), unchanged(shape))


def levelled(vertices: Floats, page_size_mm: tuple[float, float], turned: bool) -> Floats:
    """Turn a sheet (rows, columns, 3) as it best fits the page lying flat on the bed.

    Parameters
    ----------
    vertices : (rows, columns, 3) array
        A plate with its axes in the page's order [mm].
    page_size_mm : (width, height)
        Page [mm].
    turned : bool
        Whether those axes had to be swapped.
    """
    target = to_world(page_grid_of((vertices.shape[0], vertices.shape[1]), page_size_mm), page_size_mm).reshape(-1, 3)
    # In here v rises where the page's Y falls, and a turned grid has its axes swapped: both are undone by signs.
    points = vertices.reshape(-1, 3).copy()
    points = points if turned else points[:, [1, 0, 2]]
    points[:, 1] *= -1
    R = best_rotation(points - points.mean(axis=0), target)
    return np.asarray(np.einsum("kj,ij->ki", points, R)).reshape(vertices.shape)

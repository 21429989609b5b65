"""Energy of a bent sheet on a grid: St. Venant-Kirchhoff membrane and a thin plate with plastic rest curvature.

Stiffnesses are in units of the membrane's ``E t / (1 - nu^2)``, so energies are in mm^2. Grids here are stored with the
longer axis first: unknown ``3 (p n_short + q) + component`` then gives the narrowest band.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from data_synth.plate_sums import add_bending, add_membrane, add_pull, total_energy
from deskew.types import Floats


@dataclass(frozen=True, slots=True)
class Plate:
    """A sheet's material, rest curvature and the heights that it is pulled to.

    Attributes
    ----------
    spacing_mm : (along, across)
        Distance of neighbours along the first and the second axis of the grid [mm].
    thickness_mm : float
        Of the paper; a plate bends with ``thickness^2 / 12`` of what it stretches with.
    rest : (along (n, m), across (n, m), twist (n - 1, m - 1)) arrays
        Rest curvatures [1/mm]: along and across at the vertices, twist at the cells' centres.
    pull : (n, m) array
        Stiffness of the spring that holds each vertex at a height; 0 where free.
    heights : (n, m) array
        Those heights [mm].
    growth : (n - 1, m - 1) array
        Lengths that each cell wants over those of the grid: the membrane's rest metric, 1 where nothing changed size.
        Where it varies the sheet fits no plane, and buckles (Klein, Efrati, Sharon, Science 315, 2007).
    """

    spacing_mm: tuple[float, float]
    thickness_mm: float
    rest: tuple[Floats, Floats, Floats]
    pull: Floats
    heights: Floats
    growth: Floats

    @property
    def bending(self) -> float:
        """Bending over membrane stiffness [mm^2]."""
        return self.thickness_mm**2 / 12


def unbent(shape: tuple[int, int]) -> tuple[Floats, Floats, Floats]:
    """Rest curvature of a page that never yielded."""
    n, m = shape
    return np.zeros((n, m)), np.zeros((n, m)), np.zeros((n - 1, m - 1))


def unchanged(shape: tuple[int, int]) -> Floats:
    """Growth of a page whose every cell kept its size."""
    return np.ones((shape[0] - 1, shape[1] - 1))


def normals(x: Floats) -> tuple[Floats, Floats]:
    """Return the unit normals of a grid (n, m, 3) at its vertices (n, m, 3) and cells (n - 1, m - 1, 3)."""
    vertex = np.cross(np.gradient(x, axis=0), np.gradient(x, axis=1))
    cell = np.cross(x[1:, 1:] - x[:-1, :-1], x[:-1, 1:] - x[1:, :-1])
    return (
        vertex / np.linalg.norm(vertex, axis=-1, keepdims=True),
        cell / np.linalg.norm(cell, axis=-1, keepdims=True),
    )


def curvatures(x: Floats, spacing_mm: tuple[float, float]) -> tuple[Floats, Floats, Floats]:
    """Second fundamental form of a grid: along and across (n, m), 0 on the borders they lack, and twist at cells.

    On an isometric surface ``x_uu``, ``x_uv`` and ``x_vv`` point along the normal, so that these are all of them.
    """
    a, b = spacing_mm
    at_vertex, at_cell = normals(x)
    along, across, twist = unbent((x.shape[0], x.shape[1]))
    along[1:-1] = ((x[:-2] - 2 * x[1:-1] + x[2:]) * at_vertex[1:-1]).sum(-1) / a**2
    across[:, 1:-1] = ((x[:, :-2] - 2 * x[:, 1:-1] + x[:, 2:]) * at_vertex[:, 1:-1]).sum(-1) / b**2
    twist[:] = ((x[1:, 1:] - x[1:, :-1] - x[:-1, 1:] + x[:-1, :-1]) * at_cell).sum(-1) / (a * b)
    return along, across, twist


def yielded(x: Floats, plate: Plate, yield_curvature: float) -> tuple[Floats, Floats, Floats]:
    """Rest curvature after plastic flow: where the elastic part exceeds the yield, the rest follows.

    Parameters
    ----------
    x : (n, m, 3) array
        Sheet [mm].
    plate : Plate
        Its rest curvature before.
    yield_curvature : float
        Largest elastic curvature, as the Frobenius norm of the curvature tensor [1/mm].
    """
    bent = curvatures(x, plate.spacing_mm)
    along, across, twist = (now - rest for now, rest in zip(bent, plate.rest, strict=True))
    # A border vertex has no second difference across the border, and a corner cell's twist stands for its corner.
    around = np.pad(twist**2, 1, mode="edge")
    twist2 = (around[1:, 1:] + around[1:, :-1] + around[:-1, 1:] + around[:-1, :-1]) / 4
    size = np.sqrt(along**2 + across**2 + 2 * twist2)
    share = np.maximum(0.0, 1.0 - yield_curvature / np.maximum(size, 1e-12))
    in_cells = (share[1:, 1:] + share[1:, :-1] + share[:-1, 1:] + share[:-1, :-1]) / 4
    rest = plate.rest
    return rest[0] + share * along, rest[1] + share * across, rest[2] + in_cells * twist


def energy(x: Floats, plate: Plate, at: tuple[Floats, Floats] | None = None) -> float:
    """Energy of a sheet (n, m, 3) [mm^2]; rest curvatures act along the normals `at`, by default its own."""
    a, b = plate.spacing_mm
    vertex, cell = normals(x) if at is None else at
    return float(
        total_energy(x, a, b, plate.bending, *plate.rest, vertex, cell, plate.pull, plate.heights, plate.growth)
    )


def derivatives(x: Floats, plate: Plate, at: tuple[Floats, Floats], band: Floats) -> Floats:
    """Gradient (3 n m,) of the energy with the normals held, and its positive semidefinite Hessian.

    Holding the normals costs nothing to first order: on an isometric surface the plate's moment points along the
    normal, and the normal moves across itself. The membrane's compressive stress is left out of the Hessian, as in
    projected Newton methods (Teran et al., Robust quasistatic finite elements and flesh simulation, SCA 2005).

    Parameters
    ----------
    x : (n, m, 3) array
        Sheet [mm].
    plate : Plate
        Its material.
    at : arrays
        From :func:`normals`.
    band : (3 n m, 6 m + 1) array
        Filled with the lower triangle: ``band[j, i - j]`` is the entry of row i and column j.
    """
    gradient = np.zeros(x.size)
    band[:] = 0.0
    a, b = plate.spacing_mm
    add_membrane(x, a, b, plate.growth, gradient, band)
    add_bending(x, a, b, plate.bending, *plate.rest, *at, gradient, band)
    add_pull(x, plate.pull, plate.heights, gradient, band)
    return gradient


def band_width(shape: tuple[int, int]) -> int:
    """Columns of the band that :func:`derivatives` fills for a grid of `shape`."""
    return 6 * shape[1] + 1

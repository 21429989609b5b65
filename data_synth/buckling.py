"""A page of two materials, one of which changed size: its rest metric fits no plane any more, and the sheet buckles.

The forward model is the plate of :mod:`data_synth.plate` with a growth that varies over the page; it bends elastically,
and nothing but the growth shapes it: handles that move it by 2 mm only choose which way it buckles, and are let go.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from data_synth.leaf import Leaf
from data_synth.plate import Plate
from data_synth.plate_grids import Handles, flat_plate, free_plate, levelled
from data_synth.relaxation import relax
from data_synth.sheets import LEAST_CELL, TrueSheet, laid, least_cell, page_grid, page_grid_of
from data_synth.splines import resampled
from deskew.errors import StepError
from deskew.types import Floats

_COARSE = (79, 61)  # (long side, short side): buckled on this grid, refined to the one asked for
_N_HANDLES, _AMPLITUDE_MM, _PULL = 14, 2.0, 0.05
_RAMP, _RAMP_STEPS = 8, 6  # parts that the growth sets in by, and the descent's steps after each
_RELEASE_STEPS, _FINE_STEPS = 40, 12
_N_WAVES, _WAVES_MM = 8, (100.0, 300.0)
_BLEND_MM, _WELL_INSIDE_MM = 6.0, 8.0
_PROBE_MM = 2.0


@dataclass(frozen=True, slots=True)
class Change:
    """How one material changed size, unevenly; the other kept its size.

    Attributes
    ----------
    leaf : Leaf
        The vellum's place on the page.
    on_leaf : bool
        Whether the vellum changed or the sleeve.
    mean : float
        Mean over the page of the smooth field of relative changes of length, negative for a shrinkage; the field lies
        between 0 and twice of it.
    waves : (n, 3) array
        Wave vectors along u and v [1/mm] and phases [rad] of the cosines that the field is the sum of.
    """

    leaf: Leaf
    on_leaf: bool
    mean: float
    waves: Floats

    def field(self, u: Floats, v: Floats) -> Floats:
        """Relative change of length, seam and materials left aside."""
        probe = page_grid(self.leaf.page_size_mm, _PROBE_MM)
        everywhere = self._wave(probe[..., 0], probe[..., 1])
        middle = everywhere.mean()
        return np.asarray(self.mean * (1 + (self._wave(u, v) - middle) / np.abs(everywhere - middle).max()))

    def growth(self, u: Floats, v: Floats) -> Floats:
        """Lengths after the change over those before, alike in all directions; 1 at the seam, all of it in 6 mm."""
        depth = self.leaf.depth(u, v)
        inside = depth if self.on_leaf else -depth
        return np.asarray(1 + self.field(u, v) * np.clip(inside / _BLEND_MM, 0, 1))

    def well_inside(self) -> float:
        """Mean relative change of length over the changed material's area, more than 8 mm from the seam."""
        page = page_grid(self.leaf.page_size_mm, _PROBE_MM)
        centres = (page[1:, 1:] + page[:-1, :-1]) / 2
        depth = self.leaf.depth(centres[..., 0], centres[..., 1])
        inside = (depth if self.on_leaf else -depth) > _WELL_INSIDE_MM
        return float(self.field(*centres[inside].T).mean())

    def _wave(self, u: Floats, v: Floats) -> Floats:
        return np.asarray(sum(np.cos(2 * np.pi * (p * u + q * v) + phase) for p, q, phase in self.waves))


def uneven_change(rng: np.random.Generator, leaf: Leaf, mean: float, *, on_leaf: bool) -> Change:
    """Draw a change of mean relative size `mean`: eight cosines of 100 to 300 mm wavelength in all directions."""
    length = rng.uniform(*_WAVES_MM, _N_WAVES)
    heading, phase = rng.uniform(0, 2 * np.pi, (2, _N_WAVES))
    return Change(leaf, on_leaf, mean, np.stack([np.cos(heading) / length, np.sin(heading) / length, phase], axis=-1))


def cell_growth(change: Change, shape: tuple[int, int]) -> Floats:
    """Growth at the centres of the cells of a page's grid of `shape` (rows, columns): (rows - 1, columns - 1)."""
    corners = page_grid_of(shape, change.leaf.page_size_mm)
    centres = (corners[1:, 1:] + corners[:-1, :-1]) / 2
    return change.growth(centres[..., 0], centres[..., 1])


def buckled(rng: np.random.Generator, change: Change, shape: tuple[int, int], thickness_mm: float = 0.15) -> TrueSheet:
    """Let a landscape page buckle whose materials do not fit each other any more.

    Parameters
    ----------
    rng : numpy Generator
        Of the handles.
    change : Change
        What grew or shrank.
    shape : (rows, columns)
        Grid, at least as many columns as rows.
    thickness_mm : float
        Of both materials; bending stiffness is ``thickness^2 / 12`` of the membrane's.

    Returns
    -------
    TrueSheet
        Let go, relaxed by a fixed number of steps (it would go on curling slowly), levelled, on the bed; its page
        coordinates are those before the change.

    Raises
    ------
    StepError
        If the sheet has near-vertical walls or hangs over itself.
    """
    page_size_mm = change.leaf.page_size_mm
    handles = Handles(rng.uniform(0.05, 0.95, (_N_HANDLES, 2)), rng.uniform(-1.0, 1.0, _N_HANDLES), _PULL)
    last = (shape[1], shape[0])
    coarse = _COARSE if _COARSE[0] < last[0] and _COARSE[1] < last[1] else last
    with threadpool_limits(1, user_api="blas"):  # the sums' order, and so the bytes, depend on the threads
        plate = _grown_plate(change, coarse, thickness_mm)
        x = _ramped(plate, handles, flat_plate(coarse, page_size_mm))
        x = relax(x, plate, _RELEASE_STEPS)
        x = relax(resampled(x, last), _grown_plate(change, last, thickness_mm), _FINE_STEPS)
    vertices = laid(levelled(np.swapaxes(x, 0, 1), page_size_mm, turned=True))
    if least_cell(vertices) < LEAST_CELL:
        raise StepError("two materials: the sheet has walls or hangs over itself; draw from another seed.")
    return TrueSheet(vertices, page_grid_of(shape, page_size_mm))


def _grown_plate(change: Change, shape: tuple[int, int], thickness_mm: float) -> Plate:
    """Return a free plate on a grid of `shape` (along u, along v) with the change's growth."""
    plate = free_plate(shape, change.leaf.page_size_mm, thickness_mm)
    return replace(plate, growth=np.ascontiguousarray(cell_growth(change, (shape[1], shape[0])).T))


def _ramped(plate: Plate, handles: Handles, x: Floats) -> Floats:
    """Let the growth set in bit by bit while the handles pull."""
    pull, heights = handles.on((x.shape[0], x.shape[1]), _AMPLITUDE_MM)
    for share in np.arange(1, _RAMP + 1) / _RAMP:
        held = replace(plate, pull=pull, heights=heights, growth=1 + share * (plate.growth - 1))
        x = relax(x, held, _RAMP_STEPS)
    return x


def metric_strain(sheet: TrueSheet, growth: Floats) -> Floats:
    """Relative difference of the length of every edge of a grid's cells, diagonals too, from the one it wants (E,).

    Parameters
    ----------
    sheet : TrueSheet
        Grid of (h, w) vertices.
    growth : (h - 1, w - 1) array
        Lengths that each cell wants over those on the page; an edge between two cells wants their mean.
    """
    around = np.pad(growth, 1, mode="edge")
    along_u, along_v = (around[1:, 1:-1] + around[:-1, 1:-1]) / 2, (around[1:-1, 1:] + around[1:-1, :-1]) / 2
    strains = []
    for a, b, wanted in (
        (np.s_[:, 1:], np.s_[:, :-1], along_u),
        (np.s_[1:], np.s_[:-1], along_v),
        (np.s_[1:, :-1], np.s_[:-1, 1:], growth),
    ):
        bent = np.linalg.norm(sheet.vertices[a] - sheet.vertices[b], axis=-1)
        flat = np.linalg.norm(sheet.flat[a] - sheet.flat[b], axis=-1)
        strains.append((bent / (flat * wanted) - 1.0).ravel())
    return np.concatenate(strains)

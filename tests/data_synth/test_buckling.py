from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from data_synth.buckling import Change, buckled, cell_growth, metric_strain, uneven_change
from data_synth.leaf import Leaf
from data_synth.plate import energy
from data_synth.plate_grids import flat_plate, free_plate
from data_synth.relaxation import relax
from data_synth.sheets import PAGE_SIZE_MM, TrueSheet, least_cell
from deskew.types import Floats

SHAPE = (31, 40)
STRIP, SIZES = (31, 13), (60.0, 24.0)


def rested(growth: Floats) -> Floats:
    rng = np.random.default_rng(0)
    start = flat_plate(STRIP, SIZES) + np.array([0.0, 0.0, 0.3]) * rng.normal(size=(*STRIP, 3))
    plate = replace(free_plate(STRIP, SIZES, 1.0), growth=growth)
    x = relax(start, plate, 60, tolerance_mm=1e-5)
    assert energy(x, plate) < 1e-3 * energy(start, plate)
    return x


def height(x: Floats) -> float:
    """Extent of a strip across its best plane."""
    points = (x - x.mean(axis=(0, 1))).reshape(-1, 3)
    return float(np.ptp(points @ np.linalg.svd(points, full_matrices=False)[2][2]))


@pytest.mark.parametrize("factor", [0.97, 1.04])
def test_a_strip_that_grows_alike_everywhere_stays_flat_and_scales(factor: float) -> None:
    x = rested(np.full((STRIP[0] - 1, STRIP[1] - 1), factor))
    assert height(x) < 1e-3
    for axis, (size, n) in enumerate(zip(SIZES, STRIP, strict=True)):
        edges = np.linalg.norm(np.diff(x, axis=axis), axis=-1)
        assert np.abs(edges / (factor * size / (n - 1)) - 1).max() < 1e-4


def test_a_growth_that_fits_the_plane_bends_the_strip_within_it() -> None:
    # The logarithm of the growth is harmonic, so the metric is flat: z becomes exp(c z) / c, and lines across the strip
    # become arcs of radius growth / c.
    c = 0.002
    along = (np.arange(STRIP[0] - 1) + 0.5 - (STRIP[0] - 1) / 2) * SIZES[0] / (STRIP[0] - 1)
    x = rested(np.repeat(np.exp(c * along)[:, None], STRIP[1] - 1, axis=1))
    assert height(x) < 1e-2
    # The lattice's own border, where a vertex has cells on one side only, is stiffer than the strip's middle.
    for row, tolerance in ((STRIP[0] // 2, 0.01), (5, 0.06), (-6, 0.06)):
        arc = x[row]
        radius = np.exp(c * SIZES[0] * ((row % STRIP[0]) / (STRIP[0] - 1) - 0.5)) / c
        sag = np.linalg.norm(arc[STRIP[1] // 2] - (arc[0] + arc[-1]) / 2)
        assert sag == pytest.approx(radius * (1 - np.cos(c * SIZES[1] / 2)), rel=tolerance)


@pytest.fixture(scope="module", params=[True, False], ids=["leaf shrank", "sleeve grew"])
def change(request: pytest.FixtureRequest) -> Change:
    on_leaf = bool(request.param)
    return uneven_change(np.random.default_rng(5), Leaf(), -0.02 if on_leaf else 0.02, on_leaf=on_leaf)


@pytest.fixture(scope="module")
def sheet(change: Change) -> TrueSheet:
    return buckled(np.random.default_rng(6), change, SHAPE)


def test_only_one_material_changes_and_the_seam_joins_it_to_the_other(change: Change) -> None:
    rng = np.random.default_rng(0)
    u, v = rng.uniform(0, PAGE_SIZE_MM[0], 4000), rng.uniform(0, PAGE_SIZE_MM[1], 4000)
    depth = change.leaf.depth(u, v) * (1 if change.on_leaf else -1)
    growth, size = change.growth(u, v), np.abs(change.field(u, v))
    assert np.array_equal(growth[depth <= 0], np.ones(int((depth <= 0).sum())))
    assert np.allclose(np.abs(growth - 1)[depth > 6], size[depth > 6])
    assert np.all(np.abs(growth - 1) <= size + 1e-12)
    assert 0 <= size.min() < size.max() <= 0.04 + 1e-12
    assert size.mean() == pytest.approx(0.02, abs=5e-4)
    assert 0.01 < change.well_inside() * np.sign(change.mean) < 0.03


def test_the_sheet_buckles_and_has_nearly_the_lengths_that_it_wants(change: Change, sheet: TrueSheet) -> None:
    growth = cell_growth(change, SHAPE)
    assert 5 < sheet.relief_mm < 50
    assert least_cell(sheet.vertices) > 0.3
    assert sheet.page_size_mm == PAGE_SIZE_MM
    own, page = np.abs(metric_strain(sheet, growth)), np.abs(metric_strain(sheet, np.ones_like(growth)))
    # On a grid of 7 mm the seam is one cell wide; on the grid in use the strain is a third of this.
    assert 1e-5 < own.mean() < 1e-3
    assert own.mean() < 0.1 * page.mean()


def test_the_same_seed_buckles_alike_on_any_number_of_threads(change: Change, sheet: TrueSheet) -> None:
    with threadpool_limits(2):
        again = buckled(np.random.default_rng(6), change, SHAPE)
    assert np.array_equal(again.vertices, sheet.vertices)

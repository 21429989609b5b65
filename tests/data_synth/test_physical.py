from __future__ import annotations

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from data_synth.physical import Paper, physical
from data_synth.sheets import PAGE_SIZE_MM, TrueSheet, least_cell
from data_synth.surfaces import edge_strain
from deskew.errors import InputError

SHAPE = (31, 40)


@pytest.fixture(scope="module")
def sheet() -> TrueSheet:
    return physical(np.random.default_rng(1), SHAPE, slope_p90_deg=12.0)


def test_a_crumple_stretches_hardly_and_hangs_nowhere_over(sheet: TrueSheet) -> None:
    strain = np.abs(edge_strain(sheet))
    # On a grid of 7 mm ridges are as narrow as a cell; on the grids in use the strain is a tenth of this.
    assert 1e-5 < strain.mean() < 2e-3
    assert np.percentile(strain, 99) < 2e-2
    assert least_cell(sheet.vertices) >= 0.3


def test_a_crumple_spans_the_page_and_lies_level_on_the_bed(sheet: TrueSheet) -> None:
    assert sheet.vertices.shape == (*SHAPE, 3)
    assert sheet.page_size_mm == PAGE_SIZE_MM
    assert sheet.vertices[..., 2].min() == 0
    assert sheet.slope_p90_deg == pytest.approx(12.0, abs=4.0)
    design = np.column_stack([np.ones(sheet.flat[..., 0].size), sheet.flat.reshape(-1, 2)])
    tilt = np.linalg.lstsq(design, sheet.vertices[..., 2].ravel(), rcond=None)[0][1:]
    assert np.abs(tilt).max() < 5e-3
    # u runs along +X and v along -Y.
    assert sheet.vertices[:, -1, 0].mean() - sheet.vertices[:, 0, 0].mean() > 0.9 * PAGE_SIZE_MM[0]
    assert sheet.vertices[0, :, 1].mean() - sheet.vertices[-1, :, 1].mean() > 0.9 * PAGE_SIZE_MM[1]


def test_a_crumple_is_bent_both_ways(sheet: TrueSheet) -> None:
    Z = sheet.vertices[..., 2]
    for bend in np.diff(Z, 2, axis=0), np.diff(Z, 2, axis=1):
        assert 0.2 < np.mean(bend > 0) < 0.8


def test_the_same_seed_gives_the_same_crumple_on_any_number_of_threads(sheet: TrueSheet) -> None:
    with threadpool_limits(2):
        again = physical(np.random.default_rng(1), SHAPE, slope_p90_deg=12.0)
    assert np.array_equal(again.vertices, sheet.vertices)
    other = physical(np.random.default_rng(2), SHAPE, slope_p90_deg=12.0)
    assert np.abs(other.vertices - sheet.vertices).max() > 1


def test_an_upright_page_is_crumpled_alike() -> None:
    upright = physical(np.random.default_rng(1), (31, 24), (216.0, 279.0), 10.0)
    assert upright.page_size_mm == (216.0, 279.0)
    assert np.abs(edge_strain(upright)).mean() < 2e-3
    assert least_cell(upright.vertices) >= 0.3


def test_arguments_out_of_range_are_named() -> None:
    rng = np.random.default_rng(0)
    with pytest.raises(InputError, match=r"`slope_p90_deg` must be in \[3, 30\], got 40"):
        physical(rng, SHAPE, slope_p90_deg=40.0)
    with pytest.raises(InputError, match=r"`shape` must be"):
        physical(rng, (4, 40))
    with pytest.raises(InputError, match=r"`handles` must be"):
        Paper(handles=(9, 3))
    with pytest.raises(InputError, match=r"`thickness_mm` must be"):
        Paper(thickness_mm=0.0)

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from deskew.errors import InputError
from deskew.flattening import StaticSettings, flatten
from deskew.flattening.anderson import Iterated
from deskew.flattening.freescale import SEAM_MM, SoftPart, settle_scale, shrink_percent, soft_part
from deskew.flattening.springs import Springs, grid_springs
from deskew.flattening.statics import _settle_uneven
from deskew.types import Array, Floats, Sheet, Status
from tests.flattening.bent_sheets import flat_grid, mirror_folds, rigid_error

SHAPE = (31, 37)


def leaf(vertices: Array, radius_mm: float = 50.0) -> Array:
    """Whether each quad lies in a disc about the middle of the sheet's first two coordinates."""
    middle = (vertices[1:, 1:] + vertices[:-1, :-1])[..., :2] / 2
    return np.asarray(np.linalg.norm(middle - middle.mean(axis=(0, 1)), axis=-1) < radius_mm)


def plate(*, inner: float, outer: float) -> Sheet:
    """A flat plate of 180 x 150 mm with a disc of another material."""
    flat = flat_grid(SHAPE, (180.0, 150.0))
    return Sheet(flat, stiffness=np.where(leaf(flat), inner, outer))


def changed(sheet: Sheet, factor: float) -> SoftPart:
    """Return the plate's springs, as they would be measured if the soft material had become `factor` of its size."""
    springs = grid_springs(sheet, StaticSettings().springs)
    part = soft_part(sheet, springs)
    return soft_part(sheet, replace(springs, rest=np.where(part.soft, factor, 1.0) * springs.rest))


def settle(x: Floats, springs: Springs) -> Iterated:
    return _settle_uneven(x, springs, 3e-5, 100)


@pytest.mark.parametrize(
    ("factor", "inner", "outer"),
    [
        (0.98, 0.01, 1.0),
        (0.98, 1.0, 0.01),
        (1.02, 0.01, 1.0),
        (1.02, 1.0, 1e-4),
        (1.0, 1e-4, 1.0),
        (1.3, 1.0, 0.01),
        (0.995, 1e-4, 1.0),
    ],
)
def test_uniform_change_is_recovered_and_undone(factor: float, inner: float, outer: float) -> None:
    sheet = plate(inner=inner, outer=outer)
    part = changed(sheet, factor)
    bent = settle(sheet.vertices[..., :2], part.springs)
    found, scale = settle_scale(part, bent, settle, 2e-7)
    assert found.converged
    assert scale == pytest.approx(1 / factor, rel=1e-5)
    assert shrink_percent(scale) == pytest.approx(100 * (1 - factor), abs=1e-3)
    assert rigid_error(found.x, sheet.vertices[..., :2]).max() < 2e-3
    assert rigid_error(bent.x, sheet.vertices[..., :2]).max() >= 8.0 * abs(1 - factor)


def test_change_takes_few_solves() -> None:
    part, n_solves = changed(plate(inner=1.0, outer=0.01), 1.02), 0

    def counted(x: Floats, springs: Springs) -> Iterated:
        nonlocal n_solves
        n_solves += 1
        return settle(x, springs)

    settle_scale(part, settle(plate(inner=1.0, outer=0.01).vertices[..., :2], part.springs), counted, 2e-7)
    assert 2 <= n_solves <= 6


@pytest.mark.parametrize(("inner", "outer"), [(0.01, 1.0), (1.0, 0.01)])
@pytest.mark.parametrize("seed", [1, 2])
def test_sheet_that_never_changed_keeps_its_scale(seed: int, inner: float, outer: float) -> None:
    dense, flat = mirror_folds(seed, (177, 177), 15.0)
    vertices = dense[::4, ::4]
    sheet = Sheet(vertices, surface=dense, stiffness=np.where(leaf(flat[::4, ::4], 80.0), inner, outer))
    result = flatten(sheet, free_scale=True)
    assert result.status is Status.AT_REST
    assert abs(result.counters["shrink_estimated"]) < 0.1
    assert rigid_error(result.vertices[..., :2], flat[::4, ::4]).mean() < 0.1


def dome(height_mm: float = 25.0) -> Array:
    """A sheet that no scale makes flat."""
    flat = flat_grid(SHAPE, (180.0, 150.0))
    x, y = flat[..., 0] / 90.0 - 1.0, flat[..., 1] / 75.0 + 1.0
    flat[..., 2] = height_mm * np.exp(-2 * (x**2 + y**2))
    return flat


@settings(max_examples=5, deadline=None)
@given(angle=st.floats(-3.1, 3.1), x=st.floats(-300, 300), y=st.floats(-300, 300), k=st.sampled_from([1e-3, 1.0, 1e6]))
def test_scale_does_not_depend_on_where_the_sheet_lies_nor_on_its_unit_of_stiffness(
    angle: float, x: float, y: float, k: float
) -> None:
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    vertices, stiffness = dome(), np.where(leaf(dome()), 0.01, 1.0)
    here = flatten(Sheet(vertices, stiffness=stiffness), free_scale=True)
    there = flatten(Sheet(vertices @ turn.T + [x, y, 0.0], stiffness=k * stiffness), free_scale=True)
    assert here.counters["scale"] != pytest.approx(1.0, abs=1e-3)
    assert there.counters["scale"] == pytest.approx(here.counters["scale"], abs=1e-5)
    assert rigid_error(there.vertices[..., :2], here.vertices[..., :2]).max() < 0.01


def test_seam_takes_the_soft_constant_and_does_not_measure() -> None:
    sheet = plate(inner=0.01, outer=1.0)
    springs = grid_springs(sheet, StaticSettings().springs)
    part = soft_part(sheet, springs)
    there = springs.k_s > 0
    assert np.array_equal(part.springs.k_s > 0, there)
    assert set(np.unique(part.springs.k_s[there])) == {0.01, 1.0}
    assert part.springs.k_s[there & ~part.soft].min() == 0.01
    # A horizontal spring on the middle row lies as far from the seam as its column says.
    row, x = SHAPE[0] // 2, sheet.vertices[0, :-1, 0] + 2.5
    away = np.abs(np.abs(x - 90.0) - 50.0)
    soft = np.abs(x - 90.0) < 45.0
    assert not part.measured[0, row, :-1][away < SEAM_MM - 2.5].any()
    assert part.measured[0, row, :-1][soft & (away > SEAM_MM + 2.5)].all()


def test_other_sheets_and_settings_are_refused() -> None:
    flat = flat_grid(SHAPE, (180.0, 150.0))
    one = np.ones((SHAPE[0] - 1, SHAPE[1] - 1))
    with pytest.raises(InputError, match="`free_scale` must be used with a stiffness of two materials, got no stiff"):
        flatten(Sheet(flat), free_scale=True)
    with pytest.raises(InputError, match="`free_scale` must be used with a stiffness of two materials, got one mat"):
        flatten(Sheet(flat, stiffness=one), free_scale=True)
    narrow = one.copy()
    narrow[:, 10:12] = 0.01
    with pytest.raises(InputError, match=r"soft material reaches farther than 8 mm from the seam, got 5\.0 mm"):
        flatten(Sheet(flat, stiffness=narrow), free_scale=True)
    with pytest.raises(InputError, match="`free_scale` must be True or False, got 1"):
        StaticSettings(free_scale=1)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="`free_scale` must be False with `bending` or `more`"):
        StaticSettings(free_scale=True, more=0.5)
    with pytest.raises(InputError, match="`free_scale` must be False for a triangle mesh"):
        flatten(Sheet(flat, stiffness=narrow), free_scale=True, energy="arap")
    with pytest.raises(InputError, match="`free_scale` must be a setting of the particle system"):
        flatten(Sheet(flat, stiffness=narrow), method="paper_euler", free_scale=True)


def test_scale_beyond_all_materials_is_no_rest() -> None:
    sheet = plate(inner=0.01, outer=1.0)
    part = changed(sheet, 0.3)
    assert not settle_scale(part, settle(sheet.vertices[..., :2], part.springs), settle, 2e-7)[0].converged

"""Sheets of two materials by their exact geometry: which stiffness is right, and how much a material has changed."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from data_synth import Case, TwoMaterials, shipped_two_materials
from data_synth.splines import resampled
from deskew.flattening import flatten
from deskew.metrics import fit_rigid
from deskew.types import Floats, Sheet, Status

N, STEPS = 45, 4


@cache
def sampled(case: Case) -> tuple[TwoMaterials, Floats, Floats]:
    """A shipped sheet as a scan without error has it: 45 x 45 vertices, four steps between two, and their places."""
    two, shape = shipped_two_materials(case, 0), ((N - 1) * STEPS + 1,) * 2
    return two, resampled(two.sheet.vertices, shape), resampled(two.sheet.flat, shape)


def restored(case: Case, ratio: float, *, free_scale: bool = False) -> tuple[float, float, float]:
    """Mean errors of what kept and of what changed its size [mm], and the shrinkage found [%]."""
    two, surface, places = sampled(case)
    flat = places[::STEPS, ::STEPS]
    on_leaf = two.leaf.holds(*np.moveaxis((flat[1:, 1:] + flat[:-1, :-1]) / 2, -1, 0))
    sheet = Sheet(surface[::STEPS, ::STEPS], surface=surface, stiffness=np.where(on_leaf, ratio, 1.0))
    result = flatten(sheet, free_scale=free_scale)
    assert result.status is Status.AT_REST
    found, truth = result.vertices[..., :2].reshape(-1, 2), (flat * [1.0, -1.0]).reshape(-1, 2)
    kept = two.leaf.holds(*np.moveaxis(flat, -1, 0)).ravel() ^ (case is Case.A)
    error = np.linalg.norm(fit_rigid(found[kept], truth[kept]).apply(found) - truth, axis=1)
    return float(error[kept].mean()), float(error[~kept].mean()), result.counters.get("shrink_estimated", 0.0)


@pytest.mark.parametrize(("case", "right", "most_mm", "gain"), [(Case.A, 0.01, 0.7, 3.0), (Case.B, 100.0, 0.08, 15.0)])
def test_what_kept_its_size_should_be_the_stiffer(case: Case, right: float, most_mm: float, gain: float) -> None:
    kept, changed, _ = restored(case, right)
    even, _, _ = restored(case, 1.0)
    wrong_kept, wrong_changed, _ = restored(case, 1 / right)
    assert 0 < kept < most_mm
    assert wrong_kept > gain * kept
    assert even > 3.0 * kept
    assert wrong_changed > 2.0 * changed


@pytest.mark.parametrize(("case", "right", "gain"), [(Case.A, 0.01, 8.0), (Case.B, 100.0, 40.0)])
def test_free_scale_spares_what_kept_its_size_and_measures_the_change(case: Case, right: float, gain: float) -> None:
    kept, changed, shrink = restored(case, right, free_scale=True)
    wrong, _, _ = restored(case, 1 / right)
    plain, plain_changed, _ = restored(case, right)
    assert wrong > gain * kept
    assert kept < plain
    assert changed < plain_changed
    assert shrink == pytest.approx(-sampled(case)[0].change_percent, abs=0.4)


def test_choice_of_stiffness_does_nothing_where_nothing_changed() -> None:
    errors = {ratio: restored(Case.N, ratio)[:2] for ratio in (0.01, 1.0, 100.0)}
    for one in errors.values():
        assert np.allclose(one, errors[1.0], rtol=0.5, atol=0.005)
        assert 0 < max(one) < 0.1
    for ratio in (0.01, 100.0):
        assert abs(restored(Case.N, ratio, free_scale=True)[2]) < 0.1

"""One function decides which sheet a trial photographs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import data_synth
from data_synth import TrueSheet, crumples
from data_synth.sheets import PAGE_SIZE_MM, page_grid_of
from data_synth.surfaces import edge_strain, mirror
from deskew.io import write_arrays
from experiments.settings import Config, SheetSettings
from experiments.studies.given_sheets import refined_if_short
from experiments.studies.trial_sheets import severity, trial_sheet
from experiments.trials import TrialKey


def sheet_of(trial: int, seed: int = 1, **settings: object) -> TrueSheet:
    config = Config(experiment="corner_distance", trials=20, sheet=SheetSettings(**settings))
    key = TrialKey("corner_distance", trial=trial, seed=seed)
    return trial_sheet(config, key, key.generator())


def test_mirror_folds_are_drawn_from_the_trials_own_numbers() -> None:
    key = TrialKey("corner_distance", trial=3, seed=7)
    drawn = data_synth.crumpled(key.generator(), slope_p90_deg=12.0)
    assert np.array_equal(sheet_of(3, 7, slope_p90_deg=12.0).vertices, drawn.vertices)


def test_a_physical_trial_takes_the_shipped_sheet_of_its_number_whatever_the_seed() -> None:
    first = sheet_of(2, 1, kind="physical")
    assert np.array_equal(first.vertices, data_synth.shipped_crumple(2).vertices)
    assert np.array_equal(first.vertices, sheet_of(10, 5, kind="physical").vertices)
    assert not np.array_equal(first.vertices, sheet_of(3, 1, kind="physical").vertices)


def test_a_drawn_physical_sheet_is_the_trials_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(crumples, "SHAPE", (12, 15))  # a sheet of the shipped ones' grid takes 20 s
    one, again, other = (sheet_of(0, s, kind="physical", drawn=True, slope_p90_deg=9.0) for s in (1, 1, 2))
    assert np.array_equal(one.vertices, again.vertices)
    assert np.abs(one.vertices - other.vertices).max() > 0.5


def test_a_given_sheet_comes_before_the_kind(tmp_path: Path) -> None:
    sheet = data_synth.flat_sheet()
    path = tmp_path / "a.npz"
    write_arrays({"V": sheet.vertices[::10, ::10], "F": sheet.flat[::10, ::10]}, path)
    found = sheet_of(0, kind="physical", paths=[str(path)])
    assert np.array_equal(found.vertices, sheet.vertices[::10, ::10])
    assert severity(found) == pytest.approx({"slope_p90_deg": 0.0, "relief_mm": 0.0}, abs=1e-6)


def test_a_given_sheet_whose_chords_are_short_is_refined_and_comes_closer_to_the_page(tmp_path: Path) -> None:
    coarse = mirror(np.random.default_rng(1), (73, 94))
    path = tmp_path / "folds.npz"
    write_arrays({"V": coarse.vertices, "F": coarse.flat}, path)
    fine = sheet_of(0, paths=[str(path)])
    assert fine.vertices.shape == (721, 931, 3)
    # What creases cut off the page is its lengths' loss over all: less of it is left, though single edges are worse.
    assert 0.3 < np.mean(edge_strain(fine)) / np.mean(edge_strain(coarse)) < 0.8


def test_facets_as_long_as_the_page_are_left_alone() -> None:
    # A sharp fold along a line of the grid: any curve through its vertices would be longer than the page.
    flat = page_grid_of((13, 32), PAGE_SIZE_MM)
    u = flat[..., 0]
    x, z = np.where(u < 90, u, 90 + (u - 90) * np.cos(0.5)), np.where(u < 90, 0, (u - 90) * np.sin(0.5))
    fold = TrueSheet(np.stack([x, -flat[..., 1], z], axis=-1), flat)
    assert np.abs(edge_strain(fold)).max() < 1e-12
    assert refined_if_short(fold) is fold

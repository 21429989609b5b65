from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import data_synth as ds
from data_synth import N_SHIPPED, Case
from data_synth.buckling import metric_strain
from data_synth.materials import SHAPE, draw_change, draw_two_materials, generator, write_two_materials
from data_synth.sheets import least_cell
from data_synth.two_materials import main, true_growth
from deskew.errors import InputError
from deskew.io import write_arrays

EVERY = [(case, index) for case in Case for index in range(N_SHIPPED)]
SMALL = (20, 26)


@pytest.mark.parametrize(("case", "index"), EVERY)
def test_a_shipped_sheet_is_that_of_its_seed_and_keeps_the_lengths_that_it_wants(case: Case, index: int) -> None:
    two = ds.shipped_two_materials(case, index)
    assert two.case is case
    assert two.sheet.vertices.shape == (*SHAPE, 3)
    assert two.sheet.page_size_mm == pytest.approx(ds.PAGE_SIZE_MM, abs=1e-4)
    assert two.leaf.size_mm == pytest.approx(ds.Leaf().size_mm, abs=1e-4)
    assert 10 < two.sheet.relief_mm < 30
    assert least_cell(two.sheet.vertices) > 0.3
    # With another seed's growth the strain would be twenty times as large.
    strain = np.abs(metric_strain(two.sheet, true_growth(case, index, SHAPE)))
    assert 3e-5 < strain.mean() < 3e-4
    assert np.percentile(strain, 99) < 3e-3
    change = draw_change(generator(case, index), case)
    assert two.change_percent == (0.0 if change is None else pytest.approx(100 * change.well_inside()))


def test_the_changes_are_about_two_percent_and_differ() -> None:
    for case, sign in (Case.A, -1), (Case.B, 1):
        changes = np.array([sign * ds.shipped_two_materials(case, index).change_percent for index in range(N_SHIPPED)])
        assert changes.min() > 1.5
        assert changes.max() < 2.5
        assert np.ptp(changes) > 0.1


def test_the_changed_material_has_changed_its_area_and_the_other_has_not() -> None:
    for case in Case.A, Case.B:
        two = ds.shipped_two_materials(case, 0)
        page, bent = two.sheet.flat, two.sheet.vertices
        centres = (page[1:, 1:] + page[:-1, :-1]) / 2
        depth = two.leaf.depth(centres[..., 0], centres[..., 1])
        diagonals = (bent[1:, 1:] - bent[:-1, :-1], bent[1:, :-1] - bent[:-1, 1:])
        area = np.linalg.norm(np.cross(*diagonals), axis=-1) / 2
        flat = np.diff(page[:-1, :, 0], axis=1) * np.diff(page[:, :-1, 1], axis=0)
        linear = 100 * (np.sqrt(area / flat) - 1)
        leaf, sleeve = float(linear[depth > 8].mean()), float(linear[depth < -8].mean())
        changed, kept = (leaf, sleeve) if case is Case.A else (sleeve, leaf)
        assert changed == pytest.approx(two.change_percent, abs=0.03)
        assert kept == pytest.approx(0.0, abs=0.03)


def test_a_sheet_comes_back_from_its_file(tmp_path: Path) -> None:
    two = draw_two_materials(generator(Case.A, 900), Case.A, SMALL)
    write_two_materials(two, tmp_path / "a.npz")
    again = ds.read_two_materials(tmp_path / "a.npz")
    assert (again.case, again.change_percent) == (two.case, two.change_percent)
    assert np.abs(again.sheet.vertices - two.sheet.vertices).max() < 1e-4
    assert np.abs(again.sheet.flat - two.sheet.flat).max() < 2e-5
    assert again.leaf.share == two.leaf.share


def test_files_that_hold_something_else_are_refused_in_one_line(tmp_path: Path) -> None:
    two = ds.shipped_two_materials(Case.B, 0)
    whole = {
        "V": two.sheet.vertices,
        "F": two.sheet.flat,
        "leaf": np.array([0.6, 5.0]),
        "change_percent": np.array(2.0),
    }
    path = tmp_path / "x.npz"
    for spoiled, message in (
        ({"leaf": np.array([0.6])}, "x.npz: leaf` must have shape"),
        ({"leaf": np.array([2.0, 5.0])}, r"x.npz`: `share` must be in \[0.1, 0.9\]"),
        ({"change_percent": np.array(np.nan)}, "`change_percent` must be in"),
        ({"F": two.sheet.flat + 9.0}, "`F` must begin at the page's corner"),
        ({"V": np.zeros((3, 4, 3))}, "`flat` must have shape"),
    ):
        write_arrays(whole | spoiled, path)
        with pytest.raises(InputError, match=message):
            ds.read_two_materials(path)
    write_arrays({name: values for name, values in whole.items() if name != "V"}, path)
    with pytest.raises(InputError, match="must hold the arrays V, F, leaf, change_percent"):
        ds.read_two_materials(path)
    with pytest.raises(InputError, match=r"`index` must be a whole number in \[0, 4\], got 5"):
        ds.shipped_two_materials(Case.A, 5)


def test_the_command_writes_what_the_seeds_stand_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shape = ["--rows", str(SMALL[0]), "--columns", str(SMALL[1])]
    assert main([str(tmp_path), "--case", "B", "--count", "1", "--seed", "901", *shape]) == 0
    assert "two_materials_B_901: change +" in capsys.readouterr().out
    written = ds.read_two_materials(tmp_path / "two_materials_B_901.npz")
    drawn = ds.draw_two_materials(generator(Case.B, 901), Case.B, SMALL)
    assert np.abs(written.sheet.vertices - drawn.sheet.vertices).max() < 1e-4
    for wrong, message in (
        (["--case", "C"], "`case` must be one of A, B, N, got C."),
        (["--rows", "3"], "`rows` must be"),
    ):
        assert main([str(tmp_path), *wrong]) == 2
        assert message in capsys.readouterr().err

"""The shipped crumples keep what is promised of them, as they are stored and as they are rendered."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from data_synth import N_CRUMPLES, PAGE_SIZE_MM, TrueSheet, crumpling, shipped_crumple
from data_synth.crumples import SHAPE, SHIPPED, SLOPES_P90_DEG, crumple_path, read_crumple
from data_synth.crumpling import main
from data_synth.physical import physical
from data_synth.sheets import SPACING_MM
from data_synth.surfaces import edge_strain, severity
from deskew.errors import InputError
from deskew.io import read_arrays, write_arrays
from deskew.types import Floats
from experiments.studies.given_sheets import read_sheet

FILES = [crumple_path(i, SHIPPED) for i in range(N_CRUMPLES)]


@pytest.fixture(scope="module", params=range(N_CRUMPLES))
def index(request: pytest.FixtureRequest) -> int:
    return int(request.param)


@pytest.fixture(scope="module")
def stored(index: int) -> TrueSheet:
    return read_crumple(FILES[index])


@pytest.fixture(scope="module")
def rendered(index: int) -> TrueSheet:
    return shipped_crumple(index)


def crossings(polygon: Floats) -> int:
    """Pairs of edges of a closed polygon (n, 2) that cross; edges that share a corner do not."""
    start, end = polygon, np.roll(polygon, -1, axis=0)
    low, high = np.minimum(start, end), np.maximum(start, end)
    near = np.ones((len(start), len(start)), dtype=bool)
    for axis in (0, 1):
        near &= (low[:, None, axis] <= high[None, :, axis]) & (low[None, :, axis] <= high[:, None, axis])
    i, j = np.nonzero(np.triu(near, 1))

    def turn(p: Floats, q: Floats, r: Floats) -> Floats:
        d, e = q - p, r - p
        return np.asarray(d[:, 0] * e[:, 1] - d[:, 1] * e[:, 0])

    parted = turn(start[i], end[i], start[j]) * turn(start[i], end[i], end[j]) < 0
    return int((parted & (turn(start[j], end[j], start[i]) * turn(start[j], end[j], end[i]) < 0)).sum())


def test_no_crumple_meets_itself(stored: TrueSheet, rendered: TrueSheet) -> None:
    # Seen from above every triangle faces up and the border is a simple polygon. Then the projection of the disc is
    # one to one (a local homeomorphism of a disc that is injective on its border is injective), so the sheet is the
    # graph of a function of (x, y), and a graph cannot meet itself.
    a, b, c, d = np.s_[:-1, :-1], np.s_[:-1, 1:], np.s_[1:, :-1], np.s_[1:, 1:]
    for sheet in (stored, rendered):
        xy = sheet.vertices[..., :2]
        # Both ways to cut a cell; v runs down, so that the corners a, c, d, b turn to the left.
        for i, j, k in ((a, c, d), (a, d, b), (a, c, b), (c, d, b)):
            p, q = xy[j] - xy[i], xy[k] - xy[i]
            assert (p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0]).min() > 0
        border = np.concatenate([xy[0, :-1], xy[:-1, -1], xy[-1, :0:-1], xy[:0:-1, 0]])
        assert len(border) == 2 * (sum(xy.shape[:2]) - 2)
        assert crossings(border) == 0


def test_crossings_are_seen() -> None:
    bow = np.array([[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]])
    assert crossings(bow) == 1
    assert crossings(bow[[0, 2, 1, 3]]) == 0


def test_a_crumple_hardly_stretches_also_when_it_is_refined(stored: TrueSheet, rendered: TrueSheet) -> None:
    for sheet in (stored, rendered):
        strain = np.abs(edge_strain(sheet))
        assert 1e-5 < strain.mean() <= 3e-4
        assert 1e-4 < np.percentile(strain, 99) <= 3e-3


def test_a_file_says_what_its_sheet_is(index: int, stored: TrueSheet, rendered: TrueSheet) -> None:
    told, found = read_arrays(FILES[index]), severity(stored)
    for name in ("slope_p90_deg", "relief_mm", "strain_mean", "strain_p99", "strain_max", "least_cell"):
        assert float(told[name]) == getattr(found, name)
    assert found.slope_p90_deg == pytest.approx(SLOPES_P90_DEG[index], abs=2.0)
    assert found.least_cell >= 0.3
    # Refined, it is the same sheet.
    assert rendered.slope_p90_deg == pytest.approx(found.slope_p90_deg, abs=0.3)
    assert rendered.relief_mm == pytest.approx(found.relief_mm, abs=0.1)


def test_a_crumple_lies_level_on_the_bed_and_spans_the_page(stored: TrueSheet, rendered: TrueSheet) -> None:
    assert stored.vertices.shape == (*SHAPE, 3)
    assert rendered.page_size_mm == pytest.approx(PAGE_SIZE_MM, abs=1e-9)
    assert np.diff(rendered.flat[0, :, 0]).max() < 1.01 * SPACING_MM
    assert abs(rendered.vertices[..., 2].min()) < 0.05
    assert (
        np.abs(rendered.vertices[..., :2].max(axis=(0, 1)) + rendered.vertices[..., :2].min(axis=(0, 1))).max() < 0.05
    )


def test_crumples_differ_and_are_small() -> None:
    Z = [read_crumple(path).vertices[..., 2] for path in FILES]
    for i in range(N_CRUMPLES):
        assert all(abs(np.corrcoef(Z[i].ravel(), Z[j].ravel())[0, 1]) < 0.6 for j in range(i))
    assert max(path.stat().st_size for path in FILES) < 600_000


def test_the_command_makes_what_it_tells(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(crumpling, "SHAPE", (10, 13))
    monkeypatch.setattr(crumpling, "SLOPES_P90_DEG", SLOPES_P90_DEG[:2])
    assert main([str(tmp_path / "new")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(":")[0] for line in lines] == ["crumple_0", "crumple_1"]
    first = (tmp_path / "new" / "crumple_0.npz").read_bytes()
    sheet = physical(np.random.default_rng(0), (10, 13), slope_p90_deg=SLOPES_P90_DEG[0])
    assert 0 < np.abs(read_crumple(tmp_path / "new" / "crumple_0.npz").vertices - sheet.vertices).max() <= 2.0**-15
    assert main([str(tmp_path / "new")]) == 0
    assert (tmp_path / "new" / "crumple_0.npz").read_bytes() == first
    assert main([str(tmp_path / "new" / "crumple_0.npz")]) == 2
    assert "`folder` must be a folder" in capsys.readouterr().err


def test_without_a_folder_the_command_tells_of_the_shipped_ones(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    assert len(capsys.readouterr().out.splitlines()) == N_CRUMPLES


def test_another_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "other.npz"
    write_arrays({"V": np.zeros((3, 3, 3))}, path)
    with pytest.raises(InputError, match="must hold the arrays"):
        read_crumple(path)


@pytest.mark.parametrize("index", [-1, N_CRUMPLES, True, 1.5])
def test_other_numbers_are_refused(index: object) -> None:
    with pytest.raises(InputError, match=r"`index` must be a whole number in \[0, 7\]"):
        shipped_crumple(index)  # type: ignore[arg-type]


def test_shipped_files_are_sheets_as_anybody_gives_them() -> None:
    for path in FILES:
        assert np.array_equal(read_sheet(path, PAGE_SIZE_MM).vertices, read_crumple(path).vertices)

"""Figure pages: every picture and number of the trials in its place, at a size that prints."""

from __future__ import annotations

import struct

import cv2
import numpy as np
import pytest

from experiments.reporting import Column, FigurePage, Numbers
from experiments.reporting.figure_pages import WIDTH_MM, figure_page, pictures_on
from experiments.reporting.page_numbers import numbers_table
from experiments.trials import Row, TrialKey

COLUMNS = (
    Column("misses", "misses", 0, {"restored": "1..3"}),
    Column("corner_mean_px", "mean [px]", 2),
    Column("kept_mean_mm", "kept [mm]", 3),
)
PAGE = FigurePage(
    "figure",
    "A title",
    "A caption.",
    (("captured", "page_{column}_seen"), ("restored", "page_{column}_restored_{method}")),
    control=("control", "page_{column}_control"),
    numbers=Numbers((("unrestored", "unrestored"), ("restored", "restored")), ("corner_mean_px", "misses")),
)
CASES = FigurePage(
    "cases",
    "Cases",
    "",
    (("stiffer", "case_{column}_stiffer"),),
    columns=(("case A", "A"), ("case B", "B")),
    numbers=Numbers((("stiffer", "restored/{column}/ratio=10"),), ("kept_mean_mm",)),
)
SHOWN = [("page 1", "0"), ("page 2", "1")]


def row(trial: int, condition: str, method: str, metric: str, value: float) -> Row:
    return Row.of(TrialKey("fake", trial=trial, seed=1), condition, method, metric, value)


def png(grey: int, shape: tuple[int, ...] = (48, 64)) -> bytes:
    return bytes(cv2.imencode(".png", np.full(shape, grey, np.uint8))[1].tobytes())


def trials(n: int, method: str = "a") -> list[Row]:
    rows = [row(i, "unrestored", "-", "corner_mean_px", 1.0 + i) for i in range(n)]
    return rows + [row(i, "restored", method, "misses", i) for i in range(n)]


def pictures(n: int, method: str = "a") -> dict[str, bytes]:
    return {
        f"page_{i}_{kind}": png(40 + 10 * i) for i in range(n) for kind in ("seen", f"restored_{method}", "control")
    }


def drawn(page: FigurePage, rows: list[Row], images: dict[str, bytes]) -> np.ndarray:
    found = figure_page(page, COLUMNS, rows, images)
    assert found is not None
    return np.asarray(cv2.imdecode(np.frombuffer(found, np.uint8), cv2.IMREAD_UNCHANGED))


def test_a_line_of_numbers_a_page_then_the_mean_of_all_trials_and_the_papers() -> None:
    table = numbers_table(PAGE, SHOWN, COLUMNS, trials(4))
    assert table is not None
    assert table.labels == ("page 1", "page 2", "mean of 4", "the paper")
    unrestored, restored = table.groups
    assert (unrestored.heading, unrestored.subheadings) == ("unrestored", ("mean\n[px]",))
    assert unrestored.cells == (("1.00",), ("2.00",), ("2.50",), ("–",))
    assert (restored.heading, restored.subheadings) == ("restored\na", ("misses",))
    assert restored.cells == (("0",), ("1",), ("2",), ("1..3",))


def test_no_mean_hides_a_trial_that_failed() -> None:
    rows = [*trials(2), row(2, "unrestored", "-", "corner_mean_px", 3.0), row(2, "restored", "a", "failed", 1.0)]
    table = numbers_table(PAGE, [*SHOWN, ("page 3", "2")], COLUMNS, rows)
    assert table is not None
    assert [line[0] for line in table.groups[1].cells] == ["0", "1", "failed", "1 failed", "1..3"]


def test_columns_that_are_cases_have_their_own_conditions_and_are_not_pooled() -> None:
    rows = [
        row(i, f"restored/{case}/ratio=10", "a", "kept_mean_mm", i + x)
        for i in (0, 1)
        for case, x in (("A", 1), ("B", 5))
    ]
    table = numbers_table(CASES, CASES.columns, COLUMNS, rows)
    assert table is not None
    assert table.labels == ("case A", "case B")
    assert table.groups[0].cells == (("1.500",), ("5.500",))


def test_a_table_wider_than_its_place_loses_its_last_methods() -> None:
    rows = [item for method in "abcdefgh" for item in trials(1, method)[1:]] + trials(1)[:1]
    table = numbers_table(PAGE, SHOWN[:1], COLUMNS, rows)
    assert table is not None
    narrow = table.within(80.0)
    assert 0 < len(narrow.groups) < len(table.groups)
    assert narrow.width_mm <= 80.0 < table.width_mm
    assert len(table.within(1.0).groups) == 1


def test_a_page_is_as_wide_as_a4s_text_and_says_so() -> None:
    found = figure_page(PAGE, COLUMNS, trials(2), pictures(2))
    assert found is not None
    at = found.index(b"pHYs")
    per_metre, _, unit = struct.unpack(">IIB", found[at + 4 : at + 13])
    width_px, height_px = struct.unpack(">II", found[16:24])
    assert unit == 1
    assert width_px / per_metre * 1e3 == pytest.approx(WIDTH_MM, abs=0.2)
    assert 40 < height_px / per_metre * 1e3 <= 257.1
    assert found == figure_page(PAGE, COLUMNS, trials(2), pictures(2))


def test_each_picture_has_its_place() -> None:
    # Pages 1 and 2 are of grey 40 and 50, in two lines of the same width; the control is page 1's.
    image = drawn(PAGE, trials(2), pictures(2))
    sizes = [(image == grey).sum() for grey in (40, 50)]
    assert sizes[0] > sizes[1] > 100_000
    columns = [np.nonzero(image == grey)[1] for grey in (40, 50)]
    assert columns[0].min() < columns[1].min()
    bare = drawn(PAGE, trials(2), {k: v for k, v in pictures(2).items() if "control" not in k})
    assert (bare == 50).sum() == pytest.approx((bare == 40).sum(), rel=0.02)


def test_more_than_five_pages_stand_in_two_blocks_and_a_method_under_its_name() -> None:
    rows = trials(8) + trials(8, "b")[8:]
    one = drawn(PAGE, trials(5), pictures(5))
    two = drawn(PAGE, rows, pictures(8) | pictures(8, "b"))
    assert two.shape[0] > 1.5 * one.shape[0]
    assert all((two == 40 + 10 * i).sum() > 10_000 for i in range(8))


def test_colour_survives_and_tall_pages_still_fit() -> None:
    tall = {f"case_{case}_stiffer": png(99, (3000, 600, 3)) for case in "AB"}
    red = np.zeros((3000, 600, 3), np.uint8)
    red[..., 2] = 200
    tall["case_B_stiffer"] = cv2.imencode(".png", red)[1].tobytes()
    image = drawn(CASES, [], tall)
    assert image.shape[2] == 3
    assert ((image == (0, 0, 200)).all(axis=-1)).sum() > 10_000
    assert image.shape[0] / image.shape[1] <= 257 / 180 + 0.01


def test_noise_costs_resolution_not_room() -> None:
    rng = np.random.default_rng(0)
    noisy = {
        name: cv2.imencode(".png", rng.integers(0, 256, (480, 640), dtype=np.uint8))[1].tobytes()
        for name in pictures(5)
    }
    found = figure_page(PAGE, COLUMNS, trials(5), noisy)
    assert found is not None
    assert len(found) <= 2_000_000
    assert struct.unpack(">I", found[16:20])[0] >= 100 / 25.4 * WIDTH_MM - 1


def test_a_page_whose_scans_all_failed_still_shows_its_control() -> None:
    rows = [row(0, "unrestored", "-", "corner_mean_px", 1.0), row(0, "restored", "a", "failed", 1.0)]
    image = drawn(PAGE, rows, {"page_0_control": png(77)})
    assert (image == 77).sum() > 10_000


def test_pictures_on_a_page_are_not_written_again_and_none_is_no_page() -> None:
    assert set(pictures(3)) == {name for name in pictures_on(PAGE, trials(3)) if not name.endswith(("_", "-"))}
    assert pictures_on(CASES, trials(1)) == {"case_A_stiffer", "case_B_stiffer"}
    assert figure_page(PAGE, COLUMNS, trials(2), {}) is None

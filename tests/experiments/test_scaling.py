"""docs/scaling.md says what was measured, and reckons rightly with it."""

from __future__ import annotations

from pathlib import Path

import pytest

from deskew.errors import InputError
from experiments.reporting.scaling import TABLES, Measured, with_figures
from experiments.scaling import nothing
from experiments.trials import TrialKey

ROOT = Path(__file__).resolve().parents[2]


def made_up() -> Measured:
    """A page of either pattern that costs 8.64 CPU seconds, and two cores that are 1.6 times as fast as one."""
    cells = {("surfaces", "workers=1", "seconds_wall"): [16.0], ("surfaces", "workers=2", "seconds_wall"): [10.0]}
    for pattern in ("line_sweep", "gray_code"):
        cells |= {
            (pattern, "run", "seconds_cpu"): [8.0, 8.64, 9.0],
            (pattern, "run", "peak_mb"): [500.0],
            (pattern, "page", "bytes"): [200e6],
            (pattern, "page", "frames"): [1794.0],
        }
    return Measured(cells, Path())


def test_the_document_asks_for_every_table() -> None:
    text = (ROOT / "docs" / "scaling.md").read_text()
    assert all(text.count(f"<!-- {name} -->") == 1 for name in TABLES)


def test_what_pages_a_day_need_is_plain_arithmetic() -> None:
    table = with_figures("<!-- needs -->\nold\n<!-- end -->", made_up()).splitlines()
    # 100 x 8.64 s = 0.24 h, on one core; 10,000 need 1.0 cores at full use, so two at an efficiency of 0.8.
    assert table[3] == "| 100 | line sweep | 0.2 | 1 | 0.5 | 20.0 | 1 |"
    assert table[5] == "| 10,000 | line sweep | 24.0 | 2 | 1.0 | 2000.0 | 7 |"


def test_a_block_of_another_name_is_refused() -> None:
    with pytest.raises(InputError, match="got nonsense"):
        with_figures("<!-- nonsense -->\n<!-- end -->", made_up())


def test_the_trial_that_overhead_is_measured_with_has_a_row() -> None:
    assert [row.value for row in nothing(None, TrialKey("scaling")).rows] == [0.0]

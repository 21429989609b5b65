"""A short, seeded run of what `python -m tests.badinput.fuzz` does for as long as it is told to."""

from __future__ import annotations

import pytest

from tests.badinput.fuzz import READERS, fuzz

N_RUNS = 100


@pytest.mark.parametrize("name", READERS)
def test_a_damaged_file_is_read_or_refused_and_nothing_else(name: str) -> None:
    tally = fuzz(READERS[name], seed=0, n_runs=N_RUNS)
    assert dict(tally.failures) == {}
    assert 0 < tally.n_read < N_RUNS == tally.n_runs  # damage that always or never shows would test nothing

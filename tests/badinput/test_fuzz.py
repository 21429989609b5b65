"""A short, seeded run of what `python -m tests.badinput.fuzz` does for as long as it is told to."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.badinput.fuzz import READERS, fuzz
from tests.badinput.samples import write_samples

N_RUNS = 100


@pytest.fixture(scope="module")
def samples(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("samples")
    write_samples(folder)
    return folder


@pytest.mark.parametrize("name", READERS)
def test_a_damaged_file_is_read_or_refused_and_nothing_else(samples: Path, name: str) -> None:
    tally = fuzz(READERS[name], samples, seed=0, n_runs=N_RUNS)
    assert dict(tally.failures) == {}
    assert 0 < tally.n_read < N_RUNS == tally.n_runs  # damage that always or never shows would test nothing

from __future__ import annotations

from pathlib import Path

import pytest

from experiments.gate.baseline import Baseline, read_baseline
from tests.gate.one_page import OnePage

SMOKE = Path(__file__).resolve().parents[2] / "reports/baseline/smoke.csv"


@pytest.fixture(scope="session")
def smoke() -> Baseline:
    """The committed baseline."""
    return read_baseline(SMOKE)


@pytest.fixture(scope="session")
def page(smoke: Baseline) -> OnePage:
    """The first page of the baseline's first run, calibrated and photographed once."""
    return OnePage(smoke, 0)

"""What a run says of itself while it goes on."""

from __future__ import annotations

import sys
import time

import pytest

from experiments.progress import Progress
from experiments.trials import Outcome, TrialKey
from experiments.trials.record import failed_outcome

DONE = Outcome(())
FAILED = failed_outcome(TrialKey("fake"), "too steep")


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """A clock that stands still until its one number is changed."""
    now = [1000.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    return now


def test_a_line_every_half_a_minute_at_most(clock: list[float], capsys: pytest.CaptureFixture[str]) -> None:
    with Progress("fake", 0, 50) as progress:
        for _ in range(12):
            clock[0] += 8.0
            progress.add(DONE)
    assert capsys.readouterr().err.splitlines() == [
        "fake: 4 of 50 trials, about 6 min left",
        "fake: 8 of 50 trials, about 6 min left",
        "fake: 12 of 50 trials, about 5 min left",
    ]


def test_time_left_counts_the_missing_trials_since_the_shared_work(
    clock: list[float], capsys: pytest.CaptureFixture[str]
) -> None:
    with Progress("fake", 190, 200) as progress:
        clock[0] += 1000.0
        progress.start()
        clock[0] += 40.0
        progress.add(FAILED)
        clock[0] += 40.0
        progress.add(DONE)
    assert capsys.readouterr().err.splitlines() == [
        "fake: 191 of 200 trials, 1 failed, about 6 min left",
        "fake: 192 of 200 trials, 1 failed, about 5 min left",
    ]


@pytest.mark.parametrize(
    ("seconds", "says"), [(30.0, "about 30 s left"), (120.0, "about 2 min left"), (7200.0, "about 2.0 h left")]
)
def test_time_left_is_said_in_a_unit_that_suits(
    clock: list[float], capsys: pytest.CaptureFixture[str], seconds: float, says: str
) -> None:
    with Progress("fake", 0, 2) as progress:
        clock[0] += seconds
        progress.add(DONE)
    assert capsys.readouterr().err == f"fake: 1 of 2 trials, {says}\n"


def test_in_a_terminal_there_is_a_bar(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    with Progress("fake", 2, 4) as progress:
        progress.add(FAILED)
        progress.add(DONE)
    written = capsys.readouterr().err
    assert "fake:  50%|" in written or "fake: 50%|" in written
    assert "4 of 4 trials" in written
    assert "1 failed, about 0 s left" in written

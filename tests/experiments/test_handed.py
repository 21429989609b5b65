from __future__ import annotations

import pickle
from pathlib import Path

import pytest

from deskew.errors import StepError
from experiments.trials import Outcome, Row, TrialKey
from experiments.trials.engines.handed import handed_over, taken_over
from experiments.trials.schema import Failure

KEY = TrialKey("surfaces", "flattened/cone", "arap", 3, 7)


def test_an_outcome_comes_back_bit_for_bit(tmp_path: Path) -> None:
    rows = (Row.of(KEY, "a", "-", "rms_px", 0.1 + 0.2), Row.of(KEY, "a", "-", "flips", 5e-324))
    times = (Row.of(KEY, "a", "-", "seconds_trial", 1 / 3),)
    outcome = Outcome(
        rows, times, (Failure("a", "-", 3, 7, "\u03c0 is \u00abodd\u00bb"),), {"seen": bytes(range(256))}, True
    )
    (tmp_path / "x.outcome").write_bytes(handed_over(outcome))
    assert taken_over(tmp_path / "x.outcome") == outcome


@pytest.mark.parametrize(
    "content",
    [b"", b"[]", b'{"rows": 1}', b"[" * 100_000, pickle.dumps(Outcome(())), handed_over(Outcome(()))[:-9]],
    ids=["empty", "a list", "a number", "nested", "a pickle", "cut"],
)
def test_what_is_no_outcome_is_refused_unread(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "x.outcome").write_bytes(content)
    with pytest.raises(StepError, match=r"x\.outcome` is no outcome of a job"):
        taken_over(tmp_path / "x.outcome")

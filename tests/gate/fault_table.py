"""Plant every fault in whole reruns of the smoke baseline and write what the gate says into docs/gate-faults.md.

Run as ``python -m tests.gate.fault_table``; it takes a quarter of an hour. The tests plant the same faults in one page.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from unittest.mock import patch

from deskew import acquisition, pipeline
from deskew.io import write_bytes
from experiments.gate.baseline import Baseline, read_baseline
from experiments.gate.rerun import rerun
from experiments.gate.verdict import Judgement, Verdict, judge
from experiments.reporting.markdown import markdown_table
from experiments.trials import unit_of
from tests.gate.faults import FAULTS, decoder_bias

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs/gate-faults.md"
Fault = Callable[[], AbstractContextManager[None]]

# Those that flatter are for closed forms, not for the gate.
_FLATTERING = ("uncounted_lost_corners", "free_substitutions", "unsigned_areas")
_COLUMNS = ("planted", "figures worse", "of which first", "method", "baseline", "now", "floor", "unit")
_INTRODUCTION = """\
# What the gate sees

The smoke baseline, run whole with each fault planted (`python -m tests.gate.fault_table`). The figure named is the one
that exceeds its floor the most times over; [the gate](gate.md) says what a floor is.

"""


@contextmanager
def decoder_bias_after_calibration() -> Iterator[None]:
    """Decoded projector columns are 0.03 px too large, but for those that calibrate the rig."""
    plain, calibrate = acquisition.decode, pipeline.calibrate

    def calibrated(*arguments: Any, **named: Any) -> Any:
        with patch.object(acquisition, "decode", plain):
            return calibrate(*arguments, **named)

    with decoder_bias(), patch.object(pipeline, "calibrate", calibrated):
        yield


def _planted() -> dict[str, Fault]:
    gated = [fault for name, fault in FAULTS.items() if name not in _FLATTERING and fault is not decoder_bias]
    named = {" ".join((fault.__doc__ or "").split()): fault for fault in (*gated, decoder_bias_after_calibration)}
    absorbed = "The same bias in the calibration too, whose principal point absorbs it: no figure is worse, rightly."
    return {"Nothing.": nullcontext, **named, absorbed: decoder_bias}


def _judged(baseline: Baseline, fault: Fault) -> Judgement:
    with TemporaryDirectory(prefix="gate.") as folder, fault():
        # Faults are planted in this process and would not reach another.
        found = rerun(baseline, Path(folder), more=("engine=serial",))
    return judge(baseline.rows, found.rows, baseline.floors, found.reasons)


def _excess(verdict: Verdict) -> float:
    return verdict.worsening / verdict.floor if verdict.floor > 0 else 0.0


def _line(planted: str, judgement: Judgement) -> list[str]:
    count = f"{len(judgement.regressions)} of {len(judgement.verdicts)}"
    worst = max(judgement.regressions, key=_excess, default=None)
    if worst is None:
        return [planted, count, *("–" for _ in _COLUMNS[2:])]
    figure = worst.figure
    values = (f"{value:.4g}" for value in (worst.before, worst.now, worst.floor))
    return [planted, count, f"{figure.condition} `{figure.metric}`", figure.method, *values, unit_of(figure.metric)]


def main() -> None:
    """Write the page."""
    baseline = read_baseline(ROOT / "reports/baseline/smoke.csv")
    lines = []
    for planted, fault in _planted().items():
        lines.append(_line(planted, _judged(baseline, fault)))
        print(" | ".join(lines[-1]), file=sys.stderr)
    write_bytes((_INTRODUCTION + markdown_table(_COLUMNS, lines) + "\n").encode(), PAGE)


if __name__ == "__main__":
    main()

"""One page of a baseline's run, run again and again without computing anew what a fault cannot touch."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, ExitStack, nullcontext
from typing import Any
from unittest.mock import patch

import data_synth
from deskew import acquisition, pipeline
from experiments.composed import composed
from experiments.gate.baseline import Baseline
from experiments.gate.verdict import Judgement, judge
from experiments.studies import corner_distance, find_study
from experiments.trials import Row
from experiments.trials.threads import one_thread
from tests.gate.faults import FAULTS

# The sheet, its photographs and what is read from them, and a picture that no figure is taken from.
_DECODED: list[tuple[Any, str]] = [
    (corner_distance, "trial_sheet"),
    (corner_distance, "model_view"),
    (data_synth, "render"),
    (acquisition, "decode"),
]
# What no fault of the flattening or of the renderer touches either.
_SCANNED: list[tuple[Any, str]] = [(pipeline, "scan_by"), (acquisition, "denoise_depth")]


class Kept:
    """A function whose n-th result in a trial is computed once, whatever it is called with."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.function, self.results, self.n = function, list[Any](), 0

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        if self.n == len(self.results):
            self.results.append(self.function(*arguments, **named))
        self.n += 1
        return self.results[self.n - 1]


class OnePage:
    """Trial 0 of a run, under its first planned condition."""

    def __init__(self, baseline: Baseline, run: int) -> None:
        self.baseline = baseline
        self.config = composed([*baseline.runs[run], "trials=1"])
        self.study = find_study(self.config.experiment)
        self.key = self.study.plan(self.config)[0]
        with one_thread():
            self.shared = self.study.prepare(self.config)
        self.kept = {place[1]: Kept(getattr(*place)) for place in (*_DECODED, *_SCANNED)}
        self._judgements: dict[str, Judgement] = {}

    def with_fault(self, name: str, *, scan: bool = False) -> Judgement:
        """Judge the page with a fault of FAULTS planted, "" for none; `scan`: from the decoded coordinates on."""
        if name not in self._judgements:
            self._judgements[name] = self._judged(self._rows(FAULTS[name] if name else nullcontext, scan))
        return self._judgements[name]

    def _rows(self, fault: Callable[[], AbstractContextManager[None]], scan: bool) -> tuple[Row, ...]:
        with ExitStack() as stack:
            stack.enter_context(one_thread())
            for module, name in _DECODED if scan else (*_DECODED, *_SCANNED):
                self.kept[name].n = 0
                stack.enter_context(patch.object(module, name, self.kept[name]))
            stack.enter_context(fault())
            return self.study.run(self.config, self.shared, self.key).rows

    def _judged(self, rows: Sequence[Row]) -> Judgement:
        """Hold rows against the baseline's of the same page."""
        planned = self.key.condition
        own = [
            row
            for row in self.baseline.rows
            if (row.experiment, row.trial) == (self.key.experiment, 0) and planned in ("-", row.condition)
        ]
        return judge(own, rows, self.baseline.floors)

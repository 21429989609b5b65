"""One trial after another in this process."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from experiments.trials.engines.engine import Finished, Prepare, Run
from experiments.trials.record import carry_out
from experiments.trials.schema import TrialKey
from experiments.trials.threads import one_thread


@dataclass(frozen=True, slots=True)
class Serial:
    """For debugging, and the reference of every other engine."""

    def run(self, keys: Sequence[TrialKey], run: Run, prepare: Prepare) -> Finished:
        """Yield the trials in the order of `keys`."""
        shared = prepare()
        for key in keys:
            with one_thread():
                outcome = carry_out(partial(run, shared), key)
            yield key, outcome

"""What an engine is: it takes a run's missing trials and hands back the outcome of each."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from typing import Any, Protocol

from experiments.trials.record import Outcome
from experiments.trials.schema import TrialKey

Prepare = Callable[[], Any]
Run = Callable[[Any, TrialKey], Outcome]
Finished = Generator[tuple[TrialKey, Outcome], None, None]

# A death may have come from outside, so a trial gets a second worker before it is given up.
WORKERS_A_TRIAL = 2


class Engine(Protocol):
    """Carries trials out, in any order, each at least once: the store makes that exactly once."""

    def run(self, keys: Sequence[TrialKey], run: Run, prepare: Prepare) -> Finished:
        """Yield every key with its outcome as soon as it is there; never raise for a trial.

        Parameters
        ----------
        keys : sequence of TrialKey
            The trials to carry out, at least one.
        run : callable
            Carries out one trial from what the trials share and its key; picklable, for it goes to the workers.
        prepare : callable
            Does once, here, what the trials share; its picklable result is handed out. Workers may start meanwhile.

        Raises
        ------
        InputError
            Before `prepare` is called, if the engine cannot be had.
        """
        ...

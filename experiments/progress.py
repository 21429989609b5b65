"""How far a run is: a bar in a terminal, elsewhere a plain line now and then."""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import Never

from tqdm import tqdm

from experiments.trials import Outcome

_SECONDS_A_LINE = 30.0


class Progress:
    """Tells on stderr how many trials are done and how long the rest will take.

    Parameters
    ----------
    experiment : str
        What is run.
    n_finished, n_planned : int
        Trials that the store holds already, and all. Time left counts the missing ones alone.
    """

    def __init__(self, experiment: str, n_finished: int, n_planned: int) -> None:
        self._experiment, self._n_before, self._n_planned = experiment, n_finished, n_planned
        self._n_done = self._n_failed = 0
        self._bar: tqdm[Never] | None = None
        self.start()

    def __enter__(self) -> Progress:
        if sys.stderr.isatty():
            layout = "{desc}: {percentage:.0f}%|{bar}| {n_fmt} of {total_fmt} trials, {elapsed}{postfix}"
            self._bar = tqdm(
                desc=self._experiment,
                initial=self._n_before,
                total=self._n_planned,
                bar_format=layout,
                file=sys.stderr,
            )
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.close()

    def start(self) -> None:
        """Count time from now: what trials share is done."""
        self._started = self._told = time.monotonic()

    def add(self, outcome: Outcome) -> None:
        """Count a finished trial, and say so."""
        self._n_done += 1
        self._n_failed += bool(outcome.failures)
        if self._bar is not None:
            self._bar.set_postfix_str(self._rest(), refresh=False)
            self._bar.update()
        elif time.monotonic() - self._told >= _SECONDS_A_LINE:
            self._told = time.monotonic()
            n_all = self._n_before + self._n_done
            print(f"{self._experiment}: {n_all} of {self._n_planned} trials, {self._rest()}", file=sys.stderr)

    def _rest(self) -> str:
        """Say how many trials failed and how long the others will take at the pace of those before."""
        n_left = self._n_planned - self._n_before - self._n_done
        seconds = (time.monotonic() - self._started) / self._n_done * n_left
        failed = [f"{self._n_failed} failed"] * bool(self._n_failed)
        return ", ".join([*failed, f"about {_duration(seconds)} left"])


def _duration(seconds: float) -> str:
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"

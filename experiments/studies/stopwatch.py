"""CPU time of pieces of work, in units of a memory triad in the same process."""

from __future__ import annotations

import time
from collections.abc import Callable
from statistics import median
from typing import TypeVar

import numpy as np
from numba import njit

from deskew.types import Floats
from experiments.studies.profiles import profiled
from experiments.trials import Recorder

Result = TypeVar("Result")

TRIAD = "triad"


class Stopwatch:
    """Times pieces of work and records them, each under its own condition.

    Parameters
    ----------
    record : Recorder
        Of the trial.
    n : int
        Repetitions.
    triad_bytes : int
        Bytes that the triad moves: what times are compared with.
    """

    def __init__(self, record: Recorder, n: int, triad_bytes: int) -> None:
        self.record, self.n, self.triad_bytes = record, n, triad_bytes
        self._seconds: dict[tuple[str, str], float] = {}
        # Before and after everything else: the machine may have been busier at one end.
        self._triads = triad_seconds(triad_bytes, n)

    def time(self, condition: str, work: Callable[[], Result], method: str = "-") -> Result:
        """Call `work` once to warm up, `n` times to time it, once more to see where the time goes.

        Records `seconds_cpu` (of all threads), its spread `seconds_min` and `seconds_max`, `seconds_warmup` (what the
        first call took beyond the median: compiling, or loading what was compiled before), and `peak_mb`.

        Returns
        -------
        Result
            What `work` gave at last.
        """
        first, _ = _cpu_seconds(work)
        with self.record.memory(condition, method):
            seconds = []
            for _ in range(self.n):
                taken, result = _cpu_seconds(work)
                # The next repetition must not find the last one's result in its memory.
                del result
                seconds.append(taken)
        middle = median(seconds)
        self._seconds[condition, method] = middle
        spread = {"min": min(seconds), "max": max(seconds), "warmup": max(first - middle, 0.0)}
        self.record.add_times(condition, method, {f"seconds_{name}": value for name, value in spread.items()})
        result, shares = profiled(work)
        for name, share in shares.items():
            where = name if method == "-" else f"{method}: {name}"
            self.record.add_times(condition, where, {"share_self": share})
        return result

    def finish(self) -> None:
        """Record the triad's time, and with it the ratio of everything timed."""
        triad = median([*self._triads, *triad_seconds(self.triad_bytes, self.n)])
        for (condition, method), seconds in {(TRIAD, "-"): triad, **self._seconds}.items():
            self.record.add_times(condition, method, {"seconds_cpu": seconds, "triads": seconds / triad})


def _cpu_seconds(work: Callable[[], Result]) -> tuple[float, Result]:
    start = time.process_time()
    result = work()
    return time.process_time() - start, result


@njit(cache=True)
def _triad(a: Floats, b: Floats, c: Floats, s: float) -> None:
    for i in range(len(a)):
        a[i] = b[i] + s * c[i]


def triad_seconds(n_bytes: int, n: int) -> list[float]:
    """CPU times of ``a = b + s c`` over arrays of `n_bytes` together, on one thread, `n` times after a warm-up [s]."""
    a, b, c = (np.full(max(n_bytes // 24, 1), value) for value in (0.0, 1.0, 2.0))
    return [_cpu_seconds(lambda: _triad(a, b, c, 3.0))[0] for _ in range(n + 1)][1:]

"""Who carries trials out: one after another here, or in a pool of worker processes.

An engine runs each trial at least once and yields it; the store makes that exactly once. It never raises for a trial.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Protocol

import cv2
from threadpoolctl import threadpool_limits

from deskew.errors import StepError
from experiments.trials.record import Outcome, carry_out, failed_outcome
from experiments.trials.schema import TrialKey

Run = Callable[[TrialKey], Outcome]


class Engine(Protocol):
    """Carries trials out, in any order."""

    def run(self, run: Run, keys: Sequence[TrialKey]) -> Iterator[tuple[TrialKey, Outcome]]:
        """Yield every key with its outcome as soon as it is there; `run` must be picklable for engines with workers."""
        ...


@contextmanager
def one_thread() -> Iterator[None]:
    """Hold linear algebra and OpenCV to one thread: sums are then taken in one order and bytes repeat."""
    before = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        with threadpool_limits(limits=1):
            yield
    finally:
        cv2.setNumThreads(before)


@dataclass(frozen=True, slots=True)
class Serial:
    """One trial after another in this process: for debugging, and the reference of every other engine."""

    def run(self, run: Run, keys: Sequence[TrialKey]) -> Iterator[tuple[TrialKey, Outcome]]:
        """Yield the trials in the order of `keys`."""
        for key in keys:
            with one_thread():
                outcome = carry_out(run, key)
            yield key, outcome


@dataclass(frozen=True, slots=True)
class Processes:
    """A pool of freshly started processes, each with one thread.

    Attributes
    ----------
    workers : int or None
        Processes at once; None for one a core that this process may use.
    """

    workers: int | None = None

    def run(self, run: Run, keys: Sequence[TrialKey]) -> Iterator[tuple[TrialKey, Outcome]]:
        """Yield the trials as they finish; those under way when a worker dies run again, each alone."""
        n_workers = min(self.workers or _n_cores(), len(keys))
        suspects: list[TrialKey] = []
        waiting = deque(keys)
        while waiting:
            yield from _run_pool(run, waiting, n_workers, suspects)
        for key in suspects:
            alone = deque([key])
            died: list[TrialKey] = []
            yield from _run_pool(run, alone, 1, died)
            if died:
                yield (
                    key,
                    failed_outcome(key, "The worker process died under this trial (killed, or out of memory).", True),
                )


def _n_cores() -> int:
    # Fewer than the machine has where a container or taskset says so; not every system can tell.
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _run_pool(
    run: Run, waiting: deque[TrialKey], n_workers: int, died: list[TrialKey]
) -> Iterator[tuple[TrialKey, Outcome]]:
    """Take trials from `waiting` until it is empty or a worker dies; those under way then are put into `died`."""
    running: dict[Future[Outcome], TrialKey] = {}
    pool = _start_pool(run, n_workers)
    try:
        while waiting or running:
            # No more in flight than there are workers, so a death leaves few suspects.
            while waiting and len(running) < n_workers:
                running[pool.submit(_run_here, waiting[0])] = waiting[0]
                waiting.popleft()
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                outcome = future.result()
                yield running.pop(future), outcome
    except BrokenProcessPool as error:
        if not running:
            raise StepError("The worker processes died before they took a trial; try engine=serial.") from error
        died.extend(running.values())
    finally:
        pool.shutdown(cancel_futures=True)


def _start_pool(run: Run, n_workers: int) -> ProcessPoolExecutor:
    # Spawned, not forked: a fork would inherit the driver's threads and its open store.
    context = multiprocessing.get_context("spawn")
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
    before = {name: os.environ.get(name) for name in names}
    os.environ.update(dict.fromkeys(names, "1"))
    try:
        pool = ProcessPoolExecutor(n_workers, context, _begin_worker, (run,))
        # Workers start on demand; ask for all of them while the environment holds.
        wait([pool.submit(os.getpid) for _ in range(n_workers)])
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
    return pool


_run: Run | None = None


def _begin_worker(run: Run) -> None:
    """Take over what all trials share, once a worker."""
    global _run
    _run = run
    cv2.setNumThreads(1)
    # ctrl-C is the driver's to handle; if the driver is killed, nobody would end this worker but itself.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _run_here(key: TrialKey) -> Outcome:
    assert _run is not None
    with one_thread():
        return carry_out(_run, key)

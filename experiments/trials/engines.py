"""Who carries trials out: one after another here, or in a pool of worker processes.

An engine runs each trial at least once and yields it; the store makes that exactly once. It never raises for a trial.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Protocol

import cv2
from threadpoolctl import threadpool_limits

from experiments.trials.record import Outcome, carry_out, failed_outcome
from experiments.trials.schema import TrialKey

Run = Callable[[TrialKey], Outcome]

_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
# A death may have come from outside, so a trial gets a second worker before it is given up.
_WORKERS_A_TRIAL = 2


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


@dataclass(slots=True, eq=False)
class _Worker:
    """A process and the trial that it has in hand.

    It is reached by a pipe alone. `concurrent.futures` would need named semaphores, which a container without /dev/shm
    does not have, and cannot tell which trial a dead worker was at.
    """

    process: SpawnProcess
    connection: Connection
    key: TrialKey | None = None

    @classmethod
    def start(cls, run: Run) -> _Worker:
        # Spawned, not forked: a fork would inherit the driver's threads and its open store.
        context = multiprocessing.get_context("spawn")
        here, there = context.Pipe()
        process = context.Process(target=_serve, args=(there, run), daemon=True)
        # Its start unblocks signals; it must be behind us.
        resource_tracker.ensure_running()
        with _environment(dict.fromkeys(_ONE_THREAD, "1")), _interrupts_held():
            process.start()
        # The worker's end must be closed here, or its death would not end the pipe.
        there.close()
        return cls(process, here)

    def take(self, key: TrialKey) -> None:
        self.key = key
        # A worker that is dead already shows at the next read.
        with suppress(OSError):
            self.connection.send(key)

    def stop(self, at_once: bool) -> None:
        self.connection.close()
        if at_once:
            self.process.terminate()
        self.process.join()


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
        """Yield the trials as they finish; one whose worker dies is given to another worker once."""
        waiting, deaths = deque(keys), Counter[TrialKey]()
        pool = [_Worker.start(run) for _ in range(min(self.workers or _n_cores(), len(keys)))]
        finished = False
        try:
            for worker in pool:
                worker.take(waiting.popleft())
            while busy := [worker for worker in pool if worker.key is not None]:
                ready = wait([worker.connection for worker in busy])
                for worker in (worker for worker in busy if worker.connection in ready):
                    key, outcome = _answer(worker)
                    if outcome is None:
                        deaths[key] += 1
                        worker.stop(at_once=True)
                        fresh = _Worker.start(run)
                        pool[pool.index(worker)] = worker = fresh
                        if deaths[key] < _WORKERS_A_TRIAL:
                            waiting.append(key)
                        else:
                            outcome = failed_outcome(key, "The worker process died (killed, or out of memory).", True)
                    if waiting:
                        worker.take(waiting.popleft())
                    if outcome is not None:
                        yield key, outcome
            finished = True
        finally:
            for worker in pool:
                worker.stop(at_once=not finished)


def _answer(worker: _Worker) -> tuple[TrialKey, Outcome | None]:
    """Read what a worker hands back for its trial, None if it died."""
    key = worker.key
    assert key is not None
    worker.key = None
    try:
        outcome: Outcome = worker.connection.recv()
    except (EOFError, OSError):
        return key, None
    return key, outcome


def _n_cores() -> int:
    # Fewer than the machine has where a container or taskset says so; not every system can tell.
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def _environment(values: dict[str, str]) -> Iterator[None]:
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """Hold ctrl-C back until the block is over; a process started in it never gets one, also while it imports."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _serve(connection: Connection, run: Run) -> None:
    """Carry trials out until the driver closes the pipe."""
    # ctrl-C is the driver's to handle; if the driver is killed, nobody would end a running trial but this process.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    with one_thread(), suppress(EOFError):
        while True:
            connection.send(carry_out(run, connection.recv()))


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)

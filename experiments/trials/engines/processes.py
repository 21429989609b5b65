"""A pool of worker processes on this machine."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any

from experiments.trials.engines.engine import WORKERS_A_TRIAL, Finished, Prepare, Run
from experiments.trials.record import Outcome, carry_out, failed_outcome
from experiments.trials.schema import TrialKey
from experiments.trials.threads import ONE_THREAD, environment, n_cores, one_thread


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
        with environment(ONE_THREAD), _interrupts_held():
            process.start()
        # The worker's end must be closed here, or its death would not end the pipe.
        there.close()
        return cls(process, here)

    def share(self, shared: Any) -> None:
        """Hand over what the trials share, once, before the first trial."""
        self._send(shared)

    def take(self, key: TrialKey) -> None:
        self.key = key
        self._send(key)

    def _send(self, message: Any) -> None:
        # A worker that is dead already shows at the next read.
        with suppress(OSError):
            self.connection.send(message)

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

    def run(self, keys: Sequence[TrialKey], run: Run, prepare: Prepare) -> Finished:
        """Yield the trials as they finish; one whose worker dies is given to another worker once."""
        waiting, deaths = deque(keys), Counter[TrialKey]()
        pool: list[_Worker] = []
        finished = False
        try:
            for _ in range(min(self.workers or n_cores(), len(keys))):
                pool.append(_Worker.start(run))
            # They take seconds to import what `run` needs: that goes on beside this.
            shared = prepare()
            for worker in pool:
                worker.share(shared)
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
                        worker.share(shared)
                        if deaths[key] < WORKERS_A_TRIAL:
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
        shared = connection.recv()
        while True:
            connection.send(carry_out(partial(run, shared), connection.recv()))


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)

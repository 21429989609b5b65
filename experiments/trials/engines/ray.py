"""Tasks of a Ray cluster: one that runs already, or one of this machine's cores that ends with the run."""

from __future__ import annotations

import logging
import os
import pickle
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stdout, suppress
from dataclasses import dataclass
from functools import partial
from io import StringIO
from typing import Any

import ray
from ray.exceptions import RayError

from deskew.errors import InputError, StepError, in_one_line, require
from experiments.trials.engines.engine import WORKERS_A_TRIAL, Finished, Prepare, Run
from experiments.trials.record import Outcome, carry_out, failed_outcome
from experiments.trials.schema import TrialKey
from experiments.trials.threads import ONE_THREAD, n_cores, one_thread

# Waiting looks at every task that Ray has in hand, so it is not given all of a long run at once.
_MOST_AT_ONCE = 1000
_CONNECT_SECONDS = 5.0
# `ray status` takes one or two seconds, more on a busy machine.
_ANSWER_SECONDS = 30.0


@dataclass(frozen=True, slots=True)
class Ray:
    """A Ray cluster; Ray itself gives a trial to another worker when a worker or a node dies.

    Attributes
    ----------
    address : str or None
        HOST:PORT of a cluster that runs; None starts one on this machine, reachable from nowhere else.
    workers : int or None
        Trials at once; None for as many as the cluster has cores.
    """

    address: str | None = None
    workers: int | None = None

    def run(self, keys: Sequence[TrialKey], run: Run, prepare: Prepare) -> Finished:
        """Yield the trials as they finish; one that dies with its worker or node again and again is lost.

        Raises
        ------
        InputError
            If no cluster can be had.
        """
        # Ray prints pages about every dead worker, and has no switch for it; what matters is in the outcomes.
        with redirect_stdout(StringIO()):
            try:
                self._connect()
                # Bytes, so that a worker's arrays are its own and writable, as in any other engine.
                work = ray.put(pickle.dumps((run, prepare())))
                yield from self._outcomes(keys, work)
            finally:
                ray.shutdown()

    def _outcomes(self, keys: Sequence[TrialKey], work: Any) -> Finished:
        task = ray.remote(_carry_out).options(num_cpus=1, max_retries=WORKERS_A_TRIAL - 1)
        waiting, running = list(reversed(keys)), dict[Any, TrialKey]()
        while waiting or running:
            while waiting and len(running) < (self.workers or _MOST_AT_ONCE):
                key = waiting.pop()
                running[task.remote(work, key)] = key
            done, _ = ray.wait(list(running))
            for reference in done:
                key = running.pop(reference)
                yield key, _outcome(reference, key)

    def _connect(self) -> None:
        # Whether its token is used, and the like.
        logging.getLogger("ray").setLevel(logging.ERROR)
        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
        options: dict[str, Any] = {"configure_logging": False, "log_to_driver": False}
        if self.address is None:
            options |= {"num_cpus": self.workers or n_cores(), "include_dashboard": False}
            options |= {"_node_ip_address": "127.0.0.1"}
        else:
            _require_cluster(self.address)
        try:
            with _interrupts_deferred():
                ray.init(self.address or "local", runtime_env={"env_vars": ONE_THREAD}, **options)
        except (RayError, OSError, RuntimeError, ValueError) as error:
            if self.address is None:
                raise StepError(f"Starting Ray on this machine failed: {in_one_line(error)}.") from error
            raise InputError(
                f"`engine.address` must lead to a Ray cluster of this Python and Ray, got {self.address}: "
                f"{in_one_line(error)}."
            ) from error


def _require_cluster(address: str) -> None:
    """Raise an InputError unless a cluster answers: `ray.init` itself would try for minutes."""
    name, allowed = "engine.address", "be HOST:PORT of a Ray cluster that runs, or null to start one here"
    host, _, port = address.rpartition(":")
    require(bool(host) and port.isdigit(), name, allowed, address)
    try:
        socket.create_connection((host, int(port)), _CONNECT_SECONDS).close()
    except (OSError, OverflowError) as error:
        raise InputError(f"`{name}` must {allowed}, got {address}: {error}.") from error
    # Something else may listen there.
    asked = None
    with suppress(subprocess.TimeoutExpired):
        command = (sys.executable, "-m", "ray.scripts.scripts", "status", "--address", address)
        asked = subprocess.run(command, capture_output=True, timeout=_ANSWER_SECONDS, check=False)
    answered = asked is not None and asked.returncode == 0
    require(answered, name, allowed, f"{address}, where none answers (one with a token needs RAY_AUTH_MODE=token)")


@contextmanager
def _interrupts_deferred() -> Iterator[None]:
    """Let ctrl-C take effect after the block: half-way through its start Ray would crash or leave processes behind."""
    seen: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: seen.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if seen:
        raise KeyboardInterrupt


def _carry_out(work: bytes, key: TrialKey) -> Outcome:
    run, shared = pickle.loads(work)
    with one_thread():
        return carry_out(partial(run, shared), key)


def _outcome(reference: Any, key: TrialKey) -> Outcome:
    try:
        outcome: Outcome = ray.get(reference)
    except RayError as error:
        return failed_outcome(key, f"Its Ray worker or node died: {in_one_line(error)}", lost=True)
    return outcome

"""One thread a trial: sums are then taken in one order, so that bytes repeat by any engine."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from deskew.threads import one_thread

__all__ = ["ONE_THREAD", "environment", "n_cores", "one_thread"]

# What a process that carries trials out must find in its environment before it imports anything.
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")


@contextmanager
def environment(values: Mapping[str, str]) -> Iterator[None]:
    """Give these variables to the processes that are started in the block."""
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


def n_cores() -> int:
    """Return the cores that this process may use: fewer than the machine has where a container or taskset says so."""
    # Not every system can tell.
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1

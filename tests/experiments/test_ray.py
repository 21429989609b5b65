"""A Ray cluster on loopback, joined by address: a worker, a node and the driver are killed under 200 trials."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.experiments.driven import N_TRIALS, ROOT, Run, kept, parent_of, processes_of, until

pytestmark = pytest.mark.skipif(find_spec("ray") is None, reason="ray is not installed")

# Ray's switch for staying on loopback; no token is made in the home folder.
VARIABLES = {"RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0", "RAY_AUTH_MODE": "disabled", "RAY_USAGE_STATS_ENABLED": "0"}


@dataclass
class Cluster:
    """A head and a second node with a core each, all processes of which belong to one session."""

    address: str
    raylet: int
    session: int
    log: Path

    def start(self, out: Path) -> Run:
        return Run.start(out, self.log, "engine=ray", f"engine.address={self.address}", variables=VARIABLES)

    def workers(self) -> list[int]:
        return processes_of(self.session, "ray::_carry_out")

    def kill_a_worker(self) -> bool:
        """Kill a worker, if one is at work at this moment."""
        for worker in self.workers():
            with suppress(ProcessLookupError):
                os.kill(worker, signal.SIGKILL)
                return True
        return False

    def second_node_works(self) -> bool:
        return self.raylet in map(parent_of, self.workers())


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    log = tmp_path_factory.mktemp("ray") / "log"
    # Ray gives a node half a minute to start, which a busy machine may need more than once.
    for _ in range(3):
        nodes = _nodes(log)
        assert nodes.stdout is not None
        words = nodes.stdout.readline().split()
        if words:
            break
        _end(nodes)
    if not words and "timed out during startup" in log.with_name("messages").read_text():
        pytest.skip("this machine started no Ray node within half a minute, three times")
    assert len(words) == 2, log.with_name("messages").read_text()
    yield Cluster(words[0], int(words[1]), nodes.pid, log)
    _end(nodes)


def _nodes(log: Path) -> subprocess.Popen[str]:
    with log.with_name("messages").open("wb") as messages:
        return subprocess.Popen(
            [sys.executable, "-m", "tests.experiments.ray_nodes"],
            cwd=ROOT,
            env={**os.environ, **VARIABLES, "FAKE_LOG": str(log)},
            start_new_session=True,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=messages,
            text=True,
        )


def _end(nodes: subprocess.Popen[str]) -> None:
    nodes.communicate(timeout=60)
    for process in processes_of(nodes.pid):
        os.kill(process, signal.SIGKILL)


def test_a_run_interrupted_and_then_killed_goes_on_from_there(cluster: Cluster, out: Path, undisturbed: bytes) -> None:
    run = cluster.start(out)
    run.until(50)
    code, line = run.interrupt()
    assert (code, line) == (130, "Interrupted; finished trials are kept, and the same command goes on from there.")
    first = kept(out)

    run = cluster.start(out)
    run.until(50)
    run.kill()
    # The cluster ends what a dead driver left running.
    until(lambda: not cluster.workers())
    second, again = kept(out), run.trials()

    run = cluster.start(out)
    run.end()
    assert set(first) < set(second)
    assert not set(first) & set(again)
    assert not set(second) & set(run.trials())
    assert sorted(kept(out)) == list(range(N_TRIALS))
    assert (out / "results.csv").read_bytes() == undisturbed


def test_a_killed_worker_and_then_a_killed_node_lose_no_row(cluster: Cluster, out: Path, undisturbed: bytes) -> None:
    run = cluster.start(out)
    run.until(40)
    # Ray names a worker by what it does, so that between two trials none has the name.
    until(cluster.kill_a_worker)
    run.until(80)
    until(cluster.second_node_works)
    os.kill(cluster.raylet, signal.SIGKILL)
    run.end()
    assert not cluster.second_node_works()
    assert sorted(kept(out)) == list(range(N_TRIALS))
    assert (out / "results.csv").read_bytes() == undisturbed

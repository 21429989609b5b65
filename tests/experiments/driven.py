"""A run of 200 trials in a process of its own, and what tests do to it and its workers."""

from __future__ import annotations

import os
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from tests.experiments.fake_study import SLOW

ROOT = Path(__file__).resolve().parents[2]
N_TRIALS = 200
COMMAND = (sys.executable, "-m", "tests.experiments.fake_program", f"trials={N_TRIALS}", f"sheet.slope_p90_deg={SLOW}")


def until(holds: Callable[[], bool], seconds: float = 180.0) -> None:
    """Wait until something holds, and fail if it does not in this time."""
    deadline = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.02)


def processes_of(session: int, words: str = "") -> list[int]:
    """Return the live processes of a session whose command line holds these words."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        # One may end while it is looked at.
        with suppress(OSError):
            state, *fields = (folder / "stat").read_text().rpartition(")")[2].split()
            command = (folder / "cmdline").read_bytes().replace(b"\0", b" ").decode()
            if int(fields[2]) == session and state != "Z" and words in command:
                found.append(int(folder.name))
    return found


def parent_of(process: int) -> int | None:
    """Return the parent of a process, None if it has ended."""
    with suppress(OSError):
        return int(Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[1])
    return None


@dataclass
class Run:
    """A run whose trials write into `log`."""

    out: Path
    log: Path
    process: subprocess.Popen[str]

    @classmethod
    def start(cls, out: Path, log: Path, *overrides: str, variables: Mapping[str, str] | None = None) -> Run:
        log.write_text("")
        process = subprocess.Popen(
            [*COMMAND, f"out={out}", *overrides],
            cwd=ROOT,
            env={**os.environ, "FAKE_LOG": str(log), **(variables or {})},
            start_new_session=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        return cls(out, log, process)

    def trials(self) -> list[int]:
        """Return the trials that this run has carried out, in the order in which they finished."""
        return [int(line.split()[1]) for line in self.log.read_text().splitlines() if line.startswith("trial ")]

    def until(self, n_trials: int) -> None:
        """Wait for so many of its trials."""
        until(lambda: len(self.trials()) >= n_trials or self.process.poll() is not None)
        assert self.process.poll() is None, self.process.communicate()

    def kill(self) -> None:
        """Kill the driver alone, without a word."""
        self.process.send_signal(signal.SIGKILL)
        self.process.communicate()

    def interrupt(self) -> tuple[int, str]:
        """Press ctrl-C, which a terminal sends to all processes; return the exit code and the last line on stderr."""
        os.killpg(self.process.pid, signal.SIGINT)
        _, error = self.process.communicate(timeout=180)
        return self.process.returncode, error.splitlines()[-1]

    def end(self) -> None:
        """See it end well."""
        printed, error = self.process.communicate(timeout=300)
        assert self.process.returncode == 0, error
        assert printed.startswith(f"fake: {N_TRIALS} trials, "), printed
        assert "failed" not in printed, printed


def kept(out: Path) -> list[int]:
    """Return the trials in a store that nobody has open."""
    with sqlite3.connect(out / "results.sqlite") as connection:
        return [trial for (trial,) in connection.execute("SELECT trial FROM trials WHERE condition = '-'")]

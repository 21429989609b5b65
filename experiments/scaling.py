"""Measure what docs/scaling.md reckons with: a page by command, the engines' overhead, two cores against one.

    python -m experiments.scaling

writes docs/scaling.csv; ``python -m experiments.reporting.scaling`` then makes the tables. It takes a quarter of an
hour on a machine that has nothing else to do.
"""

from __future__ import annotations

import csv
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from deskew.errors import StepError
from deskew.io import write_bytes
from experiments.settings import EngineSettings
from experiments.trials import Outcome, Row, Store, TrialKey, chosen_engine
from experiments.trials.threads import ONE_THREAD

_ROOT = Path(__file__).resolve().parents[1]
_PATTERNS = ("line_sweep", "gray_code")
_ENGINES = ("serial", "processes", "ray", "slurm")
_N_TRIVIAL = 200
# Shared by two cores: 24 trials of the experiment that prepares nothing first.
_N_TRIALS, _N_REPEATS = 6, 2


class Measurement(NamedTuple):
    """A line of docs/scaling.csv; a case that is measured again has another line."""

    subject: str
    case: str
    quantity: str
    value: float


def measured() -> Iterator[Measurement]:
    """Yield every measurement as soon as it is there."""
    with TemporaryDirectory(prefix="scaling.") as scratch:
        for pattern in _PATTERNS:
            yield from _pages(Path(scratch) / pattern, pattern)
        for name in _ENGINES:
            yield from _overhead(name, Path(scratch) / name)
        # One and two in turns: what else the machine does then meets both.
        for workers in (1, 2) * _N_REPEATS:
            with TemporaryDirectory(dir=scratch) as out:
                yield from _campaign(workers, Path(out))


def _pages(folder: Path, pattern: str) -> Iterator[Measurement]:
    """Measure the commands that take a stored capture to a restored page."""
    _run(sys.executable, "-m", "data_synth.captures", str(folder), "--pattern", pattern)
    page, board, made = folder / "page_00", folder / "board", folder / "calibration.json"
    deskew = str(Path(sys.executable).with_name("deskew"))
    commands = {
        "calibrate": ("calibrate", str(board), "-o", str(made)),
        "start": ("run", "--help"),
        "scan": ("scan", str(page), "-c", str(made), "-o", str(folder / "scan.npz")),
        "restore": ("restore", str(folder / "scan.npz"), "-o", str(folder / "restored.png")),
        "run": ("run", str(page), "-c", str(made), "-o", str(folder / "page.png")),
    }
    for command, words in commands.items():
        for _ in range(1 if command == "calibrate" else 3):
            for quantity, value in _run(deskew, *words).items():
                yield Measurement(pattern, command, quantity, value)
    for case, path in (
        ("page", page),
        ("board", board),
        ("scan", folder / "scan.npz"),
        ("restored", folder / "page.png"),
    ):
        yield Measurement(pattern, case, "bytes", _size(path))
    yield Measurement(pattern, "page", "frames", len(list(page.rglob("*.png"))))


def _overhead(name: str, out: Path) -> Iterator[Measurement]:
    """Measure an engine with two workers on trials that do nothing, until the store has them."""
    keys = [TrialKey("scaling", trial=trial) for trial in range(_N_TRIVIAL)]
    engine = chosen_engine(EngineSettings(name, workers=2, cluster="local"), out, "scaling")
    start = time.perf_counter()
    first: float | None = None
    with Store(out, "scaling") as store, closing(engine.run(keys, nothing, lambda: None)) as outcomes:
        for key, outcome in outcomes:
            store.record(key, outcome)
            first = first or time.perf_counter()
        last = time.perf_counter()
    assert first is not None
    yield Measurement("engine", name, "seconds_start", first - start)
    yield Measurement("engine", name, "seconds_trials", last - first)


def nothing(shared: Any, key: TrialKey) -> Outcome:
    """Carry out a trial that costs nothing."""
    return Outcome((Row.of(key, key.condition, key.method, "misses", 0.0),))


def _campaign(workers: int, out: Path) -> Iterator[Measurement]:
    """Measure a whole run, from the command to the report."""
    keys = ("experiment=surfaces", f"trials={_N_TRIALS}", "engine=processes", f"engine.workers={workers}")
    used = _run(sys.executable, "-m", "experiments", *keys, f"out={out}")
    yield Measurement("surfaces", f"workers={workers}", "seconds_wall", used["seconds_wall"])
    with (out / "timings.csv").open() as file:
        trials = {(line["trial"], line["condition"]) for line in csv.DictReader(file) if line["metric"] == "peak_mb"}
    yield Measurement("surfaces", "trials", "count", len(trials))
    yield Measurement("surfaces", "store", "bytes", _size(out / "results.sqlite"))


def _run(*command: str) -> dict[str, float]:
    """Run a command on one thread; return its wall-clock and CPU time [s] and its peak memory [MB]."""
    start = time.perf_counter()
    variables = {**os.environ, **ONE_THREAD}
    with subprocess.Popen(
        command, cwd=_ROOT, env=variables, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
    ) as process:
        assert process.stderr is not None
        message = process.stderr.read()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise StepError(f"`{' '.join(command)}` failed: {message.decode().strip()}")
    return {
        "seconds_wall": time.perf_counter() - start,
        "seconds_cpu": usage.ru_utime + usage.ru_stime,
        "peak_mb": usage.ru_maxrss / 1024.0,
    }


def _size(path: Path) -> float:
    files = [path] if path.is_file() else [file for file in path.rglob("*") if file.is_file()]
    return float(sum(file.stat().st_size for file in files))


def main() -> None:
    """Measure everything and write docs/scaling.csv."""
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(Measurement._fields)
    for line in measured():
        writer.writerow((*line[:3], f"{line.value:.6g}"))
        print(*line[:3], f"{line.value:.6g}", file=sys.stderr)
    write_bytes(text.getvalue().encode(), _ROOT / "docs" / "scaling.csv")


if __name__ == "__main__":
    # Workers find `nothing` under the module's own name.
    from experiments.scaling import main as run

    run()

"""What one trial hands back: its numbers, its times, its pictures and its failures."""

from __future__ import annotations

import resource
import sys
import time
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from deskew.errors import DeskewError, require
from experiments.trials.schema import Failure, Row, TrialKey

FAILED = "failed"
SECONDS_TRIAL = "seconds_trial"
"""The wall-clock time of a whole trial, what no stage times included."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """Everything that one trial produced.

    Attributes
    ----------
    rows, timings : tuples of Row
        Results, the same in every rerun; and times and memory, which are not.
    failures : tuple of Failure
        The reason of each row whose metric is `failed`.
    pictures : mapping of name to PNG bytes
        Written as `figures/NAME.png`.
    lost : bool
        The worker died under the trial, which says nothing about the trial itself: the next run tries again.
    """

    rows: tuple[Row, ...]
    timings: tuple[Row, ...] = ()
    failures: tuple[Failure, ...] = ()
    pictures: Mapping[str, bytes] = field(default_factory=dict)
    lost: bool = False


class Recorder:
    """Collects a trial's numbers while it runs.

    Examples
    --------
    >>> record = Recorder(TrialKey("corner_distance", trial=3, seed=1))
    >>> with record.stage("decode"):
    ...     pass
    >>> record.add("restored", "paper_euler", {"corner_mean_px": 0.4})
    >>> [row.metric for row in record.outcome().rows]
    ['corner_mean_px']
    """

    def __init__(self, key: TrialKey) -> None:
        self.key, self._start = key, time.perf_counter()
        self._rows: dict[tuple[str, str, str], Row] = {}
        self._timings: dict[tuple[str, str, str], float] = {}
        self._failures: list[Failure] = []
        self._pictures: dict[str, bytes] = {}
        self._peak_mb = 0.0
        _reset_peak()

    def add(self, condition: str, method: str, metrics: Mapping[str, float]) -> None:
        """Record finite numbers of a condition and a method ("-" for none), each metric once."""
        for metric, value in metrics.items():
            place = (condition, method, metric)
            require(place not in self._rows, metric, f"be recorded once for {condition}, {method}", "a second value")
            self._rows[place] = Row.of(self.key, condition, method, metric, value)

    def picture(self, name: str, image: npt.NDArray[np.uint8]) -> None:
        """Record an 8-bit image, (height, width) grey or (height, width, 3) RGB, for `figures/NAME.png`."""
        ok, png = cv2.imencode(".png", image[..., ::-1] if image.ndim == 3 else image)
        require(bool(ok), name, "be an image that PNG can hold", image.shape)
        self._pictures[name] = png.tobytes()

    @contextmanager
    def stage(self, name: str, condition: str | None = None, method: str | None = None) -> Iterator[None]:
        """Add the wall-clock time of the block to `seconds_NAME` [s]; without a place, to the trial's own."""
        start = time.perf_counter()
        try:
            yield
        finally:
            place = (condition or self.key.condition, method or self.key.method, f"seconds_{name}")
            self._timings[place] = self._timings.get(place, 0.0) + time.perf_counter() - start

    @contextmanager
    def memory(self, condition: str, method: str = "-") -> Iterator[None]:
        """Record the process's peak memory during the block as `peak_mb` [MB]."""
        self._peak_mb = max(self._peak_mb, _peak_mb())
        _reset_peak()
        yield
        peak = _peak_mb()
        self._peak_mb = max(self._peak_mb, peak)
        self.add_times(condition, method, {"peak_mb": peak})

    def add_times(self, condition: str, method: str, metrics: Mapping[str, float]) -> None:
        """Record numbers that no rerun repeats; they go into `timings.csv` and nowhere else."""
        self._timings |= {(condition, method, metric): value for metric, value in metrics.items()}

    @contextmanager
    def attempt(self, condition: str, method: str = "-") -> Iterator[None]:
        """Report what breaks in the block as a failure of this condition and method; the trial goes on."""
        try:
            yield
        except Exception as error:
            self.fail(condition, method, reason_of(error))

    def fail(self, condition: str, method: str, reason: str) -> None:
        """Record a failure: a row with metric `failed`, value 1, in place of this condition's and method's numbers."""
        for place in [place for place in self._rows if place[:2] == (condition, method)]:
            del self._rows[place]
        self._rows[(condition, method, FAILED)] = Row.of(self.key, condition, method, FAILED, 1.0)
        self._failures.append(Failure(condition, method, self.key.trial, self.key.seed, reason))

    def outcome(self) -> Outcome:
        """Return what was recorded, with the time of the trial and the peak memory of its process."""
        timings = [Row.of(self.key, *place, value) for place, value in self._timings.items()]
        whole = {"peak_mb": max(self._peak_mb, _peak_mb()), SECONDS_TRIAL: time.perf_counter() - self._start}
        timings += [Row.of(self.key, self.key.condition, self.key.method, *item) for item in whole.items()]
        rows = tuple(sorted(self._rows.values()))
        return Outcome(rows, tuple(sorted(timings)), tuple(sorted(self._failures)), dict(self._pictures))


def failed_outcome(key: TrialKey, reason: str, lost: bool = False) -> Outcome:
    """Return the outcome of a trial that gave nothing but a reason."""
    row = Row.of(key, key.condition, key.method, FAILED, 1.0)
    failure = Failure(key.condition, key.method, key.trial, key.seed, reason)
    return Outcome((row,), failures=(failure,), lost=lost)


def carry_out(run: Callable[[TrialKey], Outcome], key: TrialKey) -> Outcome:
    """Run a trial; whatever it raises becomes a failed trial with its reason."""
    try:
        return run(key)
    except Exception as error:
        return failed_outcome(key, reason_of(error))


def reason_of(error: BaseException) -> str:
    """Say in one line what went wrong; an unforeseen error names its kind and its place too."""
    text = " ".join(str(error).split())
    if isinstance(error, DeskewError):
        return text
    frames: list[Any] = traceback.extract_tb(error.__traceback__)
    place = f" ({Path(frames[-1].filename).name}:{frames[-1].lineno})" if frames else ""
    return f"{type(error).__name__}: {text}{place}"


def _reset_peak() -> None:
    # Linux alone can restart the high-water mark; elsewhere the figure is the process's peak so far.
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        return


def _peak_mb() -> float:
    try:
        status = Path("/proc/self/status").read_text()
        return float(status.split("VmHWM:")[1].split()[0]) / 1024.0
    except (OSError, IndexError):
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return peak / (1024.0**2 if sys.platform == "darwin" else 1024.0)  # bytes there, kilobytes elsewhere

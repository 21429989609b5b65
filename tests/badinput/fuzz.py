"""Fuzzing of every reader: damaged files end in the project's own error or are read, and in nothing else.

    python -m tests.badinput.fuzz                      # every reader, 10 minutes each
    python -m tests.badinput.fuzz --seconds 60 png ply

The same seed damages the same files in the same order. The first input of each kind of failure is kept in a folder that
is named on stderr; a reader that takes more than 5 s of the processor counts as hung. A TMPDIR in memory saves time.
"""

from __future__ import annotations

import argparse
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from types import FrameType

from deskew import io
from deskew.errors import DeskewError, InputError
from tests.badinput import mutations
from tests.badinput.samples import PAGE_MM, write_samples

SECONDS_MAX = 5.0


class Hung(BaseException):
    """A reader took too long; no reader's own `except` catches it."""


@dataclass(frozen=True, slots=True)
class Reader:
    """What is read, and which of the sample files are damaged for it.

    Attributes
    ----------
    name : str
        As the command line calls it.
    files : tuple of str
        Paths under the folder of samples; of several, each run damages one, or now and then two.
    read : callable
        Given the folder of samples.
    """

    name: str
    files: tuple[str, ...]
    read: Callable[[Path], object]


def _capture(name: str) -> Callable[[Path], object]:
    def read(folder: Path) -> object:
        found = io.read_capture(folder / name)
        return [*found.columns, *found.rows, *found.textures.values()]

    return read


def _table(folder: Path) -> object:
    from experiments.reporting.agreement import disagreements

    path = folder / "reports" / "surfaces" / "results.csv"
    return list(disagreements(path, path))


def _evidence(folder: Path) -> object:
    from experiments.reporting.claims.measures import Evidence

    return Evidence(folder / "reports").conditions("surfaces", "")


def _photograph(folder: Path) -> object:
    from experiments.studies.photographs import grey_photograph, true_words

    return grey_photograph(folder / "photograph.jpg"), true_words(folder / "words.json")


def _profile(folder: Path) -> object:
    found = io.read_profile(folder / "profiled.png")
    if found is None:  # a damaged one is none
        raise InputError("no profile")
    return found


def _baseline(folder: Path) -> object:
    from experiments.gate.baseline import read_baseline

    return read_baseline(folder / "baseline.csv")


def _reports(folder: Path) -> object:
    from experiments.page.runs import read_runs

    return read_runs(folder / "reports")


def _draft(folder: Path) -> object:
    from deskew.editor.draft import read_draft

    return read_draft(folder / "map.draft.npz")


def _sheet(folder: Path) -> object:
    from experiments.studies.given_sheets import read_sheet

    return read_sheet(folder / "sheet.npz", PAGE_MM)


READERS = {
    reader.name: reader
    for reader in (
        Reader("png", ("grey.png", "colour.png"), lambda f: [io.read_image(f / n) for n in ("grey.png", "colour.png")]),
        Reader("profile", ("profiled.png",), _profile),
        Reader("tiff", ("deep.tif",), lambda f: io.read_image(f / "deep.tif")),
        Reader("depth_tiff", ("segment/x.tif",), lambda f: io.read_depth_image(f / "segment/x.tif")),
        Reader("ply", ("bent.ply",), lambda f: io.read_mesh(f / "bent.ply")),
        Reader("obj", ("bent.obj",), lambda f: io.read_mesh(f / "bent.obj")),
        Reader("arrays", ("sheet.npz",), lambda f: io.read_arrays(f / "sheet.npz")),
        Reader("sheet", ("sheet.npz",), _sheet),
        Reader("depth", ("depth.npz",), lambda f: io.read_depth(f / "depth.npz")),
        Reader("scan", ("scan.npz",), lambda f: io.read_scan(f / "scan.npz")),
        Reader(
            "tifxyz",
            tuple(f"segment/{n}" for n in ("x.tif", "y.tif", "z.tif", "meta.json")),
            lambda f: io.read_tifxyz(f / "segment", 0.01),
        ),
        Reader("calibration", ("c.json",), lambda f: io.read_calibration(f / "c.json")),
        Reader("stiffness", ("materials.png", "materials.toml"), lambda f: io.read_stiffness(f / "materials.png")),
        Reader(
            "capture",
            ("page/capture.toml", "page/capture.toml", "page/white.png", "page/gray/03.png", "page/textures/uv.png"),
            _capture("page"),
        ),
        Reader("phase", ("phase/capture.toml",), _capture("phase")),
        Reader(
            "board",
            ("board/board.toml", "board/pose_01/capture.toml", "board/pose_02/black.png"),
            lambda f: io.read_board(f / "board"),
        ),
        Reader("results", ("reports/surfaces/results.csv",), _table),
        Reader("photograph", ("photograph.jpg", "words.json"), _photograph),
        Reader("baseline", ("baseline.csv", "baseline.json", "baseline.floors.csv"), _baseline),
        Reader("reports", ("reports/surfaces/results.csv", "reports/surfaces/run.json"), _reports),
        Reader("draft", ("map.draft.npz",), _draft),
        Reader("evidence", ("reports/surfaces/results.csv",), _evidence),
    )
}


@dataclass(slots=True)
class Tally:
    """What came of fuzzing one reader.

    Attributes
    ----------
    n_runs, n_read : int
        Damaged inputs, and how many of them were read all the same.
    failures : Counter of str
        Anything but the project's own error, by its kind and place; `hung` among them.
    seconds_max, seconds_cpu : float
        Longest single run by the clock, and time of the processor that all of them took [s].
    peak_mb : float
        Of the process [MB].
    """

    n_runs: int = 0
    n_read: int = 0
    failures: Counter[str] = field(default_factory=Counter)
    seconds_max: float = 0.0
    seconds_cpu: float = 0.0
    peak_mb: float = 0.0


def _ring(_: int, __: FrameType | None) -> None:
    raise Hung


def fuzz(
    reader: Reader, samples: Path, seed: int, *, seconds: float = float("inf"), n_runs: int | None = None
) -> Tally:
    """Damage a copy of a reader's files among the samples and read them, for so long or so often."""
    rng, tally, used = Random(f"{reader.name} {seed}"), Tally(), time.process_time()
    before = signal.signal(signal.SIGPROF, _ring)
    folder = Path(tempfile.mkdtemp(prefix=f"fuzz.{reader.name}."))
    try:
        shutil.copytree(samples, folder, dirs_exist_ok=True)
        whole = {name: (folder / name).read_bytes() for name in reader.files}
        end = time.monotonic() + seconds
        while tally.n_runs != n_runs and time.monotonic() < end:
            chosen = {rng.choice(reader.files) for _ in range(rng.choice((1, 1, 1, 2)))}
            for name in sorted(chosen):
                damage = mutations.of(Path(name).suffix, list(whole.values()))
                (folder / name).write_bytes(damage(rng, whole[name]))
            _run(reader, folder, tally)
            for name in chosen:
                (folder / name).write_bytes(whole[name])
    finally:
        signal.signal(signal.SIGPROF, before)
    shutil.rmtree(folder)
    tally.seconds_cpu = time.process_time() - used
    tally.peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    return tally


def _run(reader: Reader, folder: Path, tally: Tally) -> None:
    start = time.monotonic()
    signal.setitimer(signal.ITIMER_PROF, SECONDS_MAX)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        what = _outcome(reader, folder, tally)
    signal.setitimer(signal.ITIMER_PROF, 0.0)
    # A warning would be a second line on stderr.
    what = what or next((f"{w.category.__name__} at {Path(w.filename).name}:{w.lineno}" for w in said), "")
    if what:
        _keep(reader, folder, tally, what)
    tally.n_runs += 1
    tally.seconds_max = max(tally.seconds_max, time.monotonic() - start)


def _outcome(reader: Reader, folder: Path, tally: Tally) -> str:
    """Read once; return what went wrong, or nothing."""
    try:
        reader.read(folder)
        tally.n_read += 1
    except DeskewError as error:
        return "an error of two lines" if "\n" in str(error) else ""
    except Exception as error:
        frame = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__} at {Path(frame.filename).name}:{frame.lineno}"
    except Hung:
        return "hung"
    return ""


def _keep(reader: Reader, folder: Path, tally: Tally, what: str) -> None:
    """Count a failure, and keep the input of the first of its kind."""
    if what not in tally.failures:
        kept = Path(tempfile.mkdtemp(prefix=f"found.{reader.name}."))
        for name in reader.files:
            shutil.copy(folder / name, kept / name.replace("/", "_"))
        print(f"{reader.name}: {what}, see {kept}", file=sys.stderr)
    tally.failures[what] += 1


def main(argv: Sequence[str] | None = None) -> int:
    """Fuzz the readers that are named, one after another; 1 if any failed."""
    parser = argparse.ArgumentParser(prog="tests.badinput.fuzz", description="Fuzz every reader.")
    parser.add_argument("readers", nargs="*", help=f"of {', '.join(READERS)}; all by default")
    parser.add_argument("--seconds", type=float, default=600.0, help="for each reader [%(default)s]")
    parser.add_argument("--seed", type=int, default=0, help="[%(default)s]")
    chosen = parser.parse_args(argv)
    n_failed = 0
    samples = Path(tempfile.mkdtemp(prefix="fuzz.samples."))
    write_samples(samples)
    for name in chosen.readers or READERS:
        tally = fuzz(READERS[name], samples, chosen.seed, seconds=chosen.seconds)
        failed = ", ".join(f"{count} x {what}" for what, count in tally.failures.items()) or "no failure"
        print(
            f"{name}: {tally.n_runs} runs, {tally.n_read} read, {tally.seconds_cpu:.0f} s of the processor, "
            f"longest {tally.seconds_max:.2f} s, peak {tally.peak_mb:.0f} MB, {failed}",
            flush=True,
        )
        n_failed += bool(tally.failures)
    shutil.rmtree(samples)
    return int(n_failed > 0)


if __name__ == "__main__":
    sys.exit(main())

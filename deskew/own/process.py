"""Start an interpreter for one call of a method, wait for it, end it and all that it started, say how it went."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from deskew.errors import InputError, StepError
from deskew.io import read_arrays
from deskew.own.child import FAILURE, GIVEN, RETURNED
from deskew.own.confinement import Limits, adopting, hidden
from deskew.types import Array

_LOG = "output.txt"
_KEPT = ("PATH", "LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH", "NUMBA_CACHE_DIR")
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
_LONGEST_LINE = 300


def call(name: str, task: str, limits: Limits, write: Callable[[Path], None] | None = None) -> dict[str, Array]:
    """Call a method in a process of its own.

    Parameters
    ----------
    name : str
        As of :func:`deskew.plugins.locate`.
    task : str
        A kind of method, or `deskew.own.child.INSPECT`.
    limits : Limits
        What it may take.
    write : callable, optional
        Writes the NPZ file that the method is given.

    Returns
    -------
    dict
        What it returned, as plain arrays that nobody has judged yet.

    Raises
    ------
    StepError
        If it did anything else than return in time: "`NAME` ...", in one line.
    """
    with tempfile.TemporaryDirectory(prefix="deskew-own-", ignore_cleanup_errors=True) as scratch:
        folder = Path(scratch)
        if write is not None:
            write(folder / GIVEN)
        command = [sys.executable, "-P", "-m", "deskew.own.child", scratch, task, name]
        code = _run([*command, str(limits.memory_mb), str(limits.file_mb)], folder, limits.seconds)
        reason = _trouble(code, folder, limits)
        if reason is None:
            try:
                return read_arrays(folder / RETURNED)
            except InputError as error:
                reason = f"left a result that cannot be read: {str(error).replace(scratch, '').rstrip('.')}"
        raise StepError(f"`{name}` {reason}.")


def _run(command: list[str], folder: Path, seconds: float) -> int | None:
    """Run a command in a group of its own; return its exit code, None if time was up."""
    with (folder / _LOG).open("wb") as log, hidden(), adopting():
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
            cwd=folder,
            env=_environment(folder),
            start_new_session=True,
        )
        try:
            return process.wait(seconds)
        except subprocess.TimeoutExpired:
            return None
        finally:
            # What it started and left behind goes with it.
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def _environment(folder: Path) -> dict[str, str]:
    """Return what the interpreter needs to find the same modules, and nothing of what was set for this run."""
    paths = [Path(entry).resolve() for entry in sys.path]
    fixed = {
        "PYTHONPATH": os.pathsep.join(str(path) for path in paths if path.exists()),
        "PYTHONHASHSEED": "0",
        "LC_ALL": "C.UTF-8",
        "HOME": str(folder),
        "TMPDIR": str(folder),
    }
    kept = {name: os.environ[name] for name in _KEPT if name in os.environ}
    return kept | fixed | dict.fromkeys(_THREADS, "1")


def _trouble(code: int | None, folder: Path, limits: Limits) -> str | None:
    """Say what went wrong, None if there is a result."""
    if code is None:
        return f"took longer than the {limits.seconds:g} s that it may take{_last_words(folder)}"
    said = _line(folder / FAILURE)
    if code == 1 and said:
        return said
    if code < 0:
        names = {int(number): number.name for number in signal.Signals}
        return f"crashed with {names.get(-code, f'signal {-code}')}{_last_words(folder)}"
    if code > 0 or not (folder / RETURNED).exists():
        return f"ended with exit code {code} and without a result{_last_words(folder)}"
    return None


def _last_words(folder: Path) -> str:
    words = _line(folder / _LOG)
    return f"; it last said: {words}" if words else ""


def _line(path: Path) -> str:
    """Return the last line of a file that a method may have written, or nothing, short and printable."""
    try:
        with path.open("rb") as stream:
            stream.seek(max(0, path.stat().st_size - 4 * _LONGEST_LINE))
            lines = stream.read(4 * _LONGEST_LINE).decode(errors="replace").strip().splitlines()
    except OSError:
        return ""
    last = "".join(c if c.isprintable() else " " for c in lines[-1]) if lines else ""
    last = " ".join(last.split()).rstrip(".")
    return last if len(last) <= _LONGEST_LINE else f"{last[:_LONGEST_LINE]}..."

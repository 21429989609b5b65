"""What holds a method to its limits and away from the memory of the process that called it.

Limits are POSIX's and hold on every Unix, but for that of memory, which macOS does not enforce. The rest is Linux's;
elsewhere a method may leave processes behind that have left its group, and the system's own rules say who may read
whose memory.
"""

from __future__ import annotations

import ctypes
import os
import resource
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from deskew.errors import require_positive, require_whole

_MB = 1 << 20
# prctl's and capset's numbers, of <linux/prctl.h> and <linux/capability.h>.
_PARENT_DEATH_SIGNAL, _GET_DUMPABLE, _DUMPABLE, _SUBREAPER, _NO_NEW_PRIVILEGES = 1, 3, 4, 36, 38
_CAPABILITIES_V3, _OVERRIDE_FILE_MODES = 0x20080522, 1 << 1


@dataclass(frozen=True, slots=True)
class Limits:
    """What one call of a method may take.

    Attributes
    ----------
    seconds : float
        Wall clock, in (0, 86400], start of the interpreter included.
    memory_mb : int
        Address space, in [256, 1048576]: libraries and memory asked for and never touched count too.
    file_mb : int
        Largest file that it may write, in [1, 1024], its result among them.
    """

    seconds: float = 120.0
    memory_mb: int = 4096
    file_mb: int = 1024

    def __post_init__(self) -> None:
        require_positive("seconds", self.seconds, 86400.0, "s")
        require_whole("memory_mb", self.memory_mb, 256, 1 << 20)
        require_whole("file_mb", self.file_mb, 1, 1024)


def confine(memory_mb: int, file_mb: int) -> None:
    """Hold this process and all that it starts to limits; the child calls this before it imports the method.

    On Linux it dies with its parent, and loses every privilege that root has over the memory and the limits of others;
    files stay open to it, since a checkout may belong to somebody else.
    """
    for kind, most in (
        (resource.RLIMIT_AS, memory_mb * _MB),
        (resource.RLIMIT_FSIZE, file_mb * _MB),
        (resource.RLIMIT_CORE, 0),
    ):
        hard = resource.getrlimit(kind)[1]
        most = most if hard == resource.RLIM_INFINITY else min(most, hard)
        with suppress(ValueError, OSError):  # macOS knows limits that it does not set
            resource.setrlimit(kind, (most, most))
    if sys.platform == "linux":
        _prctl(_PARENT_DEATH_SIGNAL, signal.SIGKILL)
        _prctl(_NO_NEW_PRIVILEGES, 1)
        header = (ctypes.c_uint32 * 2)(_CAPABILITIES_V3, 0)
        kept = (ctypes.c_uint32 * 6)(_OVERRIDE_FILE_MODES, _OVERRIDE_FILE_MODES)
        if os.geteuid() == 0:
            ctypes.CDLL(None).capset(header, kept)


@contextmanager
def hidden() -> Iterator[None]:
    """Keep this process's memory from other processes of the same user for the block; Linux alone."""
    before = _prctl(_GET_DUMPABLE)
    _prctl(_DUMPABLE, 0)
    try:
        yield
    finally:
        _prctl(_DUMPABLE, 1 if before == 1 else 0)


@contextmanager
def adopting() -> Iterator[None]:
    """End, after the block, whatever was started in it by its processes and outlived them; Linux alone.

    Orphans become this process's children, whichever group and session they have moved to. No other thread may start
    processes meanwhile.
    """
    before = _children()
    _prctl(_SUBREAPER, 1)
    try:
        yield
    finally:
        # A killed one's children come to this process in turn.
        while strays := _children() - before:
            for pid in strays:
                with suppress(ProcessLookupError, ChildProcessError):
                    os.kill(pid, signal.SIGKILL)
                    os.waitpid(pid, 0)
        _prctl(_SUBREAPER, 0)


def _children() -> set[int]:
    found = set()
    for folder in Path("/proc").glob("[0-9]*") if sys.platform == "linux" else ():
        with suppress(OSError):
            # pid (name, which may hold anything) state parent ...
            parent = (folder / "stat").read_text(errors="replace").rpartition(")")[2].split()[1]
            if int(parent) == os.getpid():
                found.add(int(folder.name))
    return found


def _prctl(option: int, value: int = 0) -> int:
    """Return what Linux answers, -1 elsewhere."""
    return int(ctypes.CDLL(None).prctl(option, value, 0, 0, 0)) if sys.platform == "linux" else -1

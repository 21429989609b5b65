"""Long work in sight: a bar on a terminal; nothing into a log or a pipe, nor beside --json."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from deskew.types import Array, Capture, Frames

_T = TypeVar("_T")


def watched(items: Iterable[_T], label: str, unit: str, quiet: bool) -> Iterator[_T]:
    """Show how many items are done."""
    from tqdm import tqdm

    # disable=None: tqdm's own way to say "unless stderr is a terminal".
    yield from tqdm(items, label, unit=unit, file=sys.stderr, leave=False, disable=quiet or None)


@contextmanager
def working(label: str, quiet: bool) -> Iterator[None]:
    """Say what is being done for as long as it takes, where nothing can be counted."""
    from tqdm import tqdm

    with tqdm(bar_format=f"{label} ...", file=sys.stderr, leave=False, disable=quiet or None):
        yield


@dataclass(frozen=True, slots=True)
class _Watched:
    """Frames that show how far they have been read."""

    frames: Frames
    label: str

    def __len__(self) -> int:
        return len(self.frames)

    def __iter__(self) -> Iterator[Array]:
        return watched(self.frames, self.label, "frame", quiet=False)


def showing_progress(capture: Capture, label: str, quiet: bool) -> Capture:
    """Let a capture's frames show how far they have been read."""
    if quiet:
        return capture
    columns = _Watched(capture.columns, f"{label} columns")
    return replace(capture, columns=columns, rows=_Watched(capture.rows, f"{label} rows"))


def open_capture(folder: Path, quiet: bool) -> Capture:
    """Read a capture folder, its frames one by one and in sight."""
    from deskew import io

    return showing_progress(io.read_capture(folder), folder.name, quiet)

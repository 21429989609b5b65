"""One wrong input: the command line, what is broken beforehand, and what the one line on stderr has to say."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

Break = Callable[[Path], object]


@dataclass(frozen=True, slots=True)
class Case:
    """A command that has to be refused.

    Attributes
    ----------
    name : str
        What is wrong, unique in the corpus.
    line : str
        Command and arguments, as in a shell; `deskew`, or a module that is run by `python -m`. It is run in a folder
        with the files of `samples.write_samples`.
    words : tuple of str
        Parts of the one line on stderr: the thing that is named, what is allowed, what it got.
    broken : callable or None
        Given that folder, before the command is run.
    code : int
        2 for wrong input, 3 for a step that failed.
    environment : mapping
        Further variables.
    absent : tuple of str
        Modules that cannot be imported.
    file_bytes : int or None
        Largest file that may be written, as on a disk that is full.
    """

    name: str
    line: str
    words: tuple[str, ...]
    broken: Break | None = None
    code: int = 2
    environment: Mapping[str, str] = field(default_factory=dict)
    absent: tuple[str, ...] = ()
    file_bytes: int | None = None

    @property
    def program(self) -> str:
        """Module that is run."""
        return shlex.split(self.line)[0]

    @property
    def arguments(self) -> list[str]:
        """What follows it."""
        return shlex.split(self.line)[1:]


def written(name: str, content: bytes | str) -> Break:
    """Return what writes a file under the case's folder."""

    def write(here: Path) -> None:
        path = here / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content.encode() if isinstance(content, str) else content)

    return write


def edited(name: str, old: str, new: str) -> Break:
    """Return what replaces a part of a text file, which has to be there."""

    def edit(here: Path) -> None:
        text = (here / name).read_text()
        assert old in text, f"{name} holds no {old}"
        (here / name).write_text(text.replace(old, new))

    return edit

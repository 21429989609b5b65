"""Code blocks of Markdown pages, and the commands in them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from textwrap import dedent

ROOT = Path(__file__).resolve().parents[2]
PAGES = (ROOT / "README.md", *sorted(ROOT.glob("docs/*.md")))

_FENCE = re.compile(r"^(?P<indent> *)```(?P<language>[\w-]*)\n(?P<text>.*?)^(?P=indent)```$", re.DOTALL | re.MULTILINE)
_INDENTED = re.compile(r"^(?:    |\t)\S.*$", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Block:
    """A fenced block.

    Attributes
    ----------
    place : str
        Page and line, for messages.
    language : str
        What stands behind the opening fence.
    text : str
        What is in it.
    """

    place: str
    language: str
    text: str


def blocks(page: Path) -> list[Block]:
    """Return the fenced blocks of a page in their order."""
    text = page.read_text(encoding="utf-8")
    name = page.relative_to(ROOT)
    return [
        Block(f"{name}:{text.count(chr(10), 0, found.start()) + 1}", found["language"], dedent(found["text"]))
        for found in _FENCE.finditer(text)
    ]


def prose(page: Path) -> str:
    """Return a page without its fenced blocks."""
    return _FENCE.sub("", page.read_text(encoding="utf-8"))


def indented(page: Path) -> list[str]:
    """Return lines that Markdown takes for code because they are indented; a list's further lines are none."""
    found = []
    before = ""
    for line in prose(page).splitlines():
        if _INDENTED.match(line) and not before.strip():
            found.append(line)
        before = line
    return found


def commands(block: Block) -> Iterator[str]:
    """Yield the commands of a shell block, each on one line, without comments."""
    for line in block.text.replace("\\\n", " ").splitlines():
        command = " ".join(line.split("#")[0].split())
        if command:
            yield command

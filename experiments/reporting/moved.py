"""Every committed number that moves has its line in the changelog, with the digest of the table that holds it.

    python -m experiments.reporting.moved                     # names the tables without a line; exit code 1
    python -m experiments.reporting.moved "Why they moved"    # adds a line to CHANGELOG.md

A line reads ``- Why: `NAME` DIGEST, `NAME` DIGEST.`` and stands under the newest heading "### Numbers"; old ones stay.
"""

from __future__ import annotations

import hashlib
import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import fill

from deskew.errors import InputError, require
from deskew.io import write_bytes

ROOT = Path(__file__).resolve().parents[2]

_HEADING = "### Numbers\n"
_DIGITS = 10
_TABLE = re.compile(r"`([\w./]+)`\s+([0-9a-f]{10})\b")
# A reason, then the tables.
_LINE = re.compile(r"- [^`\s].*?:\s+`", re.DOTALL)


def digests(reports: Path) -> dict[str, str]:
    """Return the first ten hexadecimal digits of the SHA-256 of each committed table, by name.

    Parameters
    ----------
    reports : Path
        Holds `NAME/results.csv`, and `baseline/NAME.csv` of the gate, called `baseline/NAME` here.
    """
    tables = {path.parent.name: path for path in reports.glob("*/results.csv")}
    tables |= {f"baseline/{path.stem}": path for path in reports.glob("baseline/*.csv")}
    return {name: hashlib.sha256(path.read_bytes()).hexdigest()[:_DIGITS] for name, path in sorted(tables.items())}


def without_line(changelog: str, tables: Mapping[str, str]) -> dict[str, str]:
    """Return the tables, name and digest, that no line of the changelog gives a reason for."""
    told = set[tuple[str, str]]()
    for item in re.split(r"^(?=- |#)", changelog, flags=re.MULTILINE):
        if _LINE.match(item):
            told.update(_TABLE.findall(item))
    return {name: digest for name, digest in tables.items() if (name, digest) not in told}


def with_line(changelog: str, tables: Mapping[str, str], why: str) -> str:
    """Return the changelog with a line for these tables under its newest heading of numbers.

    Raises
    ------
    InputError
        If there is no such heading, or no reason.
    """
    require(why.strip() != "" and why.isprintable(), "why", "be a reason on one line", repr(why))
    require(_HEADING in changelog, "CHANGELOG.md", f"have the heading {_HEADING.strip()!r}", "none")
    named = ", ".join(f"`{name}` {digest}" for name, digest in tables.items())
    line = fill(f"- {why}: {named}.", 120, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)
    before, after = changelog.split(_HEADING, maxsplit=1)
    return f"{before}{_HEADING}{line}\n{after}"


def main(arguments: Sequence[str], root: Path = ROOT) -> int:
    """Add the missing line, or name its tables."""
    path = root / "CHANGELOG.md"
    changelog = path.read_text(encoding="utf-8")
    missing = without_line(changelog, digests(root / "reports"))
    try:
        require(len(arguments) <= 1, "arguments", "be one reason or none", len(arguments))
        if missing and arguments:
            write_bytes(with_line(changelog, missing, arguments[0]).encode(), path)
    except InputError as error:
        print(error, file=sys.stderr)
        return error.exit_code
    for name, digest in missing.items():
        print(f"{name} {digest}")
    return int(bool(missing) and not arguments)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

"""Files and folders: bounded reads, paths that stay inside their folder, and writes that appear whole or not at all."""

from __future__ import annotations

import codecs
import json
import os
import reprlib
import shutil
import tempfile
import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from deskew.errors import InputError, StepError, require

MAX_TEXT_BYTES = 1 << 20
"""Largest TOML or JSON file that is parsed: a thousand times what the project writes."""

MAX_FILE_BYTES = 1 << 29
"""Largest image or mesh file that is opened: what is wrong with it is then said within 1 GB of memory."""

MAX_NAME_BYTES = 255
"""Longest name that common file systems take."""

_SHORT = reprlib.Repr()
_SHORT.maxstring = _SHORT.maxother = 60


def shown(value: object) -> str:
    """Return `value` short enough for a one-line message, whatever a hostile file put there."""
    return _SHORT.repr(value)


def _kind(path: Path) -> str:
    # os.path answers for names that pathlib raises on: too long, with a null byte, in a loop of links.
    if os.path.isdir(path):  # noqa: PTH112
        return "a folder"
    if os.path.isfile(path):  # noqa: PTH113
        return "a file"
    return "something else" if os.path.lexists(path) else "nothing there"


def require_file(path: Path) -> None:
    """Raise an InputError unless `path` is a regular file: a pipe or a device would block or never end."""
    kind = _kind(path)
    require(kind == "a file", str(path), "be a file", kind)


def require_folder(path: Path) -> None:
    """Raise an InputError unless `path` is a folder."""
    kind = _kind(path)
    require(kind == "a folder", str(path), "be a folder", kind)


def require_inside(path: Path, root: Path) -> None:
    """Raise an InputError if `path` leaves the folder `root`, by `..` or by a symbolic link."""
    resolved = Path(os.path.realpath(path))  # pathlib's own raises on a loop of links
    require(resolved.is_relative_to(os.path.realpath(root)), str(path), f"stay inside {root}", resolved)


def read_bytes(path: Path, limit: int = MAX_FILE_BYTES) -> bytes:
    """Read a whole regular file of at most `limit` bytes.

    Raises
    ------
    InputError
        If it is missing, no regular file, larger than `limit` or unreadable.
    """
    require_file(path)
    try:
        size = path.stat().st_size
        require(size <= limit, str(path), f"have at most {limit} bytes", size)
        return read_head(path, size)  # no more: some of the kernel's files say 0 bytes and never end
    except OSError as error:
        raise InputError(f"`{path}` must be readable, got {error.strerror or error}.") from error


def read_head(path: Path, n_bytes: int) -> bytes:
    """Read the first `n_bytes` of a regular file, or all of a shorter one."""
    require_file(path)
    try:
        with path.open("rb") as stream:
            return stream.read(n_bytes)
    except OSError as error:
        raise InputError(f"`{path}` must be readable, got {error.strerror or error}.") from error


def _parse(path: Path, kind: str, parser: Callable[[str], Any]) -> dict[str, Any]:
    text = read_bytes(path, MAX_TEXT_BYTES)
    require(not text.startswith(codecs.BOM_UTF8), str(path), f"be {kind} without a byte order mark", "one")
    try:
        values = parser(text.decode("utf-8"))
    except (ValueError, RecursionError) as error:  # ValueError covers both parsers, bad UTF-8 and endless digits
        reason = "nesting too deep" if isinstance(error, RecursionError) else str(error)
        reason = "a number of thousands of digits" if "int_max_str_digits" in reason else reason
        raise InputError(f"`{path}` must be valid {kind}, got {shown(reason)}.") from error
    require(isinstance(values, dict), str(path), f"hold a {kind} object", shown(values))
    return dict(values)


def read_toml(path: Path) -> dict[str, Any]:
    """Parse a TOML file; whatever is wrong with it is an InputError."""
    return _parse(path, "TOML", tomllib.loads)


def read_json(path: Path) -> dict[str, Any]:
    """Parse a JSON object; NaN, infinity and repeated keys are refused, since no reader agrees on them."""

    def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        values = dict(pairs)
        if len(values) < len(pairs):
            raise ValueError("a repeated key")
        return values

    def refuse(constant: str) -> Any:
        raise ValueError(constant)

    return _parse(path, "JSON", lambda text: json.loads(text, object_pairs_hook=unique, parse_constant=refuse))


def require_writable(path: Path, suffixes: tuple[str, ...]) -> None:
    """Raise an InputError unless a file could be written at `path`: to be asked before long work, not after it."""
    allowed = " or ".join(suffixes)
    require(path.suffix.lower() in suffixes, str(path), f"end in {allowed}", path.suffix or "no suffix")
    require(_kind(path) != "a folder", str(path), "be a file name", "a folder")
    _require_parent(path)


def _require_parent(path: Path) -> None:
    require("\0" not in str(path), shown(str(path)), "be a file name", "a null byte in it")
    n_bytes = len(os.fsencode(path.name))
    require(n_bytes <= MAX_NAME_BYTES, shown(str(path)), f"be a name of at most {MAX_NAME_BYTES} bytes", n_bytes)
    require(_kind(path.parent) == "a folder", str(path), "lie in an existing folder", f"no folder {path.parent}")


@contextmanager
def _as_step(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        reason = error.strerror or error
        raise StepError(f"Writing `{path}` failed: {reason}; choose a writable folder with room.") from error


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a temporary name beside `path` to write to; it takes the name `path` only if the block succeeds.

    Raises
    ------
    InputError
        If the folder does not exist or `path` is a folder.
    StepError
        If the file system refuses.
    """
    require_writable(path, (path.suffix.lower(),))
    with _as_step(path):
        # Opened through tempfile, so that two writers never share a name; a plain name beside it obeys the umask.
        scratch = Path(tempfile.mkdtemp(prefix=f".{path.name[:40]}.", dir=path.parent))
        try:
            yield scratch / path.name
            (scratch / path.name).replace(path)
        finally:
            shutil.rmtree(scratch, ignore_errors=True)


@contextmanager
def replacing_folder(folder: Path) -> Iterator[Path]:
    """Give a temporary folder beside `folder` to fill; it takes that name only if the block succeeds.

    Raises
    ------
    InputError
        If `folder` exists and is not an empty folder, or its parent does not exist.
    StepError
        If the file system refuses.
    """
    kind = _kind(folder)
    _require_parent(folder)
    with _as_step(folder):
        new = kind == "nothing there" or (kind == "a folder" and not any(folder.iterdir()))
        require(new, str(folder), "be new or an empty folder", kind)
        scratch = Path(tempfile.mkdtemp(prefix=f".{folder.name[:40]}.", dir=folder.parent))
        try:
            # A folder inside the private scratch folder obeys the umask, where mkdtemp's own would be 0700 for ever.
            (scratch / "whole").mkdir()
            yield scratch / "whole"
            (scratch / "whole").replace(folder)
        except StepError as error:  # of a file within: the scratch folder is nothing to the user
            raise StepError(str(error).replace(str(scratch / "whole"), str(folder))) from error
        finally:
            shutil.rmtree(scratch, ignore_errors=True)


def write_bytes(data: bytes, path: Path) -> None:
    """Write a whole file, or nothing."""
    with replacing(path) as temporary:
        temporary.write_bytes(data)

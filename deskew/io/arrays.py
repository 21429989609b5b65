"""NPZ files: named arrays, never a pickle, and their declared sizes checked before anything is allocated."""

from __future__ import annotations

import io
import math
import tokenize
import warnings
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np

from deskew.errors import InputError, require
from deskew.io.files import require_file, shown, write_bytes
from deskew.types import Array

MAX_ARRAY_BYTES = 3 << 28
"""Largest file, and largest sum of arrays that it may unpack to: what is wrong is said within 1 GB of memory."""

# numpy parses a header as a literal of Python's, and on failure once more as one of Python 2's.
_NO_HEADER = (ValueError, SyntaxError, tokenize.TokenError, TypeError, KeyError, MemoryError, RecursionError)
_DAMAGE = (ValueError, OSError, EOFError, NotImplementedError, RuntimeError, zipfile.BadZipFile, zlib.error)


def write_arrays(arrays: Mapping[str, Array], path: Path) -> None:
    """Write named arrays as a compressed NPZ, whole or not at all; the same arrays give the same bytes.

    Raises
    ------
    InputError
        If `path` does not end in ``.npz`` or an array is no plain number or boolean.
    StepError
        If the file system refuses.
    """
    path = Path(path)
    require(path.suffix.lower() == ".npz", str(path), "end in .npz", path.suffix or "no suffix")
    for name, values in arrays.items():
        require(values.dtype.kind in "fiub", name, "hold numbers", values.dtype)
    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays)  # type: ignore[arg-type]  # its own flag `allow_pickle` is no array
    write_bytes(stream.getvalue(), path)


def _header(stream: IO[bytes], name: str) -> tuple[tuple[int, ...], np.dtype[Any]]:
    try:
        version = np.lib.format.read_magic(stream)
        reader = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, _, dtype = reader(stream)
    except _NO_HEADER as error:
        raise InputError(f"`{name}` must begin with the header of an array, got damage.") from error
    return shape, dtype


def _array(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, name: str) -> Array:
    with archive.open(entry) as stream:
        shape, dtype = _header(stream, name)
        n_bytes = math.prod(shape) * dtype.itemsize
        require(dtype.kind in "fiub", name, "hold numbers", shown(dtype.str))
        # The header alone decides how much memory numpy asks for: it has to agree with what is really there.
        told = stream.tell() + n_bytes
        require(told == entry.file_size, name, f"hold {n_bytes} bytes as its header says", f"{entry.file_size}")
    with archive.open(entry) as stream:
        return np.asarray(np.lib.format.read_array(stream, allow_pickle=False))


def read_arrays(path: Path) -> dict[str, Array]:
    """Read every array of an NPZ file.

    Raises
    ------
    InputError
        If it is missing, damaged, holds anything but plain numbers, or unpacks to more than `MAX_ARRAY_BYTES`.
    """
    path = Path(path)
    require_file(path)
    try:
        size = path.stat().st_size
        require(size <= MAX_ARRAY_BYTES, str(path), f"have at most {MAX_ARRAY_BYTES} bytes", size)
        # What numpy has to say of a header is nothing to the user: the file is read, or refused in one line.
        with warnings.catch_warnings(), zipfile.ZipFile(path) as archive:
            warnings.simplefilter("ignore")
            entries = archive.infolist()
            total = sum(entry.file_size for entry in entries)
            allowed = f"unpack to at most {MAX_ARRAY_BYTES} bytes"
            require(total <= MAX_ARRAY_BYTES, str(path), allowed, total)
            names = [entry.filename.removesuffix(".npy") for entry in entries]
            require(len(set(names)) == len(names), str(path), "name each array once", shown(names))
            return {n: _array(archive, e, f"{path}: {shown(n)}") for n, e in zip(names, entries, strict=True)}
    except InputError:
        raise
    except _DAMAGE as error:
        raise InputError(f"`{path}` must be a whole NPZ file of plain numbers, got {shown(str(error))}.") from error


def require_arrays(arrays: Mapping[str, Array], shapes: Mapping[str, tuple[int | None, ...]], path: Path) -> None:
    """Require each named array to be there with its shape, None standing for any extent, and its numbers real."""
    for name, shape in shapes.items():
        require(name in arrays, str(path), f"hold the arrays {', '.join(shapes)}", shown(sorted(arrays)))
        found = arrays[name].shape
        same = len(found) == len(shape) and all(w is None or w == f for w, f in zip(shape, found, strict=True))
        wanted = tuple("any" if extent is None else extent for extent in shape)
        require(same, f"{path}: {name}", f"have shape {wanted}", found)

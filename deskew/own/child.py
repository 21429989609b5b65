"""``python -m deskew.own.child FOLDER TASK METHOD MEMORY_MB FILE_MB``: one call of a method, in a process of its own.

It reads FOLDER/given.npz and leaves FOLDER/returned.npz, or in FOLDER/failure.txt one line that says why not.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from deskew.errors import DeskewError, StepError, in_one_line
from deskew.own.confinement import confine
from deskew.plugins import OUTSIDE, Kind, kind_of, load

GIVEN, RETURNED, FAILURE = "given.npz", "returned.npz", "failure.txt"
INSPECT = "inspect"
"""The task of saying which kind a method is; the others are the kinds themselves, and call it."""


def main(arguments: list[str]) -> int:
    """Carry the task out; return 0, or 1 if it failed."""
    folder, task, name, memory_mb, file_mb = arguments
    confine(int(memory_mb), int(file_mb))
    try:
        function = load(name, "method", OUTSIDE)
        found = {"kind": _index(kind_of(function))} if task == INSPECT else _call(function, Kind(task), Path(folder))
        _leave(found, Path(folder))
    except MemoryError:
        return _fail(folder, f"ran out of the {memory_mb} MB that it may take")
    except DeskewError as error:
        return _fail(folder, str(error))
    except (Exception, SystemExit) as error:
        return _fail(folder, f"raised {in_one_line(error)}")
    return 0


def _fail(folder: str, reason: str) -> int:
    (Path(folder) / FAILURE).write_text(reason)
    return 1


def _call(function: Callable[..., Any], kind: Kind, folder: Path) -> dict[str, Any]:
    """Call the method with what it was given; return what it returned, as arrays."""
    import numpy as np

    from deskew.own import exchange
    from deskew.types import Flattened, Restoration

    if kind_of(function) is not kind:
        raise StepError(f"is a {kind_of(function)} and was called as a {kind}")
    if kind is Kind.RESTORER:
        from deskew.io import read_scan

        restored = function(read_scan(folder / GIVEN))
        _require(restored, Restoration)
        return exchange.restoration_arrays(restored)
    with np.load(folder / GIVEN, allow_pickle=False) as archive:
        given = dict(archive)
    if kind is Kind.DEWARPER:
        return exchange.dewarped_arrays(function(given["image"]))
    flattened = function(exchange.sheet_of(given))
    _require(flattened, Flattened)
    return exchange.flattened_arrays(flattened)


def _require(found: object, wanted: type) -> None:
    if not isinstance(found, wanted):
        raise StepError(f"must return a {wanted.__name__}, got {type(found).__name__}")


def _leave(found: dict[str, Any], folder: Path) -> None:
    import numpy as np

    for name, values in found.items():
        if not (isinstance(values, np.ndarray) and values.dtype.kind in "fiub"):
            kind = getattr(values, "dtype", type(values).__name__)
            raise StepError(f"must return {name} as an array of real numbers, got {kind}")
    np.savez(folder / RETURNED, **found)


def _index(kind: Kind) -> Any:
    import numpy as np

    return np.array(list(Kind).index(kind))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

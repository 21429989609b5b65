"""Whether two runs of one commit say the same: on another Python, another machine, another number of threads.

    python -m experiments.reporting.agreement out/smoke/NAME/results.csv ELSEWHERE/NAME/results.csv
    python -m experiments.reporting.agreement out/smoke ELSEWHERE

compares two tables, or those of all experiments under two folders. On one machine with one lock the bytes are the same;
elsewhere compilers and linear algebra round differently, so lengths may differ by a thousandth of a pixel or of a
millimetre and a page by one letter missed. Exit code 0 if they agree, 1 if not, 2 if they cannot be read.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from io import BytesIO
from pathlib import Path

import pandas as pd

from deskew.errors import InputError
from deskew.io.files import read_bytes

TOLERANCES: Mapping[str, float] = {"px": 1e-3, "mm": 1e-3, "misses": 1.0}
"""By unit; of counts only letters missed are judged, and steps or contacts, which may chatter, are not."""

_KEY = ["experiment", "condition", "method", "trial", "seed", "metric", "unit"]


def tolerance_of(metric: str, unit: str) -> float | None:
    """Return by how much a metric may differ, None where nobody promised anything."""
    return TOLERANCES.get("misses" if metric.split("_")[0] == "misses" else unit)


def disagreements(first: Path, second: Path) -> Iterator[str]:
    """Yield a line for each row that one table lacks, or whose values differ by more than they may.

    Parameters
    ----------
    first, second : Path
        `results.csv` of two runs.

    Raises
    ------
    InputError
        If one is no such table.
    """
    left, right = _table(first), _table(second)
    for name, only in ((first, left.index.difference(right.index)), (second, right.index.difference(left.index))):
        for key in only:
            yield f"{_named(key)}: only in {name}"
    both = left.index.intersection(right.index)
    for key, one, other in zip(both, left[both], right[both], strict=True):
        allowed = tolerance_of(*key[-2:])
        if allowed is not None and not abs(one - other) <= allowed:
            yield f"{_named(key)}: {one:g} and {other:g} differ by more than {allowed:g}"


def _named(key: Sequence[object]) -> str:
    return " ".join(str(part) for part in key[:-1])


def _table(path: Path) -> pd.Series[float]:
    try:
        # Not by its path: pandas would wait for a pipe, and fetch what looks like an address.
        texts = dict.fromkeys(("experiment", "condition", "method", "metric", "unit"), str)
        values = (
            pd.read_csv(BytesIO(read_bytes(path)), keep_default_na=False, dtype=texts)
            .set_index(_KEY)["value"]
            .astype(float)
        )
        if not values.index.is_unique:
            raise ValueError("a row twice")
        return values
    except InputError:
        raise
    except (ValueError, KeyError, OverflowError) as error:
        reason = " ".join(str(error).split())
        raise InputError(f"`{path}` must be a results.csv with each row once, got: {reason}.") from error


def _pairs(first: Path, second: Path) -> list[tuple[Path, Path]]:
    if os.path.isfile(first):  # noqa: PTH113  # answers for names that pathlib raises on
        return [(first, second)]
    names = sorted({path.relative_to(root) for root in (first, second) for path in root.glob("*/results.csv")})
    if not names:
        raise InputError(f"`{first}` must be a results.csv or a folder of reports, got neither.")
    return [(first / name, second / name) for name in names]


def main(arguments: Sequence[str]) -> int:
    """Compare what the arguments name and print every disagreement."""
    try:
        if len(arguments) != 2:
            raise InputError(f"The arguments must be two files or two folders, got {len(arguments)}.")
        found = 0
        for first, second in _pairs(*(Path(argument) for argument in arguments)):
            for line in disagreements(first, second):
                print(line)
                found += 1
    except InputError as error:
        print(error, file=sys.stderr)
        return InputError.exit_code
    print("They agree." if not found else f"{found} rows disagree.")
    return int(found > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

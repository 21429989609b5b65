"""Where a piece of work spends its time."""

from __future__ import annotations

import cProfile
import pstats
import re
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

Result = TypeVar("Result")

_ROOT = Path(__file__).resolve().parents[2]
_N_SHOWN = 8
_LEAST_SHARE = 0.01


def profiled(work: Callable[[], Result]) -> tuple[Result, dict[str, float]]:
    """Run `work` under Python's profiler, to which numba shows its kernels as if they were Python's own.

    Returns
    -------
    Result
        What `work` gave.
    dict of name to share
        The functions that most of the time was spent in, without what they called, as shares of the whole: falling,
        and `others` for the rest. A compiled kernel holds the kernels that it calls.
    """
    profiler = cProfile.Profile()
    result = profiler.runcall(work)
    stats: Mapping[tuple[str, int, str], tuple[int, int, float, float, Any]] = vars(pstats.Stats(profiler))["stats"]
    times = Counter[str]()
    for place, (_, _, own, _, _) in stats.items():
        times[_name(*place)] += own  # type: ignore[assignment]  # a Counter of seconds
    total = sum(times.values()) or 1.0
    shares = {name: own / total for name, own in times.most_common(_N_SHOWN) if own / total >= _LEAST_SHARE}
    return result, shares | {"others": max(1.0 - sum(shares.values()), 0.0)}


def _name(file: str, _line: int, function: str) -> str:
    """Name a function by its module, whatever folder that lies in on this machine."""
    # A method of a type: `<method 'sort' of 'numpy.ndarray' objects>`; others: `<built-in method numpy.array>`.
    method = re.fullmatch(r"<method '(.+)' of '(.+)' objects>", function)
    if method:
        return f"{method[2]}.{method[1]}"
    if file == "~":
        return re.sub(r"<built-in method (.+)>", r"\1", re.sub(r" at 0x[0-9a-f]+", "", function))
    path = Path(file)
    if path.is_relative_to(_ROOT) and "site-packages" not in path.parts:
        return f"{path.relative_to(_ROOT)}:{function}"
    return f"{Path(*path.parts[-2:])}:{function}"

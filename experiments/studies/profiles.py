"""Where a piece of work spends its time."""

from __future__ import annotations

import cProfile
import pstats
import re
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

from numba.core.dispatcher import Dispatcher

Result = TypeVar("Result")

_ROOT = Path(__file__).resolve().parents[2]
_PACKAGES = ("deskew", "data_synth")
_N_SHOWN = 8
_LEAST_SHARE = 0.01


def profiled(work: Callable[[], Result]) -> tuple[Result, dict[str, float]]:
    """Run `work` under Python's profiler; the kernels that it calls must be compiled already.

    Returns
    -------
    Result
        What `work` gave.
    dict of name to share
        The functions that most of the time was spent in, without what they called, as shares of the whole: falling,
        and `others` for the rest. A compiled kernel holds the kernels that it calls.
    """
    profiler = cProfile.Profile()
    with _kernels_shown():
        result = profiler.runcall(work)
    stats: Mapping[tuple[str, int, str], tuple[int, int, float, float, Any]] = vars(pstats.Stats(profiler))["stats"]
    times = Counter[str]()
    for place, (_, _, own, _, _) in stats.items():
        times[_name(*place)] += own  # type: ignore[assignment]  # a Counter of seconds
    total = sum(times.values()) or 1.0
    shares = {name: own / total for name, own in times.most_common(_N_SHOWN) if own / total >= _LEAST_SHARE}
    return result, shares | {"others": max(1.0 - sum(shares.values()), 0.0)}


@contextmanager
def _kernels_shown() -> Iterator[None]:
    """Put a Python function in the place of each kernel in our modules: numba shows them to a profiler up to 3.11 only.

    Kernels that call each other were bound when they were compiled, so they notice nothing.
    """
    modules = [module for name, module in sys.modules.items() if name.split(".")[0] in _PACKAGES]
    replaced = [
        (module, name, value)
        for module in modules
        for name, value in vars(module).items()
        if isinstance(value, Dispatcher)
    ]
    for module, name, kernel in replaced:
        setattr(module, name, _shown(kernel))
    try:
        yield
    finally:
        for module, name, kernel in replaced:
            setattr(module, name, kernel)


def _shown(kernel: Any) -> Callable[..., Any]:
    def call(*arguments: Any, **named: Any) -> Any:
        return kernel(*arguments, **named)

    source = kernel.py_func.__code__
    # On a line of its own: the profiler would keep only one of two functions that share name and line.
    call.__code__ = call.__code__.replace(co_name=source.co_name, co_filename=source.co_filename, co_firstlineno=1)
    return call


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

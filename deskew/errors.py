"""The errors that a user can meet, and the exit code that each one ends a command with."""

from __future__ import annotations

from numbers import Integral, Real
from typing import cast


class DeskewError(Exception):
    """Base of all errors that end in one clear line instead of a traceback."""

    exit_code = 1


class InputError(DeskewError, ValueError):
    """An input is wrong: the message names it, the allowed range and what came."""

    exit_code = 2


class StepError(DeskewError, RuntimeError):
    """A step failed on valid input: the message names the step, the finding and a remedy."""

    exit_code = 3


def require(condition: bool, name: str, allowed: str, got: object) -> None:
    """Raise an :class:`InputError` in the project's wording unless `condition` holds.

    Parameters
    ----------
    condition : bool
        What must hold.
    name : str
        The argument, key or file at fault.
    allowed : str
        What is allowed, continuing "`name` must ...".
    got : object
        What came instead.

    Raises
    ------
    InputError
        "`name` must ALLOWED, got GOT."
    """
    if not condition:
        raise InputError(f"`{name}` must {allowed}, got {got}.")


def is_whole(value: object, low: int, high: int) -> bool:
    """Whether `value` is a whole number, of Python's or numpy's, in [low, high]; a bool is none."""
    return isinstance(value, Integral) and not isinstance(value, bool) and low <= int(value) <= high


def require_whole(name: str, value: object, low: int, high: int) -> None:
    """Raise an :class:`InputError` unless `value` is a whole number in [low, high]."""
    require(is_whole(value, low, high), name, f"be a whole number in [{low}, {high}]", repr(value))


def require_positive(name: str, value: object, high: float, unit: str = "") -> None:
    """Raise an :class:`InputError` unless `value` is a finite number in (0, high], in `unit`."""
    number = isinstance(value, Real) and not isinstance(value, bool)
    allowed = f"be in (0, {high:g}] [{unit}]" if unit else f"be in (0, {high:g}]"
    require(number and 0 < cast(float, value) <= high, name, allowed, repr(value))


def in_one_line(error: BaseException) -> str:
    """Kind and message of an error from outside the project, in one line of at most some 300 characters."""
    try:
        message = " ".join(str(error).split())
    except Exception:  # what is foreign may fail even at saying so
        message = ""
    message = message if len(message) <= 300 else f"{message[:300]}..."
    return f"{type(error).__name__}: {message}" if message else type(error).__name__

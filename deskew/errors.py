"""The errors that a user can meet, and the exit code that each one ends a command with."""

from __future__ import annotations


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

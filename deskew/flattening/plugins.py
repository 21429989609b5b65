"""Functions from outside, named `package.module:function`."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

from deskew.errors import InputError, in_one_line, require


def load_function(name: str, argument: str, known: str) -> Callable[..., Any]:
    """Import a function.

    Parameters
    ----------
    name : str
        `package.module:function`.
    argument, known : str
        What the name was given as, and what that may be, for the error.

    Raises
    ------
    InputError
        If there is no such function, or its module cannot be imported.
    """
    module_name, colon, attribute = name.partition(":")
    absolute = bool(colon and attribute) and all(module_name.split("."))
    require(absolute, argument, f"be {known}", repr(name))
    try:
        found: Any = getattr(import_module(module_name), attribute, None)
    except (Exception, SystemExit) as error:  # whatever a module does when it is imported, exiting included
        raise InputError(f"`{argument}` must be {known}, got {name!r}: {in_one_line(error)}.") from error
    require(callable(found), argument, f"name a function in {module_name}", repr(name))
    function: Callable[..., Any] = found
    return function

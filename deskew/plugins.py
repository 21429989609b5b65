"""Methods from outside: what each kind is given, and how one is found by its name.

A method is a function. Without a mark it flattens a `Sheet`, as `deskew.flatten` has always taken it; a decorator marks
one that restores a page as a whole. The mark is an attribute and nothing more, so that it may also be set by hand:
``dewarp.deskew_kind = "dewarper"``.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from importlib import import_module
from typing import Any, TypeVar

from deskew.errors import InputError, in_one_line, require

ENTRY_POINTS = "deskew.methods"
"""Group of entry points in which a distribution names its methods."""

OUTSIDE = f"package.module:function, or a method installed as an entry point in {ENTRY_POINTS}"
"""What a method's name may be besides a built-in's, for errors."""

_MARK = "deskew_kind"
Function = TypeVar("Function", bound=Callable[..., Any])


class Kind(StrEnum):
    """What a method is given, and what it returns.

    `FLATTENER`: a `Sheet`, for a `Flattened`. `RESTORER`: a `Scan`, for a `Restoration`. `DEWARPER`: the white image
    alone, for an image, or an image and its backward map.
    """

    FLATTENER = "flattener"
    RESTORER = "restorer"
    DEWARPER = "dewarper"


def flattener(function: Function) -> Function:
    """Mark a function that flattens a `Sheet`; one without a mark does."""
    return _marked(function, Kind.FLATTENER)


def restorer(function: Function) -> Function:
    """Mark a function that makes a `Restoration` of a `Scan`."""
    return _marked(function, Kind.RESTORER)


def dewarper(function: Function) -> Function:
    """Mark a function that makes a flat page's image of a bent one's, and knows of no shape."""
    return _marked(function, Kind.DEWARPER)


def _marked(function: Function, kind: Kind) -> Function:
    setattr(function, _MARK, kind)
    return function


def kind_of(method: Callable[..., Any]) -> Kind:
    """Return a method's kind by its mark.

    Raises
    ------
    InputError
        If the mark is none of `Kind`.
    """
    mark = getattr(method, _MARK, Kind.FLATTENER)
    kinds = [str(kind) for kind in Kind]
    require(mark in kinds, _MARK, f"be one of {', '.join(kinds)}", repr(mark))
    return Kind(mark)


def name_of(method: str | Callable[..., Any]) -> str:
    """Return what a method is called in messages."""
    return method if isinstance(method, str) else str(getattr(method, "name", getattr(method, "__name__", method)))


def locate(name: str) -> tuple[str, str] | None:
    """Say which module and function a name stands for, without importing anything.

    Parameters
    ----------
    name : str
        `package.module:function`, or the name of an entry point in `ENTRY_POINTS`.

    Returns
    -------
    (module, function) or None
        None if it is neither.

    Raises
    ------
    InputError
        If two distributions have installed different methods of that name.
    """
    module, colon, function = name.partition(":")
    if colon:
        return (module, function) if function and all(module.split(".")) else None
    from importlib.metadata import entry_points  # here, not above: it takes longer than all else of `import deskew`

    places = sorted({(found.module, found.attr) for found in entry_points(group=ENTRY_POINTS, name=name)})
    require(len(places) < 2, name, "be installed once", ", ".join(":".join(place) for place in places))
    return places[0] if places else None


def load(name: str, argument: str, known: str) -> Callable[..., Any]:
    """Import a method from outside, in this very process.

    Parameters
    ----------
    name : str
        As for :func:`locate`.
    argument, known : str
        What the name was given as, and what that may be, for the error.

    Raises
    ------
    InputError
        If there is no such function, or its module cannot be imported.
    """
    place = locate(name)
    if place is None:
        raise InputError(f"`{argument}` must be {known}, got {name!r}.")
    module, attribute = place
    try:
        found: Any = getattr(import_module(module), attribute, None)
    except (Exception, SystemExit) as error:  # whatever a module does when it is imported, exiting included
        raise InputError(f"`{argument}` must be {known}, got {name!r}: {in_one_line(error)}.") from error
    require(callable(found), argument, f"name a function in {module}", repr(name))
    function: Callable[..., Any] = found
    return function

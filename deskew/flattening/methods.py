"""Flattening methods by name; a method from outside is named `package.module:function`."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np

from deskew.errors import DeskewError, InputError, StepError, require
from deskew.flattening.dynamics import settle
from deskew.flattening.integrators import INTEGRATORS
from deskew.flattening.settings import particle_settings
from deskew.types import Flattened, Sheet

Flattener = Callable[..., Flattened]


def _particles(integrator: str) -> Flattener:
    """Make the paper's method out of an integrator's name."""

    def flatten_with(sheet: Sheet, **settings: object) -> Flattened:
        return settle(sheet, INTEGRATORS[integrator], particle_settings(**settings))

    return flatten_with


METHODS: dict[str, Flattener] = {
    "paper_euler": _particles("euler"),
    "paper_rk4": _particles("rk4"),
}


def find_method(name: str) -> Flattener:
    """Look a method up.

    Parameters
    ----------
    name : str
        A key of `METHODS`, or `package.module:function` for a function that takes a `Sheet` and keyword settings and
        returns a `Flattened`.

    Raises
    ------
    InputError
        If there is no such method.
    """
    if name in METHODS:
        return METHODS[name]
    module_name, colon, attribute = name.partition(":")
    known = f"one of {', '.join(METHODS)}, or package.module:function"
    require(bool(colon and module_name and attribute), "method", f"be {known}", repr(name))
    try:
        found: Any = getattr(import_module(module_name), attribute, None)
    except ImportError as error:
        raise InputError(f"`method` must be {known}, got {name!r}: {error}.") from error
    require(callable(found), "method", f"name a function in {module_name}", repr(name))
    function: Flattener = found
    return function


def flatten(sheet: Sheet, *, method: str = "paper_euler", **settings: object) -> Flattened:
    """Flatten a sheet onto Z = 0.

    Parameters
    ----------
    sheet : Sheet
        The surface in the world [mm].
    method : str
        `paper_euler` or `paper_rk4` (the paper's particle system, section 3), or `package.module:function`.
    **settings
        Of the method; for the particle system, the fields of `ParticleSettings`.

    Returns
    -------
    Flattened
        Vertices of the sheet's shape and a status: a sheet that locks, folds or diverges is a result, not an error.

    Raises
    ------
    InputError
        If the method or a setting is unknown or out of range, or the sheet does not suit the method.
    StepError
        If a method from outside raises, or returns something else than a `Flattened` of the sheet's shape.
    """
    function = find_method(method)
    try:
        result = function(sheet, **settings)
    except DeskewError:
        raise
    except Exception as error:
        if method in METHODS:
            raise
        raise StepError(f"Flattening by `{method}` failed: {type(error).__name__}: {error}.") from error
    if not isinstance(result, Flattened):
        raise StepError(f"Flattening by `{method}` must return a Flattened, got {type(result).__name__}.")
    shape = np.shape(result.vertices)
    if shape != sheet.vertices.shape:
        raise StepError(f"Flattening by `{method}` must keep the shape {sheet.vertices.shape}, got {shape}.")
    return result

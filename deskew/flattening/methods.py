"""Flattening methods by name, and anybody's own."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from deskew.errors import DeskewError, StepError, in_one_line, require
from deskew.flattening.dynamics import settle
from deskew.flattening.outside import Outside
from deskew.flattening.peers import PEERS
from deskew.flattening.schemes import INTEGRATORS, Scheme
from deskew.flattening.settings import ParticleSettings, settings_of
from deskew.flattening.spring import flatten_spring
from deskew.plugins import OUTSIDE, Kind, kind_of, load, name_of
from deskew.types import Flattened, Sheet, Status

Flattener = Callable[..., Flattened]


def find_integrator(name: str) -> Scheme | Outside:
    """Look an integrator up: a key of `INTEGRATORS`, or `package.module:function` for a `Step` of :mod:`.outside`.

    Raises
    ------
    InputError
        If there is no such integrator.
    """
    known = f"one of {', '.join(INTEGRATORS)}, or package.module:function"
    named = isinstance(name, str) and (name in INTEGRATORS or ":" in name)
    require(named, "integrator", f"be {known}", repr(name))
    return INTEGRATORS[name] if name in INTEGRATORS else Outside(name, load(name, "integrator", known))


def flatten_particles(sheet: Sheet, *, integrator: str = "euler", **settings: object) -> Flattened:
    """Flatten a grid by the particle system of section 3 with any integrator.

    Parameters
    ----------
    sheet : Sheet
        Grid [mm].
    integrator : str
        As of `find_integrator`.
    **settings
        Fields of `ParticleSettings`.
    """
    return settle(sheet, find_integrator(integrator), settings_of(ParticleSettings, "the particle system", settings))


def _paper(integrator: str) -> Flattener:
    """Make the paper's method out of one of its integrators' names."""

    def flatten_with(sheet: Sheet, **settings: object) -> Flattened:
        return settle(sheet, INTEGRATORS[integrator], settings_of(ParticleSettings, "the particle system", settings))

    return flatten_with


def _peer(name: str) -> Flattener:
    """Take a method of libigl as it is: it has no settings, and knows no materials."""

    def flatten_with(sheet: Sheet, **settings: object) -> Flattened:
        for setting in settings:
            require(False, setting, f"be left out: {name} has no settings", "it")
        require(sheet.stiffness is None, "stiffness", f"be left out: {name} knows no materials", "one")
        return PEERS[name](sheet)

    return flatten_with


METHODS: dict[str, Flattener] = {
    "spring": flatten_spring,
    "paper_euler": _paper("euler"),
    "paper_rk4": _paper("rk4"),
    "particles": flatten_particles,
    **{name: _peer(name) for name in PEERS},
}

DEFAULT = "spring"


def find_method(name: str) -> Callable[..., Any]:
    """Look a method up.

    Parameters
    ----------
    name : str
        A key of `METHODS`, or as of :func:`deskew.plugins.locate` for a function from outside, of any kind: a flattener
        takes a `Sheet` and keyword settings and returns a `Flattened`.

    Raises
    ------
    InputError
        If there is no such method.
    """
    known = f"one of {', '.join(METHODS)}, or {OUTSIDE}"
    require(isinstance(name, str), "method", f"be {known}", repr(name))
    return METHODS[name] if name in METHODS else load(name, "method", known)


def flatten(sheet: Sheet, *, method: str | Flattener = DEFAULT, **settings: object) -> Flattened:
    """Flatten a sheet onto Z = 0.

    Parameters
    ----------
    sheet : Sheet
        The surface in the world [mm].
    method : str or callable
        `spring` (the same springs solved for rest at once), `paper_euler` or `paper_rk4` (the paper's particle system,
        section 3), `particles` (the same with any `integrator`), `lscm`, `arap` or `slim` of libigl, if it is
        installed, or one from outside by its name (see :func:`deskew.plugins.locate`) or itself.
    **settings
        Of the method: the fields of `StaticSettings` for `spring`, of `ParticleSettings` for the particle system.

    Returns
    -------
    Flattened
        Vertices of the sheet's shape and a status: a sheet that locks, folds or diverges is a result, not an error.

    Raises
    ------
    InputError
        If the method or a setting is unknown or out of range, or the sheet does not suit the method.
    StepError
        If a method from outside raises or exits, or returns something else than a `Flattened` of the sheet's shape,
        finite unless its status is `DIVERGED`.
    """
    function = method if callable(method) else find_method(method)
    kind, name = kind_of(function), name_of(method)
    require(kind is Kind.FLATTENER, "method", "be a flattener where a sheet is flattened", f"`{name}`, a {kind}")
    try:
        result = function(sheet, **settings)
    except DeskewError:
        raise
    except (Exception, SystemExit) as error:
        if name in METHODS:
            raise
        raise StepError(f"Flattening by `{name}` failed: {in_one_line(error)}.") from error
    _require_result(result, sheet, name)
    return result


def _require_result(result: Any, sheet: Sheet, method: str) -> None:
    """Raise a StepError unless a method returned what it must; nothing about it is taken for granted."""

    def must(holds: bool, what: str, got: object) -> None:
        if not holds:
            raise StepError(f"Flattening by `{method}` must {what}, got {got}.")

    must(isinstance(result, Flattened), "return a Flattened", type(result).__name__)
    vertices, status = result.vertices, result.status
    real = isinstance(vertices, np.ndarray) and vertices.dtype.kind in "fiu"
    must(real, "return vertices as an array of real numbers", getattr(vertices, "dtype", type(vertices).__name__))
    must(vertices.shape == sheet.vertices.shape, f"keep the shape {sheet.vertices.shape}", vertices.shape)
    must(isinstance(status, Status), "return a Status", repr(status))
    finite = status is Status.DIVERGED or bool(np.isfinite(vertices).all())
    must(finite, "return finite vertices unless it diverged", f"{status} with NaN or infinity")
    inside, wanted = result.surface, sheet.surface
    if inside is not None:
        fits = wanted is not None and isinstance(inside, np.ndarray) and inside.shape == wanted.shape
        must(
            fits,
            "return the surface in the sheet's own shape, or None",
            getattr(inside, "shape", type(inside).__name__),
        )

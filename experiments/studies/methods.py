"""The methods under test, by name: built-in ones, and anybody's own, each call of which is a process of its own.

This process holds the truth, so it never imports a method that is not built in: not even to see whether it is there.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache

from deskew import flattening, restoration
from deskew.errors import InputError, StepError, require
from deskew.own.confinement import Limits
from deskew.own.methods import OwnMethod, own_method
from deskew.plugins import OUTSIDE, Kind, locate
from deskew.types import Array, Dewarped
from experiments.settings import Config

EVERY_KIND = tuple(Kind)


# Its kind is asked for once a process: that takes an interpreter's start and all that the method imports.
_found = cache(own_method)


def method_of(config: Config, name: str) -> str | OwnMethod:
    """Return what the pipeline takes for a method: a built-in's name, or somebody's own in a process of its own."""
    if name in flattening.METHODS:
        return name
    try:
        return _found(name, _limits(config))
    except InputError:
        # It could be imported when the run was planned. Called, it will say again what is wrong, in its own rows.
        return OwnMethod(name, Kind.FLATTENER, _limits(config))


def kind_of(config: Config, name: str) -> Kind:
    """Return what a method is given; the built-in ones are flatteners."""
    method = method_of(config, name)
    return Kind.FLATTENER if isinstance(method, str) else method.deskew_kind


def dewarped_by(config: Config, name: str, image: Array) -> Dewarped:
    """Let a method that is a dewarper flatten a raw image."""
    method = method_of(config, name)
    if isinstance(method, str) or method.deskew_kind is not Kind.DEWARPER:
        raise StepError(f"`{name}` is no dewarper.")
    return restoration.dewarp_by(method, image)


def _limits(config: Config) -> Limits:
    return Limits(config.own.seconds, config.own.memory_mb)


def require_methods(config: Config, kinds: Iterable[Kind] = EVERY_KIND) -> None:
    """Raise an InputError unless every method under test is there and of a kind that the experiment can use."""
    allowed = tuple(kinds)
    for name in config.methods:
        known = name in flattening.METHODS or locate(name) is not None
        require(known, "method", f"be one of {', '.join(flattening.METHODS)}, or {OUTSIDE}", repr(name))
        kind = Kind.FLATTENER if name in flattening.METHODS else _found(name, _limits(config)).deskew_kind
        listed = " or ".join(allowed)
        require(kind in allowed, "method", f"be a {listed} in the experiment {config.experiment}", f"{name}, a {kind}")

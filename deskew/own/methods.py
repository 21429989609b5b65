"""Methods that are called like any other, and run in a process of their own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from deskew.errors import InputError, StepError
from deskew.io import write_arrays, write_scan
from deskew.own import exchange
from deskew.own.child import INSPECT
from deskew.own.confinement import Limits
from deskew.own.process import call
from deskew.plugins import OUTSIDE, Kind, locate
from deskew.types import Array


@dataclass(frozen=True, slots=True)
class OwnMethod:
    """Somebody's method, each call of which is a process.

    Attributes
    ----------
    name : str
        As of :func:`deskew.plugins.locate`.
    deskew_kind : Kind
        What it is given.
    limits : Limits
        What a call may take.
    """

    name: str
    deskew_kind: Kind
    limits: Limits

    def __call__(self, given: Any) -> Any:
        """Call it with what its kind is given; settings there are none.

        Returns
        -------
        Flattened, Restoration or Dewarped
            As it came back: who asked for it must still judge its shapes and values.

        Raises
        ------
        StepError
            If it did not return, or returned something else.
        """
        write, read = _EXCHANGED[self.deskew_kind]
        arrays = call(self.name, self.deskew_kind, self.limits, partial(write, given))
        try:
            return read(arrays)
        except InputError as error:
            raise StepError(f"`{self.name}` returned something else than a {self.deskew_kind} must: {error}") from error


def own_method(name: str, limits: Limits) -> OwnMethod:
    """Find a method, and its kind, without importing it here.

    Parameters
    ----------
    name : str
        As of :func:`deskew.plugins.locate`.
    limits : Limits
        What a call may take; finding out its kind is one.

    Raises
    ------
    InputError
        If there is no such method, or it cannot be imported within its limits.
    """
    if locate(name) is None:
        raise InputError(f"`method` must be {OUTSIDE}, got {name!r}.")
    try:
        index = int(call(name, INSPECT, limits)["kind"])
    except StepError as error:
        raise InputError(f"`method` must name a method that can be imported, got one that cannot: {error}") from error
    return OwnMethod(name, tuple(Kind)[index], limits)


def _write_sheet(sheet: Any, path: Path) -> None:
    write_arrays(exchange.sheet_arrays(sheet), path)


def _write_image(image: Array, path: Path) -> None:
    write_arrays({"image": np.asarray(image)}, path)


_EXCHANGED: dict[Kind, tuple[Callable[[Any, Path], None], Callable[[dict[str, Array]], Any]]] = {
    Kind.FLATTENER: (_write_sheet, exchange.flattened_of),
    Kind.RESTORER: (write_scan, exchange.restoration_of),
    Kind.DEWARPER: (_write_image, exchange.dewarped_of),
}

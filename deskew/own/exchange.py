"""What a method is given and returns, as named arrays of plain numbers: nothing else passes between processes."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from re import fullmatch

import numpy as np

from deskew.errors import InputError, require
from deskew.types import Array, Dewarped, Flattened, Pinhole, Restoration, Sheet, Status

_STATUSES = tuple(Status)
_COUNTER, _N_COUNTERS = "counter_", 64
_CAMERA = ("size", "K", "distortion", "R", "t")
_SHEET = ("vertices", "faces", "stiffness", "cut", "surface")
_REMEDY_BYTES = 300


def sheet_arrays(sheet: Sheet) -> dict[str, Array]:
    """Name the arrays of a sheet; those that it lacks are left out."""
    named = {name: getattr(sheet, name) for name in _SHEET}
    arrays = {name: values for name, values in named.items() if values is not None}
    return arrays | {"crease_width": np.array(float(sheet.crease_width))}


def sheet_of(arrays: Mapping[str, Array]) -> Sheet:
    """Return the sheet of :func:`sheet_arrays`."""
    named = {name: arrays[name] for name in _SHEET if name in arrays}
    return Sheet(**named, crease_width=float(arrays["crease_width"]))


def flattened_arrays(flattened: Flattened) -> dict[str, Array]:
    """Name the arrays of a flattened sheet; a course in time stays behind."""
    arrays = {
        "vertices": flattened.vertices,
        "status": np.array(_STATUSES.index(flattened.status)),
        "remedy": np.frombuffer(str(flattened.remedy).encode()[:_REMEDY_BYTES], np.uint8),
    }
    if flattened.surface is not None:
        arrays["surface"] = flattened.surface
    return arrays | {f"{_COUNTER}{name}": np.array(float(value)) for name, value in flattened.counters.items()}


def flattened_of(arrays: Mapping[str, Array]) -> Flattened:
    """Return the flattened sheet of :func:`flattened_arrays`, as far as names and kinds go; its arrays are not judged.

    Raises
    ------
    InputError
        If what a method sent is no flattened sheet's.
    """
    status = int(_scalar(arrays, "status"))
    require(0 <= status < len(_STATUSES), "status", f"be in [0, {len(_STATUSES) - 1}]", status)
    counters: dict[str, float] = {}
    for name in arrays:
        if name.startswith(_COUNTER):
            plain = fullmatch(r"[a-z][a-z0-9_]{0,59}", name.removeprefix(_COUNTER)) and len(counters) < _N_COUNTERS
            require(bool(plain), "counters", f"be at most {_N_COUNTERS} of short names in lower case", repr(name[:80]))
            counters[name.removeprefix(_COUNTER)] = _scalar(arrays, name)
    remedy = bytes(_named(arrays, "remedy").astype(np.uint8).ravel()[:_REMEDY_BYTES]).decode(errors="replace")
    printable = "".join(c if c.isprintable() else " " for c in remedy)
    return Flattened(_named(arrays, "vertices"), _STATUSES[status], printable, counters, arrays.get("surface"))


def restoration_arrays(restored: Restoration) -> dict[str, Array]:
    """Name the arrays of a restored page."""
    arrays = {"image": restored.image, "backward_map": restored.backward_map}
    arrays |= {f"camera_{name}": np.asarray(getattr(restored.camera, name)) for name in _CAMERA}
    if restored.flattened is not None:
        arrays |= {f"flat_{name}": values for name, values in flattened_arrays(restored.flattened).items()}
    return arrays


def restoration_of(arrays: Mapping[str, Array]) -> Restoration:
    """Return the restored page of :func:`restoration_arrays`; its arrays are not judged.

    Raises
    ------
    InputError
        If what a method sent is no restored page's.
    """
    width, height = (int(side) for side in np.resize(_named(arrays, "camera_size"), 2))
    camera = Pinhole((width, height), *(_named(arrays, f"camera_{name}") for name in _CAMERA[1:]))
    flat = {name.removeprefix("flat_"): values for name, values in arrays.items() if name.startswith("flat_")}
    flattened = flattened_of(flat) if flat else None
    return Restoration(_named(arrays, "image"), _named(arrays, "backward_map"), camera, flattened)


def dewarped_arrays(found: object) -> dict[str, Array]:
    """Name the arrays of a dewarper's image, or of the pair of that and its backward map."""
    if isinstance(found, Dewarped):
        found = found.image, found.backward_map
    image, places = found if isinstance(found, tuple) and len(found) == 2 else (found, None)
    return {"image": np.asarray(image)} | ({} if places is None else {"backward_map": np.asarray(places)})


def dewarped_of(arrays: Mapping[str, Array]) -> Dewarped:
    """Return the dewarped page of :func:`dewarped_arrays`; its arrays are not judged."""
    return Dewarped(_named(arrays, "image"), arrays.get("backward_map"))


def _named(arrays: Mapping[str, Array], name: str) -> Array:
    if name not in arrays:
        raise InputError(f"`{name}` must be among what a method returns, got {', '.join(sorted(arrays))[:80]}.")
    return arrays[name]


def _scalar(arrays: Mapping[str, Array], name: str) -> float:
    values = _named(arrays, name)
    require(values.size == 1 and isfinite(float(values.ravel()[0])), name, "be a finite number", values.shape)
    return float(values.ravel()[0])

"""The method `spring`: lengths measured on the surface, without its noise, and brought to rest on the plane.

Springs of a grid go to :mod:`.statics`, anything else to :mod:`.meshes`, which takes the lengths that a grid knows.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from deskew.errors import require
from deskew.flattening.edges import Indices, edges_of
from deskew.flattening.lengths import surface_lengths
from deskew.flattening.meshes import Measure, flatten_mesh
from deskew.flattening.noiselevel import noise_level
from deskew.flattening.peers import as_mesh
from deskew.flattening.settings import AUTO, StaticSettings, settings_of
from deskew.flattening.springs import grid_springs
from deskew.flattening.statics import flatten_grid
from deskew.types import Flattened, Floats, Sheet


def flatten_spring(sheet: Sheet, **settings: object) -> Flattened:
    """Flatten a grid or a triangle mesh by statics.

    Parameters
    ----------
    sheet : Sheet
        Grid or triangle mesh [mm].
    **settings
        Fields of `StaticSettings`.

    Returns
    -------
    Flattened
        As of `flatten_grid` or `flatten_mesh`. With `noise_mm`, its counters hold `noise_estimated_mm` too, the
        noise that was removed.

    Raises
    ------
    InputError
        If a setting is unknown or out of range, or the sheet cannot lie flat in one piece.
    """
    chosen = settings_of(StaticSettings, "the static solver", settings)
    if sheet.faces is None and chosen.noise_mm == 0.0 and chosen.energy in (None, "springs"):
        return flatten_grid(sheet, chosen)
    _require_plain(chosen)
    fits = chosen.noise_mm == 0.0 or sheet.surface is None
    require(fits, "noise_mm", "be 0 for a sheet with a surface, whose depth is filtered before", chosen.noise_mm)
    mesh = sheet if sheet.faces is not None else _triangles(sheet)
    found: dict[str, float] = {}
    flat = flatten_mesh(
        mesh,
        energy=chosen.energy or "arap",
        rest=_rest(sheet, mesh, chosen, found),
        tolerance=chosen.tolerance,
        max_iterations=chosen.max_iterations,
    )
    counters = {**flat.counters, **found}
    return replace(flat, vertices=flat.vertices.reshape(sheet.vertices.shape), counters=counters)


def _rest(sheet: Sheet, mesh: Sheet, settings: StaticSettings, found: dict[str, float]) -> Floats | Measure | None:
    """Rest lengths as `flatten_mesh` takes them; the noise goes to `found`."""
    if settings.noise_mm == 0.0:
        if settings.rest == "chord":
            return None
        if sheet.surface is not None:
            return _section_lengths(sheet, mesh, settings)

    def measure(vertices: Floats, faces: Indices) -> Floats:
        sigma = noise_level(vertices, faces) if settings.noise_mm == AUTO else float(settings.noise_mm)
        if settings.noise_mm != 0.0:
            found["noise_estimated_mm"] = sigma
        return surface_lengths(vertices, faces, sigma)[1]

    return measure


def _section_lengths(sheet: Sheet, mesh: Sheet, settings: StaticSettings) -> Floats:
    """Rest lengths (E,) of a grid's springs [mm] for the edges of its triangles."""
    assert mesh.faces is not None
    a, b, rest, _ = grid_springs(sheet, settings.springs).pairs()
    n = len(mesh.vertices)
    keys = np.minimum(a, b) * n + np.maximum(a, b)
    order = np.argsort(keys)
    wanted = edges_of(mesh.faces).ends @ np.array([n, 1])
    return np.asarray(rest[order[np.searchsorted(keys[order], wanted)]])


def _require_plain(settings: StaticSettings) -> None:
    """Refuse what only the springs of a grid have."""
    for name, plain in (("bending", 0), ("more", 0), ("through", 1), ("free_scale", False)):
        value = getattr(settings, name)
        require(value == plain, name, f"be {plain} for a triangle mesh, with noise or another energy", value)


def _triangles(sheet: Sheet) -> Sheet:
    """Two triangles a quad, each as stiff as its quad."""
    vertices, faces = as_mesh(sheet)
    stiffness = sheet.stiffness
    if stiffness is not None:
        whole = slice(None) if sheet.cut is None else ~sheet.cut.ravel()
        stiffness = np.repeat(stiffness.ravel()[whole], 2)
    return Sheet(vertices, faces, stiffness)

"""The method `spring`: lengths measured on the surface, without its noise, and brought to rest on the plane.

Grids go to :mod:`.statics`, anything else to :mod:`.meshes`. Both take the same lengths and the same two energies.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from deskew.errors import require
from deskew.flattening.edges import Indices
from deskew.flattening.lengths import surface_lengths
from deskew.flattening.meshes import flatten_mesh
from deskew.flattening.noiselevel import noise_level
from deskew.flattening.peers import as_mesh
from deskew.flattening.settings import AUTO, StaticSettings, settings_of
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
    mesh = sheet if sheet.faces is not None else _triangles(sheet)
    found: dict[str, float] = {}

    def measure(vertices: Floats, faces: Indices) -> Floats:
        if chosen.noise_mm == 0.0 and chosen.rest == "chord":
            edges = surface_lengths(vertices, faces)[0]
            return np.asarray(np.linalg.norm(vertices[edges[:, 1]] - vertices[edges[:, 0]], axis=1))
        sigma = noise_level(vertices, faces) if chosen.noise_mm == AUTO else float(chosen.noise_mm)
        if chosen.noise_mm != 0.0:
            found["noise_estimated_mm"] = sigma
        return surface_lengths(vertices, faces, sigma)[1]

    flat = flatten_mesh(
        mesh,
        energy=chosen.energy or "arap",
        rest=measure,
        tolerance=chosen.tolerance,
        max_iterations=chosen.max_iterations,
    )
    counters = {**flat.counters, **found}
    return replace(flat, vertices=flat.vertices.reshape(sheet.vertices.shape), counters=counters)


def _require_plain(settings: StaticSettings) -> None:
    """Refuse what only the springs of a grid have."""
    for name, plain in (("bending", 0.0), ("more", 0.0), ("through", 1)):
        value = getattr(settings, name)
        require(value == plain, name, f"be {plain:g} for a triangle mesh, with noise or another energy", value)


def _triangles(sheet: Sheet) -> Sheet:
    """Two triangles a quad, each as stiff as its quad."""
    vertices, faces = as_mesh(sheet)
    stiffness = sheet.stiffness
    if stiffness is not None:
        whole = slice(None) if sheet.cut is None else ~sheet.cut.ravel()
        stiffness = np.repeat(stiffness.ravel()[whole], 2)
    return Sheet(vertices, faces, stiffness)

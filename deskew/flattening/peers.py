"""Flattenings by libigl, as peers to compare with: LSCM, as rigid as possible, SLIM.

They take what the project's own methods take, healed and refused alike (:mod:`.topology`): libigl itself answers bad
meshes with NaN, or ends the process. What NaN is left is a status. Each is a start and an iteration, apart, so that a
benchmark can time the iteration alone.

References
----------
Jacobson et al., libigl: a simple C++ geometry processing library, 2018.
Rabinovich et al., Scalable locally injective mappings, ACM TOG 36(2), 2017 (SLIM).
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np

from deskew.errors import InputError, StepError, in_one_line, require
from deskew.flattening.conformal import signed_areas
from deskew.flattening.edges import Indices, edges_of
from deskew.flattening.intrinsic import triangles
from deskew.flattening.meshes import faces_from_above
from deskew.flattening.placement import as_seen
from deskew.flattening.topology import disc_of
from deskew.types import Flattened, Floats, Sheet, Status

ARAP_ITERATIONS = 20
SLIM_ITERATIONS = 15
_UNUSABLE = "libigl found no finite places; remove zero-area faces first, or use method `spring`"
_FOLDED = "{} faces are turned over; use method `spring`"


def lscm(sheet: Sheet) -> Flattened:
    """Flatten by libigl's least-squares conformal map, scaled to the mesh's mean edge length.

    Parameters
    ----------
    sheet : Sheet
        Grid or triangle mesh [mm]; a stiffness is not heeded.

    Raises
    ------
    InputError
        If libigl is not installed, or the mesh cannot lie flat in one piece (see `topology.disc_of`).
    StepError
        If libigl fails.
    """
    return _flattened(sheet, lscm_places, 1)


def arap(sheet: Sheet) -> Flattened:
    """Flatten by libigl's ARAP, 20 iterations from its LSCM, one vertex pinned; parameters as for `lscm`."""
    return _flattened(sheet, lambda v, f: arap_places(v, f, lscm_places(v, f)), ARAP_ITERATIONS)


def slim(sheet: Sheet) -> Flattened:
    """Flatten by libigl's SLIM (symmetric Dirichlet), 15 iterations from its LSCM; parameters as for `lscm`."""
    return _flattened(sheet, lambda v, f: slim_places(v, f, lscm_places(v, f)), SLIM_ITERATIONS)


PEERS = {"lscm": lscm, "arap": arap, "slim": slim}


def as_mesh(sheet: Sheet) -> tuple[Floats, Indices]:
    """Vertices (V, 3) and faces (F, 3) of a sheet, wound as seen from above.

    The quads of a grid are halved from upper right to lower left, cut ones left out.
    """
    vertices = np.ascontiguousarray(sheet.vertices.reshape(-1, 3))
    if sheet.faces is None:
        rows, columns = sheet.vertices.shape[:2]
        number = np.arange(rows * columns).reshape(rows, columns)
        whole = np.ones((rows - 1, columns - 1), dtype=np.bool_) if sheet.cut is None else ~sheet.cut
        a, b, c, d = (
            number[:-1, :-1][whole],
            number[:-1, 1:][whole],
            number[1:, :-1][whole],
            number[1:, 1:][whole],
        )
        faces = np.stack([np.stack([a, c, b], axis=-1), np.stack([b, c, d], axis=-1)], axis=1).reshape(-1, 3)
    else:
        faces = np.asarray(sheet.faces, dtype=np.int64)
    return vertices, faces_from_above(vertices, np.ascontiguousarray(faces))


def lscm_places(vertices: Floats, faces: Indices) -> Floats:
    """Places (V, 2) of libigl's LSCM [mm]; the two border vertices that lie farthest apart are held."""
    igl = _igl()
    opposite = edges_of(faces).opposite
    border = faces.ravel()[opposite < 0]
    require(border.size > 0, "faces", "have a border", "a closed surface")
    first = border[np.argmax(((vertices[border] - vertices[border].mean(axis=0)) ** 2).sum(axis=1))]
    others = border[border != first]
    last = others[np.argmax(((vertices[others] - vertices[first]) ** 2).sum(axis=1))]
    held = np.array([first, last], dtype=np.int64)
    places, _ = igl.lscm(vertices, faces, held, np.array([[0.0, 0.0], [1.0, 0.0]]))
    return np.asarray(places * (_mean_edge(vertices, faces) / _mean_edge(places, faces)))


def arap_places(vertices: Floats, faces: Indices, start: Floats, iterations: int = ARAP_ITERATIONS) -> Floats:
    """Places (V, 2) of libigl's ARAP from a start (V, 2) [mm]; one vertex is pinned, without which it fails."""
    igl = _igl()
    data = igl.ARAPData()
    data.max_iter = iterations
    igl.arap_precomputation(vertices, faces, 2, np.array([faces[0, 0]], dtype=np.int32), data)
    return np.asarray(igl.arap_solve(start[faces[0, :1]].copy(), data, np.ascontiguousarray(start)))


def slim_places(vertices: Floats, faces: Indices, start: Floats, iterations: int = SLIM_ITERATIONS) -> Floats:
    """Places (V, 2) of libigl's SLIM from a start (V, 2) without flips [mm]."""
    igl = _igl()
    data = igl.slim_precompute(
        np.asfortranarray(vertices),
        np.asfortranarray(faces, dtype=np.int32),
        np.asfortranarray(start),
        igl.MappingEnergyType.SYMMETRIC_DIRICHLET,
        np.zeros(0, dtype=np.int32),
        np.zeros((0, 2), order="F"),
        0.0,
    )
    return np.asarray(igl.slim_solve(data, iterations))[:, :2]


def _flattened(sheet: Sheet, places_of: Callable[[Floats, Indices], Floats], iterations: int) -> Flattened:
    """Heal a sheet, have libigl place its vertices, and lay them onto Z = 0 over the sheet if they are of any use."""
    _igl()
    disc = disc_of(Sheet(*as_mesh(sheet)))
    vertices, faces = disc.vertices, faces_from_above(disc.vertices, disc.faces)
    # Of faces without area only, libigl writes beyond its memory.
    chords = np.linalg.norm(np.subtract(*vertices[disc.edges.ends.T]), axis=1)
    solid = triangles(chords, disc.edges).n_mended < len(faces)
    require(solid, "vertices", "span an area", "faces without area only")
    try:
        places = places_of(vertices, faces)
    except RuntimeError as error:
        raise StepError(f"Flattening by libigl failed: {in_one_line(error)}; use method `spring`.") from error
    counters = {"iterations": float(iterations), **disc.counts}
    out = np.full((len(places), 3), np.nan)
    if np.isfinite(places).all():
        flips = int((signed_areas(places, faces) <= 0).sum())
        counters["flips"] = float(flips)
        out = as_seen(places, vertices)
        status, remedy = (Status.FOLDED, _FOLDED.format(flips)) if flips else (Status.AT_REST, "")
    else:
        status, remedy = Status.DIVERGED, _UNUSABLE
    return Flattened(out[disc.representative].reshape(sheet.vertices.shape), status, remedy, counters)


def _mean_edge(places: Floats, faces: Indices) -> float:
    """Mean length of the faces' sides [mm]."""
    return float(np.linalg.norm(places[faces] - places[faces[:, (1, 2, 0)]], axis=-1).mean())


def _igl() -> Any:
    """Import libigl, which is an extra.

    Raises
    ------
    InputError
        If it is not installed.
    """
    try:
        return import_module("igl")
    except ImportError as error:
        raise InputError(
            "`method` must be one that is installed, got a peer without libigl: pip install 'deskew3d[peers]'."
        ) from error

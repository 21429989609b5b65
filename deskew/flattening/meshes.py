"""Flatten any disc-like triangle mesh: the minimum of an energy on the plane, by local and global steps or by Newton.

The local step finds the vectors that edges or faces would like to be, the global one solves a Laplace system that is
factored once; Anderson acceleration joins the steps. Where the stiffness varies strongly a stiff part turns as a whole,
which that Laplacian resists and the energy does not: there Newton's method takes over, with the positive part of the
Hessian.

References
----------
Liu et al., A local/global approach to mesh parameterization, SGP 2008.
Peng et al., Anderson acceleration for geometry optimization and physics simulation, ACM TOG 37(4), 2018.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from deskew.errors import StepError, require, require_positive, require_whole
from deskew.flattening.conformal import lscm, signed_areas, tutte
from deskew.flattening.descent import local_global, newton
from deskew.flattening.energies import ENERGIES, Energy
from deskew.flattening.intrinsic import Triangles, bearings, triangles
from deskew.flattening.laplace import Laplacian
from deskew.flattening.topology import Disc, Edges, Indices, disc_of, edges_of
from deskew.flattening.unfolding import unfold
from deskew.types import Flattened, Floats, Sheet, Status
from deskew.types.arrays import require_numbers

_UNEVEN = 3.0  # ratio of stiffness beyond which Newton's method is used
_UPSIDE_DOWN = 0.25  # a rolled sheet's projected area is never below -0.22 of its own, an overturned page's is near -1
REMEDY = "smooth the surface or its noise, or cut it where it cannot lie flat"


def flatten_mesh(
    sheet: Sheet,
    *,
    energy: str = "springs",
    rest: Floats | None = None,
    tolerance: float = 5e-7,
    max_iterations: int = 500,
) -> Flattened:
    """Flatten a triangle mesh onto Z = 0, without folding it.

    Parameters
    ----------
    sheet : Sheet
        Triangle mesh [mm]: one orientable piece with a border; holes and overhangs are welcome. Its stiffness, if
        any, is one value a face [kg/s^2]; only ratios matter.
    energy : str
        "springs" or "arap" (as rigid as possible).
    rest : (E,) array or None
        Length that each edge of `edges_of(sheet.faces)` has on the flat sheet, >= 0 [mm]; None for its length now.
    tolerance : float
        Largest change of a coordinate in a step that counts as none, as a share of the sheet's size, in (0, 0.01].
    max_iterations : int
        Steps after which to give up, in [1, 1e6].

    Returns
    -------
    Flattened
        Vertices as many as and in the order of the sheet's, centred on its centre in x and y and turned to fit it
        best, with z = 0. A mesh that mostly faces up or down is seen from above, never mirrored; any other one (a
        scroll) lies with its faces counter-clockwise. A vertex without a face lies at its nearest neighbour's place.
        Counters: `iterations`, `flips`, `energy` [uJ], `healed_vertices`, `healed_faces`.

    Raises
    ------
    InputError
        If the mesh cannot lie flat in one piece (see `topology.disc_of`), or a parameter is out of its range.
    StepError
        If no start leads to finite places.
    """
    require(energy in ENERGIES, "energy", f"be one of {', '.join(ENERGIES)}", repr(energy))
    require_positive("tolerance", tolerance, 0.01)
    require_whole("max_iterations", max_iterations, 1, 1_000_000)
    disc = disc_of(sheet)
    lengths = _lengths(disc) if rest is None else _given(rest, sheet, disc)
    faces, edges = _upright(disc)
    shapes = triangles(lengths, edges)
    stiffness = np.ones(len(faces)) if sheet.stiffness is None else np.asarray(sheet.stiffness, float)[disc.kept]
    model = ENERGIES[energy](shapes, faces, edges, stiffness / stiffness.mean())
    system = Laplacian(edges.ends, model.weights, len(disc.vertices))
    uneven = float(stiffness.max()) > _UNEVEN * float(stiffness.min())
    solve = newton if uneven else local_global
    step = tolerance * float(np.ptp(disc.vertices, axis=0).max())
    best: tuple[int, Floats] | None = None
    iterations = 0
    for start in _starts(shapes, faces, edges, model, system):
        x, n = solve(model, system, start, step, max_iterations)
        iterations += n
        flips = _flips(x, faces, shapes)
        if np.isfinite(x).all() and (best is None or flips < best[0]):
            best = (flips, x)
        if best is not None and best[0] == 0:
            break
    if best is None:
        raise StepError("Flattening the mesh found no finite places for its vertices; remove its needle-like faces.")
    flips, x = best
    placed = np.zeros((len(disc.vertices), 3))
    placed[:, :2] = _aligned(x, disc.vertices[:, :2])
    counters = {"iterations": float(iterations), "flips": float(flips), "energy": model.value(x), **disc.counts}
    counters["healed_faces"] += shapes.n_mended
    status, remedy = (Status.FOLDED, f"{flips} faces are turned over: {REMEDY}") if flips else (Status.AT_REST, "")
    return Flattened(placed[disc.representative], status, remedy, counters)


def _starts(
    shapes: Triangles, faces: Indices, edges: Edges, model: Energy, system: Laplacian
) -> Iterator[Floats]:
    """Ever safer, ever dearer starts."""
    bearing = bearings(shapes, faces, edges, int(faces.max()) + 1)
    yield unfold(edges.ends, model.weights, shapes.lengths, bearing, system)
    yield lscm(shapes, faces, edges)
    yield tutte(shapes, faces, edges)


def _lengths(disc: Disc) -> Floats:
    """Length of each edge in space (E,) [mm]."""
    ends = disc.edges.ends
    return np.asarray(np.linalg.norm(disc.vertices[ends[:, 1]] - disc.vertices[ends[:, 0]], axis=1))


def _given(rest: Floats, sheet: Sheet, disc: Disc) -> Floats:
    """Carry rest lengths of the sheet's own edges over to the healed mesh."""
    require_numbers("rest", rest, "fiu")
    assert sheet.faces is not None
    edges = edges_of(sheet.faces)
    shape = (len(edges.ends),)
    require(rest.shape == shape, "rest", f"have shape {shape}, one length an edge", rest.shape)
    sound = bool(np.isfinite(rest).all() and (rest >= 0).all() and (rest > 0).any())
    require(sound, "rest", "be finite, >= 0 and not all 0 [mm]", "other lengths")
    lengths = np.empty(len(disc.edges.ends))
    # Faces that were turned round have their edges in another order: go by vertices.
    kept = edges.of_face[disc.kept]
    ends = np.sort(disc.representative[edges.ends[kept]], axis=-1)
    n = len(disc.vertices)
    keys = disc.edges.ends @ np.array([n, 1])
    lengths[np.searchsorted(keys, ends @ np.array([n, 1]))] = rest[kept]
    return lengths


def _upright(disc: Disc) -> tuple[Indices, Edges]:
    """Faces that wind counter-clockwise as seen from above, if the mesh has an upper side at all."""
    a, b, c = (disc.vertices[disc.faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    seen, whole = float(normals[:, 2].sum()), float(np.linalg.norm(normals, axis=1).sum())
    if seen >= -_UPSIDE_DOWN * whole:
        return disc.faces, disc.edges
    faces = np.ascontiguousarray(disc.faces[:, ::-1])
    return faces, edges_of(faces)


def _flips(x: Floats, faces: Indices, shapes: Triangles) -> int:
    """Number of faces that are turned over; those that never had an area to speak of are not counted."""
    return int((signed_areas(x, faces) < -1e-6 * float(shapes.areas.mean())).sum())


def _aligned(x: Floats, onto: Floats) -> Floats:
    """Turn and move points (V, 2) to fit others best, without a mirror."""
    x, centre = x - x.mean(axis=0), onto.mean(axis=0)
    target = onto - centre
    turn = (x[:, 0] - 1j * x[:, 1]) @ (target[:, 0] + 1j * target[:, 1])
    turn = turn / abs(turn) if abs(turn) > 0 else 1.0
    c, s = turn.real, turn.imag
    return np.asarray(x @ np.array([[c, s], [-s, c]]) + centre)

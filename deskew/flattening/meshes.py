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

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from deskew.errors import StepError, require, require_positive, require_whole
from deskew.flattening.conformal import lscm, signed_areas, tutte
from deskew.flattening.descent import minimise
from deskew.flattening.edges import Edges, Indices, edges_of
from deskew.flattening.energies import ENERGIES, BuildEnergy, Energy
from deskew.flattening.intrinsic import Triangles, bearings, triangles
from deskew.flattening.laplace import Laplacian
from deskew.flattening.placement import as_seen, is_upside_down
from deskew.flattening.settings import MAX_ITERATIONS
from deskew.flattening.topology import Disc, disc_of
from deskew.flattening.unfolding import unfold
from deskew.types import Flattened, Floats, Sheet, Status
from deskew.types.arrays import require_numbers

Measure = Callable[[Floats, Indices], Floats]

_UNEVEN = 3.0  # ratio of stiffness beyond which Newton's method is used
_FEW = 0.01  # share of faces turned over that is a local matter
_STIFFEN, _ROUNDS = 5.0, 8
_REMEDY = "smooth the surface or its noise, or cut it where it cannot lie flat"


def flatten_mesh(
    sheet: Sheet,
    *,
    energy: str = "arap",
    rest: Floats | Measure | None = None,
    tolerance: float = 2e-7,
    max_iterations: int = 300,
) -> Flattened:
    """Flatten a triangle mesh onto Z = 0, without folding it.

    Parameters
    ----------
    sheet : Sheet
        Triangle mesh [mm]: one orientable piece with a border; holes and overhangs are welcome. Its stiffness, if
        any, is one value a face [kg/s^2]; only ratios matter.
    energy : str
        "arap" (as rigid as possible) or "springs". On clean isometric meshes both err alike; springs do not resist
        being turned over, so that on sharp folds and irregular triangles they leave folded faces where the other
        leaves none, and take longer.
    rest : (E,) array, callable or None
        Length that each edge of `edges_of(sheet.faces)` has on the flat sheet, >= 0 [mm]; or a function that measures
        those of the healed mesh, given its vertices (V', 3) and faces (F', 3); None for the lengths now.
    tolerance : float
        Largest change of a coordinate in a step that counts as none, as a share of the sheet's size, in (0, 0.01].
    max_iterations : int
        Steps after which to give up on a start, in [1, 1e9].

    Returns
    -------
    Flattened
        Vertices as many as and in the order of the sheet's, centred on its centre in x and y and turned to fit it
        best, with z = 0. A mesh that mostly faces up or down is seen from above, never mirrored; any other one (a
        scroll) lies with its faces counter-clockwise. A vertex without a face lies at its nearest neighbour's place.
        Counters: `iterations`, `flips`, `energy` (of a mean stiffness of 1 kg/s^2) [uJ], `healed_vertices`,
        `healed_faces`, and `stiffened_faces`, which were turned over at first and made stiffer to lie right;
        `converged`, 1 or 0.

    Raises
    ------
    InputError
        If the mesh cannot lie flat in one piece (see `topology.disc_of`), or a parameter is out of its range.
    StepError
        If no start leads to finite places.
    """
    require(energy in ENERGIES, "energy", f"be one of {', '.join(ENERGIES)}", repr(energy))
    require_positive("tolerance", tolerance, 0.01)
    require_whole("max_iterations", max_iterations, 1, MAX_ITERATIONS)
    disc = disc_of(sheet)
    if callable(rest):
        lengths = rest(disc.vertices, disc.faces)
    else:
        lengths = _lengths(disc) if rest is None else _given(rest, sheet, disc)
    faces, edges = _upright(disc)
    plate = _Plate(faces, edges, triangles(lengths, edges), len(disc.vertices))
    require(plate.shapes.n_mended < len(faces), "vertices", "span an area", "faces without area only")
    stiffness = np.ones(len(faces)) if sheet.stiffness is None else np.asarray(sheet.stiffness, float)[disc.kept]
    stiffness = stiffness / stiffness.mean()
    step_mm = tolerance * float(np.ptp(disc.vertices, axis=0).max())
    found = _solve(plate, stiffness, ENERGIES[energy], step_mm, max_iterations)
    placed = as_seen(found.x, disc.vertices)
    counters = {"iterations": float(found.iterations), "flips": float(found.flips), "energy": max(found.energy, 0.0)}
    counters |= disc.counts
    counters["healed_faces"] += plate.shapes.n_mended
    counters |= {"stiffened_faces": float(found.stiffened), "converged": float(found.converged)}
    status, remedy = _outcome(found)
    return Flattened(placed[disc.representative], status, remedy, counters)


def _outcome(found: _Found) -> tuple[Status, str]:
    """How it ended, and what to try."""
    if found.flips:
        return Status.FOLDED, f"{found.flips} faces are turned over: {_REMEDY}"
    if not found.converged:
        return Status.LOCKED, "not at rest after the last step: raise `max_iterations`, or smooth the surface's noise"
    return Status.AT_REST, ""


class _Plate(NamedTuple):
    """A disc as the solver sees it: lengths, no places."""

    faces: Indices
    edges: Edges
    shapes: Triangles
    n_vertices: int

    def starts(self, model: Energy, system: Laplacian) -> Iterator[Floats]:
        """Ever safer, ever dearer starts, (V, 2) each [mm]."""
        bearing = bearings(self.shapes, self.faces, self.edges, self.n_vertices)
        yield unfold(self.edges.ends, model.weights, self.shapes.lengths, bearing, system)
        yield lscm(self.shapes, self.faces, self.edges)
        yield tutte(self.shapes, self.faces, self.edges)

    def turned_over(self, x: Floats) -> npt.NDArray[np.bool_]:
        """Faces that lost their area or are turned over; those that never had any to speak of do not count."""
        areas = self.shapes.areas
        return np.asarray((signed_areas(x, self.faces) <= 1e-6 * areas) & (areas > 1e-6 * areas.mean()))


class _Found(NamedTuple):
    """Where a solve came to."""

    x: Floats
    iterations: int
    flips: int
    energy: float
    stiffened: int
    converged: bool


def _solve(plate: _Plate, stiffness: Floats, build: BuildEnergy, step_mm: float, max_iterations: int) -> _Found:
    """Minimise from one start after the other until few faces are turned over, then stiffen those few."""
    model = build(plate.shapes, plate.faces, plate.edges, stiffness)
    system = Laplacian(plate.edges.ends, model.weights, plate.n_vertices)
    uneven = float(stiffness.max()) > _UNEVEN * float(stiffness.min())
    best: _Found | None = None
    iterations = 0
    for start in plate.starts(model, system):
        x, n, _, converged = minimise(model, system, start, step_mm, max_iterations, uneven=uneven)
        iterations += n
        flips = int(plate.turned_over(x).sum())
        if np.isfinite(x).all() and (best is None or flips < best.flips):
            best = _Found(x, iterations, flips, model.value(x), 0, converged)
        # A wrong start turns whole regions over, a hard surface here and there a face.
        if best is not None and best.flips <= _FEW * len(plate.faces):
            break
    if best is None:
        raise StepError("Flattening the mesh found no finite places for its vertices; remove its needle-like faces.")
    return _stiffened(plate, stiffness, build, best, step_mm, max_iterations) if best.flips else best


def _stiffened(
    plate: _Plate, stiffness: Floats, build: BuildEnergy, best: _Found, step_mm: float, max_iterations: int
) -> _Found:
    """Stiffen the faces that are turned over, and those around them, again and again; keep what turns the fewest."""
    found, touched = best, np.zeros(len(plate.faces), dtype=np.bool_)
    for _ in range(_ROUNDS):
        near = np.zeros(plate.n_vertices, dtype=np.bool_)
        near[plate.faces[plate.turned_over(found.x)]] = True
        around = near[plate.faces].any(axis=1)
        touched |= around
        stiffness = np.where(around, _STIFFEN * stiffness, stiffness)
        model = build(plate.shapes, plate.faces, plate.edges, stiffness)
        system = Laplacian(plate.edges.ends, model.weights, plate.n_vertices)
        x, n, _, converged = minimise(model, system, found.x, step_mm, max_iterations)
        if not np.isfinite(x).all():
            break
        flips = int(plate.turned_over(x).sum())
        found = _Found(x, found.iterations + n, flips, model.value(x), int(touched.sum()), converged)
        better = flips < best.flips
        if better:
            best = found
        if not flips or not (better or converged):  # what neither rests nor turns any back is no sheet
            break
    return best._replace(iterations=found.iterations)


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
    """Faces as seen from above, with their edges."""
    faces = faces_from_above(disc.vertices, disc.faces)
    return faces, disc.edges if faces is disc.faces else edges_of(faces)


def faces_from_above(vertices: Floats, faces: Indices) -> Indices:
    """Turn all faces (F, 3) round if a mesh mostly faces down, so that its flat picture is the one from above.

    A rolled sheet has no upper side; its faces stay as they are.
    """
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.ascontiguousarray(faces[:, ::-1]) if is_upside_down(np.cross(b - a, c - a)) else faces

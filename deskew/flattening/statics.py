"""The method `spring`: the paper's springs brought to rest in the plane at once, without the time in between.

The particle system of section 3 ends where the springs' energy is least. On the plane that place can be found directly,
if the search starts unfolded. A grid is laid out conformally by its lengths on a coarse level, then refined level by
level. On each, the local step gives every spring its rest length in the direction that it has (the forces), and the
global step moves all vertices to where these lengths fit best (one multigrid cycle), accelerated after Anderson.

Where stiffnesses differ strongly, or springs reach farther, Newton's method takes over on the finest level. Folded
quads are counted at the end; if there are any, the search begins again from a finer start.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from deskew.errors import require
from deskew.flattening import newton
from deskew.flattening.anderson import Iterated, accelerate
from deskew.flattening.flatforces import count_folded, flat_energy, flat_forces
from deskew.flattening.gridstart import conformal_start
from deskew.flattening.inside import flat_surface
from deskew.flattening.multigrid import Hierarchy, coarse_index, hierarchy, interpolated, v_cycle
from deskew.flattening.settings import StaticSettings
from deskew.flattening.springs import Springs, chord_lengths, grid_springs, spring_constants
from deskew.types import Flattened, Floats, Sheet, Status

# Longest side of the level that the first, the second, ... search starts from [vertices]; at last the grid itself.
_STARTS = (16, 32, 64, 128)
# The springs' stiffness across all directions is more than twice what it is along one: steps may be longer by this.
_OVER = 1.7
# Above this ratio of the stiffest to the softest spring, local-global takes hundreds of steps and Newton a few.
_EVEN = 4.0
# Smooth changes are the slowest to settle, and cheap on a coarse level: share of a vertex spacing that counts as none.
_COARSE_TOLERANCE, _COARSE_ITERATIONS = 1e-4, 200

# Height of a quad over its length below which it has no area to speak of.
_FLATTEST = 1e-4

# Share of a sheet's area, as seen from above, that must show its back before its grid counts as mirrored.
_UPSIDE_DOWN = 0.25

_FOLDED = "{folded} quads are folded over: scan the page again with more vertices, or remove noise (`noise_mm`)."
_UNSETTLED = "The springs are still moving after {n} iterations: raise `max_iterations` or `tolerance`."


@dataclass(frozen=True, slots=True)
class _Grid:
    """One level: rest lengths (4, R, C) and vertices (R, C, 3) [mm]."""

    rest: Floats
    vertices: Floats

    @property
    def shape(self) -> tuple[int, int]:
        return self.rest.shape[1], self.rest.shape[2]


def flatten_grid(sheet: Sheet, settings: StaticSettings) -> Flattened:
    """Flatten a grid by minimising its springs' energy on the plane.

    Parameters
    ----------
    sheet : Sheet
        Grid [mm].
    settings : StaticSettings
        Rest lengths, more springs, tolerance.

    Returns
    -------
    Flattened
        With z = 0, at the mean place and in the direction that the sheet has as seen from above. Counters:
        `iterations`, `residual_mm`, `spring_energy` [uJ], `folded_quads` and `starts`, the searches made. With its
        `surface`, where the sheet has one.
    """
    if settings.through > 1:
        return _through(sheet, settings)
    springs = grid_springs(sheet, settings.springs)
    _require_area(sheet.vertices)
    tolerance = settings.tolerance * float(max(np.ptp(sheet.vertices[..., axis]) for axis in range(3)))
    found, folded, n_starts = _unfolded(sheet, springs, tolerance, settings.max_iterations)
    counters = {
        "iterations": float(found.n_iterations),
        "residual_mm": found.residual,
        "spring_energy": newton.energy(found.x.reshape(-1, 2), newton.SpringList(*springs.pairs()))
        if len(springs.rest) > 4
        else float(flat_energy(found.x, springs.rest, springs.k_s)),
        "folded_quads": float(folded),
        "starts": float(n_starts),
    }
    status, remedy = Status.AT_REST, ""
    if folded:
        status, remedy = Status.FOLDED, _FOLDED.format(folded=folded)
    elif not found.converged:
        status, remedy = Status.LOCKED, _UNSETTLED.format(n=found.n_iterations)
    flat = as_seen(found.x, sheet.vertices, -_handedness(sheet.vertices))
    inside = None if sheet.surface is None else flat_surface(sheet.surface, flat, sheet.refinement)
    return Flattened(flat, status, remedy, counters, inside)


def _require_area(vertices: Floats) -> None:
    """Refuse a grid whose vertices all lie on one line: springs would lay it there again, and call it flat."""
    across, down = vertices[1:, 1:] - vertices[:-1, :-1], vertices[1:, :-1] - vertices[:-1, 1:]
    areas = np.linalg.norm(np.cross(across, down), axis=-1)
    longest = np.maximum((across**2).sum(axis=-1), (down**2).sum(axis=-1))
    require(bool((areas > _FLATTEST * longest).any()), "vertices", "span an area", "quads without area only")


def _through(sheet: Sheet, settings: StaticSettings) -> Flattened:
    """Flatten a dense grid through every n-th of its vertices."""
    n, shape = settings.through, sheet.vertices.shape
    fits = sheet.surface is None and sheet.stiffness is None and sheet.cut is None
    require(fits, "through", "be 1 for a sheet with a surface, a stiffness or cuts of its own", n)
    whole = all((size - 1) % n == 0 and size > n for size in shape[:2])
    require(whole, "through", f"divide both sides' {shape[0] - 1} and {shape[1] - 1} quads", n)
    coarse = Sheet(sheet.vertices[::n, ::n], surface=sheet.vertices)
    flat = flatten_grid(coarse, replace(settings, through=1))
    assert flat.surface is not None
    folded = int(count_folded(flat.surface, np.zeros((shape[0] - 1, shape[1] - 1), bool), _handedness(sheet.vertices)))
    counters = {**flat.counters, "folded_quads": float(folded)}
    if folded and flat.status is Status.AT_REST:
        return Flattened(flat.surface, Status.FOLDED, _FOLDED.format(folded=folded), counters)
    return Flattened(flat.surface, flat.status, flat.remedy, counters)


def _unfolded(sheet: Sheet, springs: Springs, tolerance: float, most: int) -> tuple[Iterated, int, int]:
    """Search from finer and finer starts until nothing is folded; return the result, its folded quads, the searches."""
    # Only ratios matter: the stiffest spring is 1, as are those of the uniform hierarchy.
    springs = replace(springs, k_s=springs.k_s / springs.k_max)
    even = _is_even(springs)
    uniform = hierarchy(spring_constants(springs.grid, 1.0))
    pyramid = _pyramid(sheet, springs, len(uniform.levels))
    solver = uniform if even and np.ptp(springs.k_s[springs.k_s > 0]) == 0 and not springs.cut.any() else None
    starts = list(dict.fromkeys(_level_within(pyramid, limit) for limit in (*_STARTS, max(springs.grid))))
    n_starts = 0
    for start in starts:
        n_starts += 1
        x = _started(pyramid, uniform, start)
        if even:
            found = _settle(x, springs, solver or hierarchy(springs.k_s), 0, tolerance, most)
        else:
            flat = newton.minimise(x.reshape(-1, 2), newton.SpringList(*springs.pairs()), tolerance, most)
            found = flat._replace(x=flat.x.reshape(x.shape))
        folded = int(count_folded(found.x, springs.cut, -1.0))
        if not folded:
            break
    return found, folded, n_starts


def _is_even(springs: Springs) -> bool:
    """Whether one multigrid cycle for all directions at once serves these springs."""
    there = springs.k_s[springs.k_s > 0]
    return len(springs.rest) == 4 and float(there.max()) <= _EVEN * float(there.min())


def _pyramid(sheet: Sheet, springs: Springs, n_levels: int) -> list[_Grid]:
    """Levels from fine to coarse; a coarse spring is as long as the two that it spans.

    Coarse levels know neither cuts nor stiffness: they only start the search.
    """
    rest = springs.rest[:4]
    if springs.cut.any():
        chords = chord_lengths(sheet.vertices)
        rest = np.where(rest > 0, rest, chords)
    grids = [_Grid(rest, sheet.vertices)]
    while len(grids) < n_levels:
        grids.append(_coarser(grids[-1]))
    return grids


def _coarser(fine: _Grid) -> _Grid:
    rows, columns = (coarse_index(n) for n in fine.shape)
    vertices = np.ascontiguousarray(fine.vertices[np.ix_(rows, columns)])
    rest = chord_lengths(vertices)
    rest[0, :, :-1] = np.add.reduceat(fine.rest[0][rows, :-1], columns[:-1], axis=1)
    rest[1, :-1, :] = np.add.reduceat(fine.rest[1][:-1, columns], rows[:-1], axis=0)
    # Where a side has an even number of vertices its last step is short, and no fine diagonals span that quad.
    r, c = (int((np.diff(index) == 2).sum()) for index in (rows, columns))
    falling, rising = fine.rest[2], fine.rest[3]
    rest[2, :r, :c] = falling[0 : 2 * r : 2, 0 : 2 * c : 2] + falling[1 : 2 * r : 2, 1 : 2 * c : 2]
    rest[3, :r, :c] = rising[1 : 2 * r : 2, 0 : 2 * c : 2] + rising[0 : 2 * r : 2, 1 : 2 * c : 2]
    return _Grid(rest, vertices)


def _level_within(pyramid: list[_Grid], limit: int) -> int:
    """Return the finest level of at most `limit` vertices a side; the coarsest if none is as small."""
    return next(level for level, grid in enumerate(pyramid) if max(grid.shape) <= limit or level == len(pyramid) - 1)


def _started(pyramid: list[_Grid], uniform: Hierarchy, start: int) -> Floats:
    """Lay out level `start` conformally and refine it to the finest, not yet settled there: places (R, C, 2) [mm]."""
    x = conformal_start(pyramid[start].rest)
    for level in range(start, 0, -1):
        grid = pyramid[level]
        springs = Springs(grid.rest, spring_constants(grid.shape, 1.0))
        x = _settle(x, springs, uniform, level, _COARSE_TOLERANCE * springs.rest_mean, _COARSE_ITERATIONS).x
        x = interpolated(x, pyramid[level - 1].shape)
    return x


def _settle(x: Floats, springs: Springs, solver: Hierarchy, at: int, tolerance: float, most: int) -> Iterated:
    """Bring springs to rest by local and global steps, the latter a multigrid cycle from level `at` of `solver`."""
    level, k_s = solver.levels[at], springs.k_s
    framed = np.zeros((x.shape[0] + 2, x.shape[1] + 2, 2))
    framed[1:-1, 1:-1] = x

    def local_global(places: Floats) -> Floats:
        flat_forces(places, springs.rest, k_s, level.force)
        v_cycle(solver, at)
        return np.asarray(places + _OVER * level.correction)

    found = accelerate(local_global, framed, tolerance, most)
    return found._replace(x=np.ascontiguousarray(found.x[1:-1, 1:-1]))


def _handedness(vertices: Floats) -> float:
    """-1 if a grid's columns and rows are as a page's, +X and -Y as seen from above; 1 if they are clearly mirrored.

    A sheet rolled by more than half a turn shows some of its back, but never as much as a quarter of its area.
    """
    across, down = vertices[1:, 1:] - vertices[:-1, :-1], vertices[1:, :-1] - vertices[:-1, 1:]
    # Twice a quad's area is the cross product of its diagonals.
    normals = np.cross(across, down)
    seen = float(normals[..., 2].sum())
    return 1.0 if seen > _UPSIDE_DOWN * float(np.sqrt(np.einsum("ijk,ijk->ij", normals, normals)).sum()) else -1.0


def as_seen(places: Floats, vertices: Floats, mirror: float = 1.0) -> Floats:
    """Turn and move flat places to where the sheet is as seen from above.

    Parameters
    ----------
    places : (..., 2) array
        Flattened [mm].
    vertices : (..., 3) array
        The sheet [mm].
    mirror : float
        -1 to turn the flat sheet over first.

    Returns
    -------
    (..., 3) array
        With z = 0 [mm].
    """
    p = places - places.reshape(-1, 2).mean(axis=0)
    p[..., 1] *= mirror
    middle = vertices[..., :2].reshape(-1, 2).mean(axis=0)
    px, py, qx, qy = p[..., 0], p[..., 1], vertices[..., 0] - middle[0], vertices[..., 1] - middle[1]
    angle = np.arctan2(float((px * qy - py * qx).sum()), float((px * qx + py * qy).sum()))
    flat = np.zeros(vertices.shape)
    flat[..., 0] = np.cos(angle) * px - np.sin(angle) * py + middle[0]
    flat[..., 1] = np.sin(angle) * px + np.cos(angle) * py + middle[1]
    return flat

"""The method `spring`: the paper's springs brought to rest in the plane at once, without the time in between.

The particle system of section 3 ends where the springs' energy is least. On the plane that place can be found directly,
if the search starts unfolded. A grid is laid out conformally by its lengths on a coarse level, then refined level by
level. On each, the local step gives every spring its rest length in the direction that it has (the forces), and the
global step moves all vertices to where these lengths fit best (one multigrid cycle), accelerated after Anderson.

Where stiffnesses differ strongly, or springs reach farther, Newton's method takes over on the finest level. Folded
quads are counted at the end; if there are any, the search begins again from a finer start.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from deskew.errors import require
from deskew.flattening import energies
from deskew.flattening.anderson import Iterated, accelerate
from deskew.flattening.chords import chord_lengths
from deskew.flattening.descent import newton
from deskew.flattening.flatforces import count_folded, flat_energy, flat_forces
from deskew.flattening.freescale import SoftPart, settle_scale, shrink_percent, soft_part
from deskew.flattening.gridstart import conformal_start
from deskew.flattening.inside import flat_surface
from deskew.flattening.laplace import laplacian
from deskew.flattening.multigrid import Hierarchy, framed, hierarchy, moved, unframed, v_cycle
from deskew.flattening.placement import as_seen, handedness, has_area
from deskew.flattening.pyramid import Grid, pyramid, refined
from deskew.flattening.settings import StaticSettings
from deskew.flattening.springs import Springs, grid_springs, spring_constants
from deskew.types import Flattened, Floats, Sheet, Status

# Longest side of the level that the first, the second, ... search starts from [vertices]; at last the grid itself.
_STARTS = (16, 32, 64, 128)
# The springs' stiffness across all directions is more than twice what it is along one: steps may be longer by this.
_OVER = 1.7
# Above this ratio of the stiffest to the softest spring, local-global takes hundreds of steps and Newton a few.
_EVEN = 4.0
# Smooth changes are the slowest to settle, and cheap on a coarse level: share of a vertex spacing that counts as none.
_COARSE_TOLERANCE, _COARSE_ITERATIONS = 1e-4, 200
_SHORTEST_START = 1e-3  # of the mean spring: lengths across a cut count as no shorter at the start

_FOLDED = "{folded} quads are folded over: scan the page again with more vertices, or remove noise (`noise_mm`)."
_UNSETTLED = "The springs are still moving after {n} iterations: raise `max_iterations` or `tolerance`."


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
        `iterations`, `residual_mm`, `spring_energy` [uJ], `folded_quads` and `starts`, the searches made; with a free
        scale `scale` too, and `shrink_estimated` [%], by which the soft material is smaller than it was. With its
        `surface`, where the sheet has one.
    """
    if settings.through > 1:
        return _through(sheet, settings)
    springs = grid_springs(sheet, settings.springs)
    # Springs would lay vertices on one line there again, and call it flat.
    require(has_area(sheet.vertices), "vertices", "span an area", "quads without area only")
    tolerance = settings.tolerance * float(max(np.ptp(sheet.vertices[..., axis]) for axis in range(3)))
    part = soft_part(sheet, springs) if settings.free_scale else None
    springs = springs if part is None else part.springs
    found, folded, n_starts = _unfolded(sheet, springs, tolerance, settings.max_iterations)
    scaled: dict[str, float] = {}
    if part is not None:
        found, scale = _with_scale(part, found, tolerance, settings)
        springs, folded = part.scaled(scale), int(count_folded(found.x, springs.cut, -1.0))
        scaled = {"scale": scale, "shrink_estimated": shrink_percent(scale)}
    counters = {
        "iterations": float(found.n_iterations),
        "residual_mm": found.residual,
        "spring_energy": _listed(springs).value(found.x.reshape(-1, 2))
        if len(springs.rest) > 4
        else float(flat_energy(found.x, springs.rest, springs.k_s)),
        "folded_quads": float(folded),
        "starts": float(n_starts),
        **scaled,
    }
    status, remedy = Status.AT_REST, ""
    if folded:
        status, remedy = Status.FOLDED, _FOLDED.format(folded=folded)
    elif not found.converged:
        status, remedy = Status.LOCKED, _UNSETTLED.format(n=found.n_iterations)
    flat = as_seen(found.x, sheet.vertices, -handedness(sheet.vertices))
    inside = None if sheet.surface is None else flat_surface(sheet.surface, flat, sheet.refinement)
    return Flattened(flat, status, remedy, counters, inside)


def _with_scale(part: SoftPart, found: Iterated, tolerance: float, settings: StaticSettings) -> tuple[Iterated, float]:
    """Bring springs that rest with scale 1 to rest with the scale that fits them; return it too."""

    def settle(x: Floats, springs: Springs) -> Iterated:
        unit = replace(springs, k_s=springs.k_s / springs.k_max)
        return _settle_uneven(x, unit, tolerance, settings.max_iterations)

    return settle_scale(part, found, settle, settings.tolerance)


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
    folded = int(count_folded(flat.surface, np.zeros((shape[0] - 1, shape[1] - 1), bool), handedness(sheet.vertices)))
    counters = {**flat.counters, "folded_quads": float(folded)}
    if folded and flat.status is Status.AT_REST:
        return Flattened(flat.surface, Status.FOLDED, _FOLDED.format(folded=folded), counters)
    return Flattened(flat.surface, flat.status, flat.remedy, counters)


def _unfolded(sheet: Sheet, springs: Springs, tolerance: float, most: int) -> tuple[Iterated, int, int]:
    """Search from finer and finer starts until nothing is folded; return the best, its folded quads, the searches."""
    even = _is_even(springs)
    uniform = hierarchy(spring_constants(springs.grid, 1.0))
    grids = _levels(sheet, springs, len(uniform.levels))
    # Only ratios matter; and single precision holds no constants of any size.
    unit = replace(springs, k_s=springs.k_s / springs.k_max)
    solver = uniform if np.array_equal(unit.k_s, spring_constants(springs.grid, 1.0)) else None
    starts = list(dict.fromkeys(_level_within(grids, limit) for limit in (*_STARTS, max(springs.grid))))
    searches: list[tuple[Iterated, int]] = []
    for start in starts:
        x = _started(grids, uniform, start)
        if even:
            found = _settle(x, unit, solver or hierarchy(unit.k_s), 0, tolerance, most)
            found = found._replace(x=unframed(found.x))
        else:
            found = _settle_uneven(unframed(x), unit, tolerance, most)
        searches.append((found, int(count_folded(found.x, springs.cut, -1.0))))
        if not searches[-1][1]:
            break
    return *min(searches, key=lambda search: search[1]), len(searches)


def _is_even(springs: Springs) -> bool:
    """Whether one multigrid cycle for all directions at once serves these springs."""
    there = springs.k_s[springs.k_s > 0]
    return len(springs.rest) == 4 and float(there.max()) <= _EVEN * float(there.min())


def _levels(sheet: Sheet, springs: Springs, n: int) -> list[Grid]:
    """Return `n` levels of the sheet; they know neither cuts nor stiffness, since they only start the search."""
    rest = springs.rest[:4]
    if springs.cut.any():
        # Nothing asks the vertices across a cut to be distinct.
        chords = np.maximum(chord_lengths(sheet.vertices), _SHORTEST_START * springs.rest_mean)
        rest = np.where(rest > 0, rest, chords)
    return pyramid(rest, sheet.vertices, n)


def _level_within(grids: list[Grid], limit: int) -> int:
    """Return the finest level of at most `limit` vertices a side; the coarsest if none is as small."""
    return next(level for level, grid in enumerate(grids) if max(grid.shape) <= limit or level == len(grids) - 1)


def _started(grids: list[Grid], uniform: Hierarchy, start: int) -> Floats:
    """Lay out level `start` conformally and refine it to the finest, not yet settled there: places, framed [mm]."""
    x = framed(conformal_start(grids[start].rest))
    for level in range(start, 0, -1):
        grid = grids[level]
        springs = Springs(grid.rest, grid.k_s)
        x = _settle(x, springs, uniform, level, _COARSE_TOLERANCE * springs.rest_mean, _COARSE_ITERATIONS).x
        x = refined(x, grids[level - 1])
    return x


def _settle(x: Floats, springs: Springs, solver: Hierarchy, at: int, tolerance: float, most: int) -> Iterated:
    """Bring springs to rest by local and global steps, the latter a multigrid cycle from level `at` of `solver`."""
    level, k_s = solver.levels[at], springs.k_s
    pull = np.empty((2, springs.grid[1]))

    def local_global(places: Floats) -> Floats:
        flat_forces(places, springs.rest, k_s, pull, level.force)
        v_cycle(solver, at)
        return np.asarray(moved(places, level.correction, _OVER))

    return accelerate(local_global, x, tolerance, most)


def _settle_uneven(x: Floats, springs: Springs, tolerance: float, most: int) -> Iterated:
    """Bring springs to rest by Newton's method, whatever their stiffness and reach."""
    model = _listed(springs)
    matrix = laplacian(model.ends, model.weights, x.shape[0] * x.shape[1])
    found = newton(model, matrix, x.reshape(-1, 2), tolerance, most)
    return found._replace(x=found.x.reshape(x.shape))


def _listed(springs: Springs) -> energies.Springs:
    """Springs of a grid as those of any mesh."""
    a, b, rest, k_s = springs.pairs()
    there = k_s > 0
    return energies.Springs(np.stack([a, b], axis=-1)[there], k_s[there], rest[there])

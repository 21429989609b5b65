"""The particle system run until the sheet lies at rest on the plane (section 3.4).

The paper stops when "the internal energy is minimized after collision". Energy alone accepts failures: a sheet that is
locked in a buckle can store less of it than the flat one. Rest here means all of: every particle within eps of the
plane; spring energy changed by less than 1e-5 of itself in 200 steps; kinetic energy below 1e-3 of it; no quad folded.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from deskew.errors import require
from deskew.flattening.contact import Plane
from deskew.flattening.flatforces import count_folded
from deskew.flattening.forces import System, spring_energy, system
from deskew.flattening.integrators import CONTACTS, EVALUATIONS, REJECTED, STEPS, Pace, Run, advance, start
from deskew.flattening.outside import Outside, advance_outside
from deskew.flattening.schemes import INTEGRATORS, Scheme
from deskew.flattening.settings import ParticleSettings
from deskew.flattening.springs import Springs, grid_springs
from deskew.flattening.stability import largest_stable_step, stiffest_mode
from deskew.types import Array, Flattened, Floats, Sheet, Status

WINDOW = 200
# A window in which the step was halved so often that it lasted less than this share of 200 full steps proves nothing.
SHORTEST_WINDOW = 0.1
ENERGY_CHANGE = 1e-5
KINETIC_SHARE = 1e-3
# Springs of an exact isometry end with no energy at all; below this strain there is nothing left to settle.
NEGLIGIBLE_STRAIN = 1e-6
# A strain of 1 in the mean over all springs is no sheet any more.
RUNAWAY_STRAIN = 1.0
DT_SAFETY = 0.9
# Implicit Euler has no limit: its step, in units of the longest that explicit Euler may ever make, 2 / sqrt(lam_max).
DT_IMPLICIT = 4.0
# The step is never halved further than this share of the full one; literal halving goes on until it is absurd.
DT_FLOOR = {"working": 2.0**-10, "literal": 1e-12, "none": 1.0}

_DRAG = 3.0
_SINKING = 0.5

HISTORY = (
    "time_s",
    "force_evaluations",
    "spring_energy_uj",
    "kinetic_energy_uj",
    "potential_energy_uj",
    "height_max_mm",
)
"""What is kept of a run, at its start and after every stride; the potential energy is that of the strong push."""

_REMEDY = {
    Status.LOCKED: "Particles hang {z:.2f} mm above the plane in a buckle that holds: raise `gravity`.",
    Status.FOLDED: "{folded} quads are folded over: lower `drag`, change `gravity`, or use a finer mesh or a static "
    "method.",
    Status.DIVERGED: "The springs tore apart: lower `dt`, or leave it out to have a stable one chosen.",
}
_COLLAPSED = "Literal step halving took dt down to {dt:.1e} s after {steps} steps: use `halving` = working."
_UNSETTLED = "Still moving after {steps} steps: raise `max_steps`."


@dataclass(frozen=True, slots=True)
class Constants:
    """What a run was made with, after the settings left to choose have been chosen.

    Attributes
    ----------
    physics : System
        Springs, damping, gravity and drag.
    weak_gravity : float
        Downward acceleration once the whole sheet lies within eps of the plane [mm/s^2].
    plane : Plane
        Contact with the bed.
    pace : Pace
        Full step, the least that it may be halved to, and what an embedded pair takes for exact.
    window, stride : int
        Steps after which the sheet is looked at for rest, and after which the history gets an entry.
    """

    physics: System
    weak_gravity: float
    plane: Plane
    pace: Pace
    window: int
    stride: int


def folded_quads(xy: Floats, cut: npt.NDArray[np.bool_] | None = None) -> int:
    """Count the quads of an (R, C, 2) grid that are turned over or not convex, against the way most of it lies.

    Quads that are `cut`, (R - 1, C - 1), are none of the sheet and do not count.
    """
    none = np.zeros((xy.shape[0] - 1, xy.shape[1] - 1), dtype=np.bool_)
    return min(int(count_folded(xy, none if cut is None else cut, up)) for up in (1.0, -1.0))


def choose_constants(springs: Springs, x: Array, integrator: Scheme | Outside, settings: ParticleSettings) -> Constants:
    """Fill in the settings that were left to choose.

    Parameters
    ----------
    springs : Springs
        With their rest lengths.
    x : (3, V) array
        The sheet at rest [mm].
    integrator : Scheme or Outside
        The integrator, whose stability sets the step.
    settings : ParticleSettings
        None where to choose.

    Raises
    ------
    InputError
        If no step is stable for the integrator at this damping.
    """
    k, mass = springs.k_max, settings.mass
    drag = _DRAG * np.sqrt(k * mass) / max(springs.grid) if settings.drag is None else settings.drag
    gravity = settings.push * k * springs.rest_mean / mass if settings.gravity is None else settings.gravity
    physics = system(springs, beta=0.0, mass=mass, gravity=gravity, drag=drag)
    lam_max = stiffest_mode(x, physics)
    beta = 2 * settings.damping_ratio / np.sqrt(lam_max) if settings.k_d is None else settings.k_d / k
    dt = settings.dt
    if dt is None:
        limit = largest_stable_step(integrator, lam_max, beta, drag / mass)
        dt = DT_SAFETY * limit if np.isfinite(limit) else DT_IMPLICIT * 2 / np.sqrt(lam_max)
    require(dt > 0, "k_d", "be positive, or `drag` be: this integrator is unstable at every step without", settings.k_d)
    weak = min(gravity, _SINKING * settings.eps_mm / dt**2) if settings.weak_gravity is None else settings.weak_gravity
    plane = Plane(float(settings.eps_mm), float(settings.k_r), settings.halving == "literal")
    pace = Pace(float(dt), float(dt * DT_FLOOR[settings.halving]), float(settings.tolerance_mm))
    implicit = isinstance(integrator, Scheme) and integrator.implicit
    window = round(WINDOW / DT_IMPLICIT) if implicit else WINDOW
    stride = window if settings.stride is None else settings.stride
    return Constants(physics._replace(beta=float(beta)), float(weak), plane, pace, window, stride)


def settle(sheet: Sheet, integrator: Scheme | Outside, settings: ParticleSettings) -> Flattened:
    """Let a sheet fall onto Z = 0 and relax there.

    The sheet starts at rest, lowered or lifted so that its lowest vertex touches the plane.

    Parameters
    ----------
    sheet : Sheet
        A grid of vertices [mm], with or without a stiffness for each quad.
    integrator : Scheme or Outside
        The integrator.
    settings : ParticleSettings
        The paper's constants.

    Returns
    -------
    Flattened
        With counters `steps`, `steps_rejected`, `force_evaluations`, `contacts`, `folded_quads`, `spring_energy` [uJ],
        `kinetic_energy` [uJ], `height_max_mm` (before z is set to 0 on `AT_REST`), `dt`, `dt_smallest` and `time` [s],
        `penetration_mm` (how deep a step brought a particle below the plane, before contact lifted it), and the
        constants chosen: `k_d` [kg/s], `gravity`, `weak_gravity` [mm/s^2] and `drag` [kg/s]; and with its `history`.

    Raises
    ------
    StepError
        If an integrator from outside breaks.
    """
    springs = grid_springs(sheet, settings.springs)
    vertices = sheet.vertices - [0.0, 0.0, sheet.vertices[..., 2].min()]
    x = np.ascontiguousarray(vertices.reshape(-1, 3).T)
    constants = choose_constants(springs, x, integrator, settings)
    stages = integrator if isinstance(integrator, Scheme) else INTEGRATORS["euler"]
    run = start(vertices, stages, constants.pace.dt_max)
    # A runaway ends in infinities on its way to `DIVERGED`: that is an outcome, not a warning.
    with np.errstate(all="ignore"):
        history: list[tuple[float, ...]] = []
        status, remedy, collapsed = _run_to_rest(run, integrator, springs, constants, settings.max_steps, history)
        counters = _counters(run, springs, constants)
    counters["step_collapsed"] = float(collapsed)
    if status is Status.AT_REST:
        run.x[2] = 0.0
        counters["spring_energy"] = float(spring_energy(run.x, constants.physics))
    columns = dict(zip(HISTORY, np.array(history).T, strict=True))
    return Flattened(run.x.T.reshape(vertices.shape), status, remedy, counters, history=columns)


def _run_to_rest(
    run: Run,
    integrator: Scheme | Outside,
    springs: Springs,
    constants: Constants,
    max_steps: int,
    history: list[tuple[float, ...]],
) -> tuple[Status, str, bool]:
    """Advance window by window until an outcome is known; return it, its remedy, and whether the step collapsed."""
    physics, plane, pace = constants.physics, constants.plane, constants.pace
    weak = physics._replace(gravity=constants.weak_gravity)
    scale = 0.5 * float((physics.k_s * physics.rest**2).sum())  # energy of every spring at a strain of 1
    before, began, due = np.inf, 0.0, constants.window
    history.append(_state(run, physics))
    while True:
        pushing = weak if run.x[2].max() < plane.eps else physics
        n_steps = min(constants.stride, due - run.counts[STEPS], max_steps - run.counts[STEPS])
        if not advance_by(run, integrator, pushing, plane, pace, n_steps):
            return Status.LOCKED, _COLLAPSED.format(dt=run.clock[0], steps=run.counts[STEPS]), True
        history.append(_state(run, physics))
        _, _, energy, kinetic, _, _ = history[-1]
        if not energy < RUNAWAY_STRAIN**2 * scale:  # NaN included
            return Status.DIVERGED, _REMEDY[Status.DIVERGED], False
        spent = run.counts[STEPS] >= max_steps
        if run.counts[STEPS] < due and not spent:
            continue
        reference = max(energy, NEGLIGIBLE_STRAIN**2 * scale)
        # Two hundred tiny steps show no change either: the window must have lasted.
        still = run.clock[1] - began >= SHORTEST_WINDOW * constants.window * pace.dt_max
        still = still and abs(energy - before) <= ENERGY_CHANGE * reference and kinetic <= KINETIC_SHARE * reference
        before, began, due = energy, run.clock[1], due + constants.window
        if still or spent:
            return *_outcome(run, springs, plane, still), False


def advance_by(run: Run, integrator: Scheme | Outside, physics: System, plane: Plane, pace: Pace, n_steps: int) -> bool:
    """Advance by whichever loop the integrator has; see :func:`.integrators.advance`."""
    if isinstance(integrator, Outside):
        return advance_outside(run, integrator, physics, plane, pace, n_steps)
    return bool(advance(run, integrator, physics, plane, pace, n_steps))


def _state(run: Run, physics: System) -> tuple[float, ...]:
    """Return what the history holds, in its order."""
    kinetic = 0.5 * physics.mass * float((run.v**2).sum())
    potential = physics.mass * physics.gravity * float(run.x[2].sum())
    spring = float(spring_energy(run.x, physics))
    return float(run.clock[1]), float(run.counts[EVALUATIONS]), spring, kinetic, potential, float(run.x[2].max())


def _outcome(run: Run, springs: Springs, plane: Plane, still: bool) -> tuple[Status, str]:
    """Name what a sheet that moves no more, or ran out of steps, has come to."""
    z = float(run.x[2].max())
    folded = folded_quads(run.x[:2].T.reshape(*springs.grid, 2), springs.cut)
    if folded and (still or z < plane.eps):
        return Status.FOLDED, _REMEDY[Status.FOLDED].format(folded=folded)
    if not still and plane.literal and run.counts[REJECTED] > 0:
        return Status.LOCKED, _COLLAPSED.format(dt=run.clock[0], steps=run.counts[STEPS])
    if not still:
        return Status.LOCKED, _UNSETTLED.format(steps=run.counts[STEPS])
    if z >= plane.eps:
        return Status.LOCKED, _REMEDY[Status.LOCKED].format(z=z)
    return Status.AT_REST, ""


def _counters(run: Run, springs: Springs, constants: Constants) -> dict[str, float]:
    physics = constants.physics
    return {
        "steps": float(run.counts[STEPS]),
        "steps_rejected": float(run.counts[REJECTED]),
        "force_evaluations": float(run.counts[EVALUATIONS]),
        "contacts": float(run.counts[CONTACTS]),
        "folded_quads": float(folded_quads(run.x[:2].T.reshape(*springs.grid, 2), springs.cut)),
        "spring_energy": float(spring_energy(run.x, physics)),
        "kinetic_energy": 0.5 * physics.mass * float((run.v**2).sum()),
        "height_max_mm": float(run.x[2].max()),
        "dt": constants.pace.dt_max,
        "dt_smallest": float(run.clock[2]),
        "penetration_mm": 0.0 - float(run.lowest[0]),
        "time": float(run.clock[1]),
        "k_d": physics.beta * springs.k_max,
        "gravity": physics.gravity,
        "weak_gravity": constants.weak_gravity,
        "drag": physics.drag,
    }

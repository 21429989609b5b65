"""Problems for integrators that have a known answer: a sheet thrown into the air, and balls that bounce."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from data_synth import surfaces
from deskew.flattening.contact import NOWHERE, Plane
from deskew.flattening.dynamics import advance_by
from deskew.flattening.forces import System, accelerate, scratch, spring_energy, system
from deskew.flattening.integrators import STEPS, Pace, Run, start
from deskew.flattening.outside import Outside
from deskew.flattening.schemes import INTEGRATORS, Scheme
from deskew.flattening.settings import SpringSettings
from deskew.flattening.springs import grid_springs
from deskew.flattening.stability import stiffest_mode
from deskew.types import Floats, Sheet

Integrator = Scheme | Outside
# An embedded pair that is to take every step as it comes.
_ANY_ERROR = 1e300
_GRID, _SIDE_MM, _SLOPE_P90_DEG = 21, 216.0, 20.0
_MASS_KG = 2.4e-6
_PUSH = 0.05  # weight of a vertex over k_s times a spring's length
# Throw of a vertex: standard deviation of its velocity, as a share of what crosses a spring's length in 1 / omega.
_THROW = 0.02


@dataclass(frozen=True, slots=True)
class Flight:
    """Particles under way, with what acts on them.

    Attributes
    ----------
    x, v : (3, V) arrays
        Positions [mm] and velocities [mm/s] at the beginning.
    physics : System
        Springs, damping, gravity, drag.
    plane : Plane
        What they may hit.
    unit_s : float
        2 / omega of the stiffest mode, the longest step that an undamped leapfrog may make [s]; of particles without
        springs one second.
    """

    x: Floats
    v: Floats
    physics: System
    plane: Plane = NOWHERE
    unit_s: float = 1.0


def thrown_sheet(rng: np.random.Generator, damping_ratio: float, k_s: float = 1.0) -> Flight:
    """Return a crumpled sheet in the air, every vertex with a velocity of its own, under all forces."""
    grid = surfaces.mirror(rng, (_GRID, _GRID), (_SIDE_MM, _SIDE_MM), _SLOPE_P90_DEG)
    springs = grid_springs(Sheet(grid.vertices), SpringSettings(k_s))
    x = np.ascontiguousarray(grid.vertices.reshape(-1, 3).T)
    drag = float(np.sqrt(k_s * _MASS_KG)) / _GRID
    physics = system(springs, beta=0.0, mass=_MASS_KG, gravity=_PUSH * k_s * springs.rest_mean / _MASS_KG, drag=drag)
    omega = float(np.sqrt(stiffest_mode(x, physics)))
    v = rng.normal(0.0, _THROW * springs.rest_mean * omega, x.shape)
    return Flight(x, v, physics._replace(beta=2 * damping_ratio / omega), unit_s=2 / omega)


def free(flight: Flight) -> Flight:
    """Return a flight without damping, drag and gravity: its energy is kept."""
    return Flight(flight.x, flight.v, flight.physics._replace(beta=0.0, drag=0.0, gravity=0.0), unit_s=flight.unit_s)


def trembling(flight: Flight, rng: np.random.Generator) -> Flight:
    """Return a flight's sheet all but at rest, without gravity: what grows then, the integrator has made."""
    x = flight.x + rng.normal(0.0, 1e-6, flight.x.shape)
    return Flight(x, np.zeros_like(x), flight.physics._replace(gravity=0.0), unit_s=flight.unit_s)


def bouncing_balls(n: int = 64, gravity: float = 10.0, k_r: float = 0.5) -> Flight:
    """Return balls without springs, dropped from 1 to 1.5 mm: each bounces once before `BOUNCE_S`."""
    x = np.stack([np.zeros(n), np.zeros(n), np.linspace(1.0, 1.5, n)])
    none = np.zeros((4, n))
    return Flight(x, np.zeros_like(x), System(none, none, n, 0.0, 1.0, gravity, 0.0), Plane(1e-12, k_r, False))


BOUNCE_S = 0.85


def bounced(flight: Flight, duration: float = BOUNCE_S) -> Floats:
    """Return the heights of bouncing balls at `duration` [s] in closed form, (V,) [mm]."""
    gravity, k_r = flight.physics.gravity, flight.plane.k_r
    landing = np.sqrt(2 * flight.x[2] / gravity)
    after = duration - landing
    return np.asarray(k_r * gravity * landing * after - gravity * after**2 / 2)


def fly(flight: Flight, integrator: Integrator, duration: float, n_steps: int) -> Run:
    """Fly for `duration` [s] in equal steps."""
    dt = duration / n_steps
    run = _begun(flight, integrator, dt)
    advance_by(run, integrator, flight.physics, flight.plane, Pace(dt, dt, _ANY_ERROR), n_steps)
    return run


def fly_within(flight: Flight, scheme: Scheme, duration: float, tolerance_mm: float) -> Run:
    """Fly for `duration` [s] by an embedded pair that chooses its steps."""
    run = _begun(flight, scheme, 0.1 * flight.unit_s)
    pace = Pace(duration, 1e-9 * duration, tolerance_mm)
    while duration - run.clock[1] > 1e-12 * duration:
        run.clock[0] = min(run.clock[0], duration - run.clock[1])
        advance_by(run, scheme, flight.physics, flight.plane, pace, 1)
    return run


def _begun(flight: Flight, integrator: Integrator, dt: float) -> Run:
    run = start(flight.x.T, integrator if isinstance(integrator, Scheme) else INTEGRATORS["euler"], dt)
    run.v[:] = flight.v
    return run


def reference(flight: Flight, duration: float) -> tuple[Floats, float]:
    """Fly by scipy's DOP853, a method that is not under test.

    Returns
    -------
    x : (3, V) array
        Positions at the end, at a tolerance of 1e-13 [mm].
    floor : float
        RMS distance to those at a hundred times the tolerance [mm]: below it errors mean nothing.
    """
    fine, coarse = (_by_dop853(flight, duration, tolerance) for tolerance in (1e-13, 1e-11))
    return fine, rms_distance(fine, coarse)


def _by_dop853(flight: Flight, duration: float, tolerance: float) -> Floats:
    work, out = scratch(), np.empty_like(flight.x)

    def derivative(_: float, y: Floats) -> Floats:
        x, v = y.reshape(2, *out.shape)
        accelerate(x, v, flight.physics, work, out)
        return np.concatenate([v.ravel(), out.ravel()])

    y = np.concatenate([flight.x.ravel(), flight.v.ravel()])
    found = solve_ivp(derivative, (0.0, duration), y, "DOP853", t_eval=[duration], rtol=tolerance, atol=tolerance)
    return np.asarray(found.y[:, -1].reshape(2, *out.shape)[0])


def rms_distance(a: Floats, b: Floats) -> float:
    """Root mean square over the particles of the distance between two (3, V) arrays [mm]."""
    return float(np.sqrt(((a - b) ** 2).sum(axis=0).mean()))


def energy_drift(flight: Flight, integrator: Integrator, dt: float, n_steps: int, n_looks: int = 50) -> float:
    """Largest change of all energy over that at the beginning, of a `free` flight in equal steps; infinite if lost."""
    run = _begun(flight, integrator, dt)

    def total() -> float:
        return float(spring_energy(run.x, flight.physics) + 0.5 * flight.physics.mass * (run.v**2).sum())

    before, worst = total(), 0.0
    with np.errstate(all="ignore"):
        for _ in range(n_looks):
            advance_by(run, integrator, flight.physics, NOWHERE, Pace(dt, dt, _ANY_ERROR), n_steps // n_looks)
            change = abs(total() / before - 1.0)
            if not np.isfinite(change):
                return float(np.inf)
            worst = max(worst, change)
    return worst


def growth(flight: Flight, integrator: Integrator, dt: float, n_steps: int) -> float:
    """Spring energy after `n_steps` equal steps over that at the beginning; infinite where it overflowed."""
    run = _begun(flight, integrator, dt)
    before = float(spring_energy(run.x, flight.physics))
    with np.errstate(all="ignore"):
        advance_by(run, integrator, flight.physics, NOWHERE, Pace(dt, dt, _ANY_ERROR), n_steps)
        after = float(spring_energy(run.x, flight.physics)) / before
    assert run.counts[STEPS] == n_steps
    return after if np.isfinite(after) else float(np.inf)

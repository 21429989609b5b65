"""What integrators do on problems with a known answer: order, energy, longest stable step."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial
from statistics import median

import numpy as np

from deskew import flattening
from deskew.errors import StepError
from deskew.flattening.integrators import EVALUATIONS, REJECTED, STEPS, Run
from deskew.flattening.schemes import Scheme
from deskew.flattening.stability import largest_stable_step
from experiments.studies.flights import (
    BOUNCE_S,
    Flight,
    Integrator,
    bounced,
    bouncing_balls,
    energy_drift,
    fly,
    fly_within,
    free,
    growth,
    reference,
    rms_distance,
    thrown_sheet,
    trembling,
)
from experiments.trials import Recorder

# Steps of the flight, in units of 2 / omega, and how many of these it lasts. Explicit Euler may take half of one.
FLIGHT_STEPS = tuple(2.0**-k for k in range(1, 9))
FLIGHT_UNITS = 16.0
FLIGHT_DAMPING = 0.5
TOLERANCES_MM = tuple(10.0**-k for k in range(0, 9))
BOUNCE_STEPS = (200, 400, 800, 1600, 3200)
DRIFT_STEPS = (0.4, 0.2, 0.1)
_N_TIMED, _N_FITTED = 3, 4
_DRIFT_UNITS, _EXPLODED = 400.0, 1000.0
# An error this far above the reference's own is the integrator's; one above this share of the way is of no small step.
_ABOVE_FLOOR, _SMALL = 100.0, 1e-2
_N_GROWTH, _N_BISECTIONS, _LONGEST = 1500, 12, 4.0


def fitted_order(dt: Sequence[float], errors: Sequence[float]) -> float:
    """Slope of log error over log step by least squares."""
    return float(np.polyfit(np.log(dt), np.log(errors), 1)[0])


def measure_free_flight(record: Recorder, rng: np.random.Generator, methods: Sequence[str]) -> None:
    """Fly one sheet by each integrator in ever smaller steps; find the order where steps are small."""
    flight = thrown_sheet(rng, FLIGHT_DAMPING)
    duration = FLIGHT_UNITS * flight.unit_s
    exact, floor = reference(flight, duration)
    way = rms_distance(flight.x, exact)
    record.add("free_flight", "-", {"reference_floor_mm": floor, "way_mm": way})
    for method in methods:
        with record.attempt("free_flight", method):
            integrator = flattening.find_integrator(method)
            fits = []
            for step in FLIGHT_STEPS:
                error = _flown(record, f"free_flight/dt={step:.6f}", method, flight, integrator, step, exact)
                if max(_ABOVE_FLOOR * floor, 1e-11) < error < _SMALL * way:
                    fits.append((step, error))
            if isinstance(integrator, Scheme) and integrator.estimate:
                _fly_adaptively(record, method, flight, integrator, exact)
            if len(fits) < _N_FITTED:
                raise StepError(f"No order: only {len(fits)} steps gave small errors above the reference's floor.")
            order = fitted_order(*zip(*fits[-_N_FITTED:], strict=True))
            record.add("free_flight", method, {"order": order} | _theory(integrator))


def _theory(integrator: Integrator) -> dict[str, float]:
    return {"order_theory": float(integrator.order)} if isinstance(integrator, Scheme) else {}


def _flown(
    record: Recorder, condition: str, method: str, flight: Flight, integrator: Integrator, step: float, exact: object
) -> float:
    duration, n_steps = FLIGHT_UNITS * flight.unit_s, round(FLIGHT_UNITS / step)
    run = timed(record, condition, method, lambda: fly(flight, integrator, duration, n_steps))
    error = rms_distance(run.x, np.asarray(exact))
    if np.isfinite(error) and error < 1e6:
        record.add(condition, method, {"error_mm": error} | counted(run))
    else:
        record.fail(condition, method, "the sheet tore apart: the step is beyond the stable one")
    return error if np.isfinite(error) else float(np.inf)


def _fly_adaptively(record: Recorder, method: str, flight: Flight, scheme: Scheme, exact: object) -> None:
    duration = FLIGHT_UNITS * flight.unit_s
    for tolerance in TOLERANCES_MM:
        condition = f"free_flight/tolerance={tolerance:.0e}"
        run = timed(record, condition, method, partial(fly_within, flight, scheme, duration, tolerance))
        record.add(condition, method, {"error_mm": rms_distance(run.x, np.asarray(exact))} | counted(run))


def timed(record: Recorder, condition: str, method: str, flown: Callable[[], Run]) -> Run:
    """Fly a few times and record the median of the seconds; what compiles or waits is the first time's affair."""
    seconds = []
    for _ in range(_N_TIMED):
        start = time.perf_counter()
        run = flown()
        seconds.append(time.perf_counter() - start)
    record.add_times(condition, method, {"seconds_fly": median(seconds)})
    return run


def counted(run: Run) -> dict[str, float]:
    """Return what a run has cost."""
    names = {"steps": STEPS, "steps_rejected": REJECTED, "force_evaluations": EVALUATIONS}
    return {name: float(run.counts[place]) for name, place in names.items()}


def measure_bounce(record: Recorder, methods: Sequence[str]) -> None:
    """Let balls bounce by each integrator; contact leaves no order above 1."""
    balls = bouncing_balls()
    exact = bounced(balls)
    for method in methods:
        with record.attempt("contact/bounce", method):
            integrator = flattening.find_integrator(method)
            errors = []
            for n in BOUNCE_STEPS:
                run = fly(balls, integrator, BOUNCE_S, n)
                errors.append(float(np.sqrt(np.mean((run.x[2] - exact) ** 2))))
                record.add(f"contact/bounce/steps={n:04d}", method, {"error_mm": errors[-1]} | counted(run))
            order = fitted_order([BOUNCE_S / n for n in BOUNCE_STEPS], errors)
            record.add("contact/bounce", method, {"order": order})


def measure_drift(record: Recorder, rng: np.random.Generator, methods: Sequence[str]) -> None:
    """Fly without damping and see how far the energy drifts that should be kept."""
    flight = free(thrown_sheet(rng, 0.0))
    for method in methods:
        integrator = flattening.find_integrator(method)
        for step in DRIFT_STEPS:
            condition = f"energy/dt={step:g}"
            drift = energy_drift(flight, integrator, step * flight.unit_s, round(_DRIFT_UNITS / step))
            if drift < _EXPLODED:
                record.add(condition, method, {"energy_drift": drift})
            else:
                record.fail(condition, method, f"the energy grew more than {_EXPLODED:g} times")


def measure_stable_step(
    record: Recorder, condition: str, rng: np.random.Generator, methods: Sequence[str], damping_ratio: float, k_s: float
) -> None:
    """Bisect for the longest step at which nothing grows, beside what linear theory says."""
    seed = int(rng.integers(1 << 62))
    flight = thrown_sheet(np.random.default_rng(seed), damping_ratio, k_s)
    still, physics = trembling(flight, rng), flight.physics
    for method in methods:
        with record.attempt(condition, method):
            integrator = flattening.find_integrator(method)
            omega = 2 / flight.unit_s
            theory = largest_stable_step(integrator, omega**2, physics.beta, physics.drag / physics.mass)
            if not np.isfinite(theory):
                unlimited = growth(still, integrator, 100 * _LONGEST * flight.unit_s, 100) < 1.0
                record.add(condition, method, {"unlimited": float(unlimited)})
                continue
            found = _bisected(still, integrator)
            record.add(
                condition,
                method,
                {
                    "stable_dt": found / flight.unit_s,
                    "stable_dt_theory": theory / flight.unit_s,
                    "stable_dt_ratio": found / theory,
                    "stable_dt_s": found,
                    "stable_dt_theory_s": theory,
                },
            )


def _bisected(still: Flight, integrator: Integrator) -> float:
    """Longest step [s] that does not grow, between 0 and `_LONGEST` units; the theory is not asked."""
    low, high = 0.0, _LONGEST * still.unit_s
    for _ in range(_N_BISECTIONS):
        middle = (low + high) / 2
        low, high = (middle, high) if growth(still, integrator, middle, _N_GROWTH) < 1.0 else (low, middle)
    return low

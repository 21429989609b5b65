"""Crumpled sheets brought to rest by each integrator: what it costs, where it ends, and which pushes end flat."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

import data_synth
from deskew import flattening, metrics
from deskew.errors import StepError
from deskew.types import Flattened, Floats, Sheet, Status
from experiments.trials import Recorder

# A sheet has the residual that all are compared at when its energy is within this share of the least, and it lies flat.
RESIDUAL = 1e-2
_STRIDE, _FLAT_MM = 20, 0.05
_COUNTERS = ("steps", "steps_rejected", "force_evaluations", "contacts", "folded_quads")
_SHORTEST, _STEEPEST = 15.0, 40.0
_GOLDEN = (5**0.5 - 1) / 2


@dataclass(frozen=True, slots=True)
class Page:
    """A sheet to flatten, with what is known of its end.

    Attributes
    ----------
    sheet : Sheet
        45 x 45 samples of a crumpled page.
    flat : (R, C, 2) array
        Its true places on the flat page, X = u and Y = -v [mm].
    rest : (R, C, 3) array
        Where the same springs have the least energy, by statics [mm].
    energy : float
        That energy [uJ] at k_s = 1.
    slope_p90_deg, relief_mm : float
        How crumpled it is.
    """

    sheet: Sheet
    flat: Floats
    rest: Floats
    energy: float
    slope_p90_deg: float
    relief_mm: float


def crumpled_page(rng: np.random.Generator, shape: tuple[int, int], slope_p90_deg: float) -> Page:
    """Draw a page and find its rest by the static solver, which is not under test.

    Raises
    ------
    StepError
        If that solver does not come to rest either.
    """
    sheet = data_synth.crumpled(rng, slope_p90_deg=slope_p90_deg)
    rows, columns = (
        np.rint(np.linspace(0, n - 1, m)).astype(int) for n, m in zip(sheet.flat.shape, shape, strict=False)
    )
    grid = Sheet(np.ascontiguousarray(sheet.vertices[np.ix_(rows, columns)]))
    rest = flattening.flatten(grid, method="spring", rest="chord")
    if rest.status is not Status.AT_REST:
        raise StepError(f"The static solver ended {rest.status}: {rest.remedy}")
    flat = sheet.flat[np.ix_(rows, columns)] * [1.0, -1.0]  # v runs against the world's Y
    energy = rest.counters["spring_energy"]
    return Page(grid, flat, rest.vertices, energy, sheet.slope_p90_deg, sheet.relief_mm)


def rigid_mean(places: Floats, others: Floats) -> float:
    """Mean distance in the plane of two grids (R, C, 2 or 3) after a rotation and a translation [mm]."""
    a, b = (grid[..., :2].reshape(-1, 2) for grid in (places, others))
    return float(np.linalg.norm(metrics.fit_rigid(a, b).apply(a) - b, axis=1).mean())


def spread_slope(trial: int) -> float:
    """Severity of a sheet of a trial [deg], spread from gentle to steep however many trials there are.

    Multiples of the golden ratio fill an interval evenly (Weyl), so that a run which grows keeps its first sheets.
    """
    return _SHORTEST + (_STEEPEST - _SHORTEST) * ((trial + 0.5) * _GOLDEN % 1.0)


def measure_flattening(record: Recorder, condition: str, page: Page, method: str, **settings: object) -> None:
    """Flatten by one integrator and record its cost, its distance to the static rest and the cost of the residual."""
    with record.attempt(condition, method):
        looked_at = _settle(page, method, {**settings, "stride": _STRIDE})
        start = time.perf_counter()
        result = _settle(page, method, settings)  # compiled by now
        seconds = time.perf_counter() - start
        record.add(condition, method, _figures(page, result) | {"at_rest": float(result.status is Status.AT_REST)})
        record.add_times(condition, method, {"seconds_flatten": seconds})
        reached = evaluations_to_residual(page, looked_at, float(str(settings.get("k_s", 1.0))))
        if reached is not None:
            share = reached / result.counters["force_evaluations"]
            record.add(condition, method, {"evaluations_to_residual": reached})
            record.add_times(condition, method, {"seconds_to_residual": seconds * share})


def _settle(page: Page, method: str, settings: Mapping[str, object]) -> Flattened:
    return flattening.flatten(page.sheet, method="particles", integrator=method, **settings)


def _figures(page: Page, result: Flattened) -> dict[str, float]:
    figures = {name: result.counters[name] for name in _COUNTERS}
    if result.status is not Status.DIVERGED:
        figures["error_mm"] = rigid_mean(result.vertices, page.rest)
    return figures


def evaluations_to_residual(page: Page, result: Flattened, k_s: float) -> float | None:
    """Force evaluations until the sheet lies flat with an energy within `RESIDUAL` of the least; None if never."""
    history = result.history
    energy = history["spring_energy_uj"] + history["kinetic_energy_uj"]
    there = (history["height_max_mm"] < _FLAT_MM) & (energy <= (1 + RESIDUAL) * k_s * page.energy)
    # It must stay there: what only passes through on its way does not count.
    since = len(there) - int(np.argmin(there[::-1])) if not there.all() else 0
    return float(history["force_evaluations"][since]) if there[-1] else None


def map_outcomes(record: Recorder, page: Page, pushes: Sequence[float], methods: Sequence[str]) -> None:
    """Flatten one page at every push: flat, locked, folded or diverged."""
    for push in pushes:
        condition = f"outcomes/push={push:g}"
        record.add(condition, "-", {"slope_p90_deg": page.slope_p90_deg, "relief_mm": page.relief_mm})
        for method in methods:
            with record.attempt(condition, method):
                result = flattening.flatten(page.sheet, method="particles", integrator=method, push=push)
                ends = {Status.AT_REST: "flat", Status.LOCKED: "locked", Status.FOLDED: "folded"}
                ended = ends.get(result.status, "diverged")
                record.add(condition, method, {name: float(name == ended) for name in (*ends.values(), "diverged")})
                record.add(condition, method, _figures(page, result))

"""How a run of the particle system ends, and where it would end if nothing but its energy were looked at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deskew.flattening.dynamics import ENERGY_CHANGE
from deskew.types import Flattened, Status

ENDS = ("flat", "folded", "locked", "unfinished", "diverged")
"""Every run ends as one of these."""

STOPS = ("stop_flat", "stop_folded", "stop_locked_less", "stop_locked_more", "stop_never")
"""Where energy alone would have stopped a run: on a page that lies flat, on a folded one, on one that hangs above the
plane with less energy in its springs than the flat page, or with more; or nowhere."""

FLAT_MM = 0.05


def ending(result: Flattened, max_steps: int) -> str:
    """Return which of `ENDS` a run came to; one whose steps ran out is unfinished, wherever it hangs."""
    ended = {Status.AT_REST: "flat", Status.FOLDED: "folded", Status.DIVERGED: "diverged"}.get(result.status)
    if ended is not None:
        return ended
    spent = result.counters["steps"] >= max_steps or result.counters["step_collapsed"] > 0
    return "unfinished" if spent else "locked"


@dataclass(frozen=True, slots=True)
class EnergyStop:
    """The first look at which the spring energy had stopped changing.

    Attributes
    ----------
    kind : str
        One of `STOPS`.
    energy_ratio : float or None
        Spring energy there over the least that the page can have lying flat; None where it never stopped.
    """

    kind: str
    energy_ratio: float | None


def energy_stop(result: Flattened, flat_energy: float) -> EnergyStop:
    """Stop a run at the paper's word: when the internal energy is minimised after collision (section 3.4).

    The sheet touches the plane from the start, and is looked at every 200 steps; the energy counts as minimised when it
    changed by less than 1e-5 of itself from one look to the next.

    Parameters
    ----------
    result : Flattened
        A run with the history of its regular looks.
    flat_energy : float
        Least spring energy of the page in the plane [uJ].
    """
    energy = result.history["spring_energy_uj"]
    with np.errstate(invalid="ignore"):
        still = np.abs(np.diff(energy)) <= ENERGY_CHANGE * energy[1:]
    still &= np.isfinite(energy[1:])  # what ran away is at no rest
    if not still.any():
        return EnergyStop("stop_never", None)
    place = 1 + int(np.argmax(still))
    ratio = float(energy[place]) / flat_energy
    if result.counters["folded_quads"] > 0:
        return EnergyStop("stop_folded", ratio)
    if result.history["height_max_mm"][place] < FLAT_MM:
        return EnergyStop("stop_flat", ratio)
    return EnergyStop("stop_locked_less" if ratio < 1.0 else "stop_locked_more", ratio)

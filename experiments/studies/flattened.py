"""What the tables say of a flattening: how it ended, what it cost, and how much it stretched the sheet."""

from __future__ import annotations

from deskew import metrics
from deskew.types import Flattened, Sheet, Status

_COUNTED = ("steps", "steps_rejected", "force_evaluations", "contacts")


def flattening_figures(sheet: Sheet, flattened: Flattened) -> dict[str, float]:
    """Return `at_rest` (0 or 1), what the method counted, and `strain_rms`, `flips`, `folded_quads` of the result."""
    figures = {"at_rest": float(flattened.status is Status.AT_REST)}
    figures |= {name: flattened.counters[name] for name in _COUNTED if name in flattened.counters}
    strain = metrics.sheet_strain(sheet, flattened)
    return figures | {name: strain[name] for name in ("strain_rms", "flips", "folded_quads")}

"""Which way a figure gets worse, and by how little it must do so before it counts.

Figures that say nothing of quality (steps, seconds, how bent a sheet is) have no direction and are not judged; those
that tell which page it is must not change at all.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase

LARGER: Callable[[float], float] = float
"""How bad a value is if more of it is worse."""


def SMALLER(value: float) -> float:  # noqa: N802 - a constant that happens to be a function, as LARGER and FARTHER
    """Return how bad a value is if less of it is worse."""
    return -value


FARTHER: Callable[[float], float] = abs
"""How bad a signed value is if it should be 0."""


@dataclass(frozen=True, slots=True)
class Direction:
    """How a metric is judged.

    Attributes
    ----------
    badness : callable
        `LARGER`, `SMALLER` or `FARTHER`: from a value to how bad it is, in the metric's unit.
    least : float
        Worsening of the mean that is no regression yet, in the metric's unit; across machines and Pythons, which round
        differently, no less happens.
    one_page : bool
        Counts instead: no regression yet is one more in all the pages together.
    """

    badness: Callable[[float], float]
    least: float = 0.0
    one_page: bool = False

    def slack(self, n_pages: int) -> float:
        """Return the worsening of the mean over the pages that is no regression yet."""
        return 1.0 / n_pages if self.one_page else self.least


_PIXELS, _MILLIMETRES, _SHARE = 0.002, 0.001, 0.001
_COUNT = Direction(LARGER, one_page=True)
_UNITS = {"px": _PIXELS, "mm": _MILLIMETRES, "units": _MILLIMETRES, "deg": 0.01}

# The first pattern that fits decides.
_TABLE: tuple[tuple[str, Callable[[float], float]], ...] = (
    # Lengths that should be 0, and may lie on either side of it.
    ("depth*_bias_mm", FARTHER),
    ("probing_size_mm", FARTHER),
    ("sphere_spacing_error_mm", FARTHER),
    # Distances from the truth.
    ("corner_*", LARGER),
    ("dense_*", LARGER),
    ("flat_*", LARGER),
    ("flatness_mm", LARGER),
    ("depth_*_mm", LARGER),
    ("plane_*", LARGER),
    ("length_error*", LARGER),
    ("probing_form_mm", LARGER),
    ("calib_*_rms_*", LARGER),
    ("detector_rms_px", LARGER),
    ("picture_to_map_rms_mm", LARGER),
    ("registration_error_px", LARGER),
    ("error_mm", LARGER),
    ("kept_*_mm", LARGER),
    ("changed_*_mm", LARGER),
    # Pictures against the control, after the field's habit.
    ("ms_ssim_*", SMALLER),
    ("ld_*", LARGER),
    ("ad_*", LARGER),
    ("lid_*", LARGER),
    ("line_straightness_px", LARGER),
    ("line_spread_deg", LARGER),
    # Shares.
    ("page_coverage", SMALLER),
    ("depth_coverage", SMALLER),
    ("word_recall", SMALLER),
    ("word_precision", SMALLER),
    ("area_error", LARGER),
)
_COUNTED = ("corners_missing", "misses*", "flips", "folds", "folded_quads")
# What tells one page from another: other values mean other pages.
_IDENTITY = ("corners_expected", "letters", "words", "vertices", "slope_p90_deg", "relief_mm", "tilt_deg")
# Under these conditions a picture is as it is: nothing has been restored yet, or the truth itself has been spoilt.
_AS_IT_IS, _OF_THE_SCAN = ("unrestored", "null", "fault", "real"), ("depth_*", "calib_*")


def direction_of(condition: str, metric: str) -> Direction | None:
    """Return how a metric is judged under a condition; None if it is not."""
    as_it_is = condition.partition("/")[0] in _AS_IT_IS
    if as_it_is and not any(fnmatchcase(metric, pattern) for pattern in _OF_THE_SCAN):
        return None
    if condition.startswith("fault/"):
        return None
    if metric == "at_rest":
        # Not one page may stop coming to rest.
        return Direction(SMALLER)
    if any(fnmatchcase(metric, pattern) for pattern in _COUNTED):
        return _COUNT
    for pattern, badness in _TABLE:
        if fnmatchcase(metric, pattern):
            return Direction(badness, _UNITS.get(metric.rpartition("_")[2], _SHARE))
    return None


def is_identity(metric: str) -> bool:
    """Say whether a metric tells one page from another."""
    return metric in _IDENTITY


def directions() -> Mapping[str, Direction]:
    """Return every pattern that is judged, for whoever documents or tests them."""
    found = {pattern: Direction(badness) for pattern, badness in _TABLE}
    return found | dict.fromkeys(_COUNTED, _COUNT) | {"at_rest": Direction(SMALLER)}

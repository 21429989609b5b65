"""What somebody who runs the experiments again should get: the claims to check, and how far a rerun may be off."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from deskew.errors import require
from experiments.reporting.claims.claim import BEST, EULER
from experiments.reporting.claims.measures import Values
from experiments.reporting.statistics import LEVEL, Interval


@dataclass(frozen=True, slots=True)
class Expectation:
    """One figure to check.

    Attributes
    ----------
    claim : str
        What it shows, for somebody who never saw the code.
    values : Values
        Whose mean is expected.
    digits : int
        Decimals shown.
    """

    claim: str
    values: Values
    digits: int = 3


def rerun_interval(values: Sequence[float]) -> Interval | None:
    """Return where the mean of as many new trials, of another seed, lies in 95 cases of 100.

    That is wider than the interval of the mean, by the scatter of the new trials: ``mean +- t s sqrt(2 / n)``. It takes
    means for normally distributed: of the 50 pages of Experiment I, 5, 10 or 25 drawn at random foretell the mean of as
    many others in 92 to 96 of 100 draws. Values none of which is negative have no negative mean.

    Parameters
    ----------
    values : sequence of float
        One a trial, at least one.

    Returns
    -------
    (low, high) or None
        In the values' unit; None of one trial, which has no scatter.

    References
    ----------
    G. J. Hahn, W. Q. Meeker, "Statistical Intervals", 1991, section 4.7: prediction of a future mean.
    """
    require(len(values) > 0, "values", "hold at least one number", "none")
    n, data = len(values), np.asarray(values, dtype=np.float64)
    if n < 2:
        return None
    reach = stats.t.ppf((1 + LEVEL) / 2, n - 1) * data.std(ddof=1) * math.sqrt(2 / n)
    low, high = float(data.mean() - reach), float(data.mean() + reach)
    return (max(low, 0.0) if data.min() >= 0 else low), high


_CORNERS, _CRUMPLES, _OCR, _PLANE = "corner_distance", "corner_distance_physical", "ocr_misses", "plane_accuracy"
_PARTS, _NULL = "stiffness", "null_controls"

EXPECTED: tuple[Expectation, ...] = (
    Expectation("Corners of the flat page are found this exactly", Values(_CORNERS, "control", "detector_rms_px")),
    Expectation("Corners of a bent page before restoration", Values(_CORNERS, "unrestored", "corner_mean_px")),
    Expectation("Corners restored by the paper's method", Values(_CORNERS, "restored", "corner_mean_px", EULER)),
    Expectation("The same, rigidly aligned", Values(_CORNERS, "restored", "corner_rigid_mean_mm", EULER)),
    Expectation("Corners restored by the best method", Values(_CORNERS, "restored", "corner_mean_px", BEST)),
    Expectation("The same, rigidly aligned", Values(_CORNERS, "restored", "corner_rigid_mean_mm", BEST)),
    Expectation("Every pixel restored by the best method", Values(_CORNERS, "restored", "dense_mean_mm", BEST)),
    Expectation("Crumples: corners, the paper's method", Values(_CRUMPLES, "restored", "corner_mean_px", EULER)),
    Expectation("Crumples: corners, the best method", Values(_CRUMPLES, "restored", "corner_mean_px", BEST)),
    Expectation("Letters missed on the flat page", Values(_OCR, "control", "misses"), 2),
    Expectation("Letters missed on a bent page", Values(_OCR, "unrestored", "misses"), 2),
    Expectation("Letters missed, restored by the paper's method", Values(_OCR, "restored", "misses", EULER), 2),
    Expectation("Letters missed, restored by the best method", Values(_OCR, "restored", "misses", BEST), 2),
    Expectation("Letters missed, warped back by the true shape", Values(_OCR, "ideal", "misses"), 2),
    Expectation("Blank plane: mean deviation, as the paper measures", Values(_PLANE, "white", "plane_mean_abs_mm")),
    Expectation("Printed plane: mean deviation", Values(_PLANE, "checkered", "plane_mean_abs_mm")),
    Expectation("The same measure, baseline 1 % wrong", Values(_PLANE, "fault/baseline", "plane_mean_abs_mm")),
    Expectation("Lengths of 300 mm, baseline 1 % wrong", Values(_PLANE, "fault/baseline", "length_error_mm")),
    Expectation(
        "Line sweep of 1792 frames: depth", Values("decoders", "checkered/line_sweep/1792", "depth_raw_rms_mm")
    ),
    Expectation("160 fringes: depth", Values("decoders", "checkered/gray_phase/160", "depth_raw_rms_mm")),
    Expectation(
        "Meshes with noise: the best method", Values("surfaces_noisy", "flattened/mirror", "flat_rigid_mean_mm", BEST)
    ),
    Expectation("Meshes with noise: ARAP", Values("surfaces_noisy", "flattened/mirror", "flat_rigid_mean_mm", "arap")),
    Expectation(
        "Shrunken leaf: gain of the right stiffness",
        Values(_PARTS, "restored/A/vellum_over_paper=0.01", "kept_gain_over_wrong", BEST),
        1,
    ),
    Expectation(
        "Grown sleeve: gain of the right stiffness",
        Values(_PARTS, "restored/B/vellum_over_paper=100", "kept_gain_over_wrong", BEST),
        1,
    ),
    Expectation(
        "Nothing changed: gain of either stiffness",
        Values(_PARTS, "restored/N/vellum_over_paper=100", "kept_gain_over_wrong", BEST),
        1,
    ),
    Expectation(
        "Hidden writing under ultra-violet: share read", Values("textures", "restored/uv", "uv_text_read", BEST)
    ),
    Expectation("The same before restoration", Values("textures", "unrestored/uv", "uv_text_read")),
    Expectation("Real boards: camera residual", Values("real_boards", "left_out", "calib_camera_rms_px")),
    Expectation("Real boards: restored corners", Values("real_boards", "restored", "corner_rigid_mean_units", BEST)),
    Expectation("Null: a page 1 % too long, rigidly aligned", Values(_NULL, "null/stretched", "corner_rigid_mean_mm")),
    Expectation("Null: letters missed in random order", Values(_NULL, "null/shuffled", "misses"), 1),
)
"""In the order of the page."""

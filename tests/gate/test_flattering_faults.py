"""Faults that make figures better: no gate sees them, for a gate lets improvements pass. Closed forms do.

Each fault is planted, and the tests that state the metric's closed forms must then fail: they are two-sided, so that a
figure that is too good is as wrong as one that is too bad.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from deskew import metrics
from tests.gate.faults import FAULTS
from tests.metrics import test_corner_distance as corner_distance
from tests.metrics import test_misses as misses
from tests.metrics import test_score as score
from tests.metrics import test_stretch as stretch

Conformance = Callable[[], None]


def lost_corners_are_counted() -> None:
    restored, control = corner_distance.corners(), corner_distance.corners()
    restored[::10] = np.nan
    figures = metrics.corner_distance(restored, control, corner_distance.CAMERA)
    assert (figures["corners_missing"], figures["corners_expected"]) == (30.0, 300.0)


@pytest.mark.parametrize(
    ("fault", "conformance"),
    [
        ("free_substitutions", misses.test_the_papers_count_leaves_deletions_out),
        ("free_substitutions", misses.test_of_equally_short_alignments_the_one_with_most_substitutions_counts),
        ("unsigned_areas", lambda: stretch.test_a_triangle_flipped_or_gone_is_never_perfect("beyond")),
        ("unsigned_areas", score.test_a_vertex_pulled_across_its_neighbours_is_a_flip),
        ("uncounted_lost_corners", lost_corners_are_counted),
    ],
)
def test_a_flattering_fault_breaks_a_closed_form(fault: str, conformance: Conformance) -> None:
    conformance()
    with FAULTS[fault](), pytest.raises(AssertionError):
        conformance()

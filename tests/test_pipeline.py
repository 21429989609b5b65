"""What the pipeline adds to a scan before it is flattened."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from deskew import pipeline
from deskew.acquisition import DenoiseSettings, InkSettings, SweepSettings, settings_for_ink
from deskew.errors import InputError
from deskew.io import StiffnessMap
from deskew.recipes import BEST, PAPER, Recipe, recipe_for
from deskew.types import DepthMap, PatternKind, Pinhole, Scan, Sheet


@pytest.fixture
def scan() -> Scan:
    """A flat page of two quads by three, seen from above: 10 pixels a millimetre, the middle at (12.5, 8.5)."""
    K = np.array([[10.0, 0, 12.5], [0, 10, 8.5], [0, 0, 1]])
    camera = Pinhole((26, 18), K, np.zeros(5), np.diag([1.0, -1, -1]), np.array([0, 0, 1.0]))
    x, y = np.meshgrid([-0.9, -0.3, 0.3, 0.9], [0.6, 0.0, -0.6])
    depth = DepthMap(np.ones((18, 26)), np.zeros((18, 26), np.uint8), camera)
    white = np.zeros((18, 26), np.uint8)
    return Scan({"white": white}, depth, camera, Sheet(np.stack([x, y, 0 * x], axis=-1)), np.zeros((4, 2)))


def test_a_scans_quads_have_the_material_that_is_seen_at_their_middles(scan: Scan) -> None:
    """Middles lie at x = 6.5, 12.5, 18.5 and y = 5.5, 11.5: the border of two materials runs between them."""
    labels = np.full((18, 26), 7, np.uint8)
    labels[9:, 10:] = 200
    found = pipeline.with_stiffness(scan, StiffnessMap(labels, {7: 0.5, 200: 20.0}))
    assert found.sheet.stiffness is not None
    assert found.sheet.stiffness.tolist() == [[0.5, 0.5, 0.5], [0.5, 20.0, 20.0]]
    assert found.sheet.vertices.tobytes() == scan.sheet.vertices.tobytes()


def test_a_map_of_another_size_is_refused(scan: Scan) -> None:
    small = StiffnessMap(np.zeros((2, 3), np.uint8), {0: 1.0})
    wanted = r"`stiffness map` must have the white image's size \(26, 18\), got \(3, 2\)"
    with pytest.raises(InputError, match=wanted):
        pipeline.with_stiffness(scan, small)


def test_only_the_papers_methods_are_scanned_as_the_paper_scans() -> None:
    assert {name: recipe_for(name) for name in ("paper_euler", "paper_rk4", "spring", "arap", "own:press")} == {
        "paper_euler": PAPER,
        "paper_rk4": PAPER,
        "spring": BEST,
        "arap": BEST,
        "own:press": BEST,
    }
    with pytest.raises(InputError, match="`mode` must be spatial or temporal, got 'both'"):
        Recipe("both", ink=False, denoise=False)


@pytest.mark.parametrize("pattern", list(PatternKind))
def test_a_recipe_decides_how_a_pattern_is_decoded(pattern: PatternKind) -> None:
    best, paper = pipeline.decoder_for(BEST, pattern), pipeline.decoder_for(PAPER, pattern)
    if pattern is PatternKind.LINE_SWEEP:
        assert (best, paper) == (SweepSettings(mode="temporal"), SweepSettings(mode="spatial"))
    else:
        assert (best, paper) == (settings_for_ink(pattern), None)


@pytest.mark.parametrize(("recipe", "used"), [(BEST, True), (PAPER, False)])
def test_a_recipe_decides_what_is_taken_out_of_a_scan(
    monkeypatch: pytest.MonkeyPatch, recipe: Recipe, used: bool
) -> None:
    asked: dict[str, Any] = {}
    monkeypatch.setattr(pipeline, "scan", lambda capture, calibration, **settings: asked.update(settings))
    pipeline.scan_by(recipe, SimpleNamespace(pattern=PatternKind.LINE_SWEEP), None)  # type: ignore[arg-type]
    assert (asked["ink"], asked["denoise"]) == ((InkSettings(), DenoiseSettings()) if used else (None, None))

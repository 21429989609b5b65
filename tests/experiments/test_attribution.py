"""Every step between the paper's method and the best one, switched singly."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

import data_synth
from data_synth import PAGE_SIZE_MM, Checkerboard
from deskew import pipeline
from deskew.errors import StepError
from deskew.recipes import BEST, PAPER
from deskew.types import Calibration, Capture
from experiments.settings import Config
from experiments.studies.attribution import Attribution, _recipe, _restored
from experiments.studies.attribution_layout import END, LAYOUT, PATH, START, STEPS, variants
from experiments.studies.bench import Bench, configured_rig
from experiments.studies.page_scans import PageScans
from experiments.trials import Recorder, TrialKey

EVERY, NONE = frozenset(STEPS), frozenset[str]()
ENDS = ("paper_euler", "spring")
CONFIG = Config("attribution", trials=1, method=list(ENDS))


@dataclass(frozen=True)
class Page:
    bench: Bench
    capture: Capture


@pytest.fixture(scope="module")
def page() -> Page:
    """A page through the rig's true calibration."""
    rig = configured_rig(CONFIG.rig)
    rng = np.random.default_rng(21)
    sheet = data_synth.crumpled(rng, PAGE_SIZE_MM, 20.0)
    capture, _ = data_synth.render(rig, sheet, Checkerboard(), rng)
    known = Calibration(rig.camera, rig.projector, {}, camera_psf_px=rig.config.camera_psf_sigma_px)
    return Page(Bench(rig, known), capture)


def test_each_variant_is_one_step_from_an_end_or_on_the_path() -> None:
    found = {condition: switched for switched, conditions in variants().items() for condition in conditions}
    assert (found[START], found[END]) == (NONE, EVERY)
    for step in STEPS:
        assert found[f"alone/{step}"] == {step}
        assert found[f"without/{step}"] == EVERY - {step}
    before = NONE
    for step, condition in zip(STEPS, PATH, strict=True):
        assert found[condition] == before | {step}
        before = found[condition]
    # What coincides is computed once: both ends of the path, its first step and its last but one.
    assert len(found) - len(variants()) == 3


def test_the_layout_names_no_condition_that_is_not_run() -> None:
    run = {condition for conditions in variants().values() for condition in conditions}
    for changes in LAYOUT.changes:
        assert {name for pair in changes.pairs for name in pair} <= run
    for ladder in LAYOUT.ladders:
        assert {condition for _, condition in ladder.rungs} <= run
        assert all(len(pairs) == len(STEPS) for _, pairs in ladder.worth)


def test_the_ends_are_the_methods_themselves(page: Page, monkeypatch: pytest.MonkeyPatch) -> None:
    assert (_recipe(NONE), _recipe(EVERY)) == (PAPER, BEST)
    modes = []
    decode = pipeline.decode

    def counted(capture: Capture, settings: Any = None) -> Any:
        modes.append(settings.mode)
        return decode(capture, settings)

    monkeypatch.setattr(pipeline, "decode", counted)
    scans = PageScans(Recorder(TrialKey("attribution")), page.capture, page.bench.calibration)
    scan = scans.by(BEST, (45, 45))
    assert scans.by(BEST, (45, 45)) is scan
    fine = scans.by(BEST, (60, 60))
    assert modes == ["temporal"]
    plain = pipeline.scan_by(BEST, page.capture, page.bench.calibration, shape=(60, 60))
    assert np.array_equal(fine.depth.z, plain.depth.z, equal_nan=True)
    assert np.array_equal(fine.sheet.vertices, plain.sheet.vertices)
    for switched, method in zip((NONE, EVERY), ENDS, strict=True):
        ours, own = _restored(scan, switched, ENDS), pipeline.restore(scan, method=method)
        assert np.array_equal(ours.backward_map, own.backward_map, equal_nan=True)
        assert np.array_equal(ours.image, own.image)


def test_a_page_that_cannot_be_scanned_has_failed_under_every_variant(
    page: Page, monkeypatch: pytest.MonkeyPatch
) -> None:
    def dark(*_: object, **__: object) -> None:
        raise StepError("too dark")

    monkeypatch.setattr(pipeline, "decode", dark)
    outcome = Attribution().run(CONFIG, page.bench, TrialKey("attribution", seed=5))
    failed = {row.condition for row in outcome.rows if row.metric == "failed"}
    names = {name for names in variants().values() for name in names}
    assert failed == names | {f"{name}/saddle" for name in names}
    assert {failure.reason for failure in outcome.failures} == {"too dark"}
    measured = {row.condition for row in outcome.rows} - failed
    assert measured == {"control", "control/saddle", "unrestored", "unrestored/saddle"}

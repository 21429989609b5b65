"""One thing is changed at a time, on the same pages."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from deskew import projection
from deskew.errors import StepError
from deskew.types import Calibration
from experiments.settings import BudgetSettings, Config, SensitivitySettings
from experiments.studies.bench import Bench, configured_rig
from experiments.studies.faults import longer_baseline, longer_focal_length, turned_projector
from experiments.studies.page_scans import PageScans
from experiments.studies.sensitivity import Sensitivity
from experiments.trials import TrialKey

CHANGED = SensitivitySettings([10.0, 30.0], [2.0], [23], [0.05], [], [0.5])
CONFIG = Config("sensitivity", trials=2, sensitivity=CHANGED, method=["paper_euler", "spring"])


def bench(noise_scale: float = 1.0) -> Bench:
    rig = configured_rig(replace(CONFIG.rig, noise_scale=noise_scale))
    return Bench(rig, Calibration(rig.camera, rig.projector, {}))


def test_what_needs_captures_of_its_own_has_trials_of_its_own() -> None:
    keys = Sensitivity().plan(CONFIG)
    conditions = ["-", "slope_p90_deg=10", "slope_p90_deg=30", "noise_scale=2"]
    assert [(key.condition, key.trial) for key in keys] == [(name, i) for name in conditions for i in (0, 1)]
    smoke = replace(CONFIG, budget=BudgetSettings("smoke"))
    assert {key.condition for key in Sensitivity().plan(smoke)} == {"-", "slope_p90_deg=10", "noise_scale=2"}


@pytest.mark.parametrize(
    ("key", "restored"),
    [
        ("slope_p90_deg=30", {("/slope_p90_deg=30", "both")}),
        ("noise_scale=2", {("/noise_scale=2", "both"), ("/denoise={}/noise_scale=2", "each its own")}),
        (
            "-",
            {
                ("", "both"),
                ("/denoise={}", "each its own"),
                ("/rest={}", "each its own"),
                ("/mesh=23", "both"),
                ("/rest={}/mesh=23", "each its own"),
                ("/projector_yaw_deg=0.05", "both"),
                ("/focal_percent=0.5", "both"),
            },
        ),
    ],
)
def test_a_trial_restores_all_that_its_captures_serve(
    key: str, restored: set[tuple[str, str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    def dark(*_: object) -> None:
        raise StepError("too dark")

    monkeypatch.setattr(PageScans, "by", dark)
    shared = {1.0: bench(), 2.0: bench(2.0)}
    outcome = Sensitivity().run(CONFIG, shared, TrialKey("sensitivity", key, seed=4))
    switched = {
        "paper_euler": {"/denoise={}": "true", "/rest={}": "section"},
        "spring": {"/denoise={}": "false", "/rest={}": "chord"},
    }
    expected = set()
    for suffix, _ in restored:
        for method, values in switched.items():
            value = next((value for start, value in values.items() if suffix.startswith(start)), "")
            expected.add((f"restored{suffix.format(value)}", method))
    assert {(failure.condition, failure.method) for failure in outcome.failures} == expected
    # Where a curve has its points across.
    across = {(row.condition, row.metric): row.value for row in outcome.rows if row.method == "-"}
    if key == "-":
        assert across["unrestored", "mesh"] == 45
        assert across["unrestored/mesh=23", "mesh"] == 23
        assert across["unrestored/focal_percent=0.5", "focal_percent"] == 0.5
    else:
        name, _, value = key.partition("=")
        assert across[f"unrestored/{key}", name] == pytest.approx(float(value), abs=0.5)


def test_faults_are_as_large_as_asked_for() -> None:
    true = bench().calibration
    length = np.linalg.norm(projection.centre(true.projector) - projection.centre(true.camera))
    longer = longer_baseline(true, 0.5)
    assert np.linalg.norm(projection.centre(longer.projector) - projection.centre(true.camera)) == pytest.approx(
        1.005 * length
    )
    focal = longer_focal_length(true, -0.25).camera.K
    assert focal[0, 0] == pytest.approx(0.9975 * true.camera.K[0, 0])
    assert focal[0, 2] == true.camera.K[0, 2]
    turned = turned_projector(true, 0.02).projector
    assert np.allclose(projection.centre(turned), projection.centre(true.projector))
    angle = np.arccos((np.trace(turned.R @ true.projector.R.T) - 1) / 2)
    assert np.degrees(angle) == pytest.approx(0.02, rel=1e-6)

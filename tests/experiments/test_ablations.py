"""One property of the rig at a time, each on a rig calibrated anew."""

from __future__ import annotations

from dataclasses import replace

import pytest

from deskew.errors import StepError
from deskew.types import Calibration
from experiments.settings import AblationSettings, BudgetSettings, Config, ScanSettings
from experiments.studies import ablations
from experiments.studies.bench import Bench, configured_rig
from experiments.trials import TrialKey

NONE = AblationSettings([], [], [], [], [], [])


def config(**changes: list[float]) -> Config:
    settings = AblationSettings(**(vars(NONE) | changes))
    return Config("ablations", trials=2, ablations=settings, scan=ScanSettings(mode="temporal"))


def test_every_value_is_planned_beside_the_default_in_every_pose() -> None:
    keys = ablations.Ablations().plan(config(noise_scale=[0.5, 2.0], stripe_width_px=[3]))
    conditions = ["default", "noise_scale=0.5", "noise_scale=2", "stripe_width_px=3"]
    assert [(key.condition, key.trial) for key in keys] == [(name, trial) for name in conditions for trial in (0, 1)]
    assert [key.condition for key in ablations.Ablations().plan(config())] == ["default"] * 2
    smoke = replace(config(noise_scale=[0.5, 2.0]), budget=BudgetSettings("smoke"))
    assert {key.condition for key in ablations.Ablations().plan(smoke)} == {"default", "noise_scale=0.5"}


def test_one_key_is_changed_and_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[Config] = []

    def calibrated(changed: Config, mode: str, draw: int) -> Bench:
        seen.append(changed)
        assert (mode, draw) == ("temporal", 0)
        raise StepError("no board")

    monkeypatch.setattr(ablations, "calibrated_bench", calibrated)
    plain = config(baseline_mm=[213.0], gamma=[3.0])
    for condition in ("default", "baseline_mm=213", "gamma=3"):
        outcome = ablations.Ablations().run(plain, None, TrialKey("ablations", condition))
        assert [(row.condition, row.metric) for row in outcome.rows] == [(condition, "failed")]
    default, baseline, gamma = (vars(changed.rig) for changed in seen)
    assert default == vars(plain.rig)
    assert baseline == default | {"baseline_mm": 213.0}
    assert gamma == default | {"gamma": 3.0}


def test_settings_reach_the_rig() -> None:
    rig = configured_rig(config().rig)
    assert (rig.config.projector_gamma, rig.config.ambient, rig.config.stripe_width_px) == (2.2, 0.03, 1)
    changed = config().rig
    changed.camera_blur_px, changed.gamma, changed.ambient, changed.stripe_width_px = 1.2, 1.5, 0.2, 3
    found = configured_rig(changed).config
    assert (found.camera_psf_sigma_px, found.projector_gamma, found.ambient, found.stripe_width_px) == (
        1.2,
        1.5,
        0.2,
        3,
    )


def test_a_wide_stripe_is_scanned_on_every_body(monkeypatch: pytest.MonkeyPatch) -> None:
    def known(changed: Config, mode: str, draw: int) -> Bench:
        rig = configured_rig(changed.rig)
        residuals = {f"{name}_rms_px": 0.0 for name in ("camera", "projector")}
        return Bench(rig, Calibration(rig.camera, rig.projector, residuals))

    monkeypatch.setattr(ablations, "calibrated_bench", known)
    key = TrialKey("ablations", "stripe_width_px=3", seed=5)
    outcome = ablations.Ablations().run(config(stripe_width_px=[3]), None, key)
    assert not outcome.failures
    found = {row.metric: row.value for row in outcome.rows}
    assert found.keys() == {column.metric for column in ablations.Ablations.layout.columns}
    # Three lines at once: half of the single line's 0.016 mm, and the printed page is darker.
    assert 0.006 < found["bound_depth_mm"] < 0.012
    assert 0.95 < found["depth_rms_ratio"] < 5.0
    assert found["depth_raw_rms_mm"] < found["depth_printed_rms_mm"] < 0.3

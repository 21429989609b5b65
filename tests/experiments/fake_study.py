"""A study that costs nothing, for the tests of what surrounds studies."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path
from typing import Any

import numpy as np

from deskew.errors import StepError
from experiments.reporting import Column, Layout, Plot
from experiments.settings import Config
from experiments.studies import AbsentError, Study
from experiments.trials import Outcome, Recorder, TrialKey

# The sheet's slope is the one number that the tests can set freely: these values ask for trouble.
ABSENT, STEP_FAILS, TRIAL_1_FAILS, ALL_FAIL, TRIAL_1_KILLS, NAN, KILLED_ONCE, SLOW = map(float, range(1, 9))
SLOW_SECONDS = 0.02


class FakeStudy(Study):
    """Conditions: `control`, `restored`. Each trial leaves a line in the file that FAKE_LOG names."""

    layout = Layout(
        "Fake",
        "Random numbers.",
        (Column("corner_mean_px", "mean [px]", 2, {"restored": "< 0.5"}),),
        (Plot("corners", "corner_mean_px", "mean corner distance [px]", paper=0.5),),
    )

    def plan(self, config: Config) -> list[TrialKey]:
        if config.sheet.slope_p90_deg == ABSENT:
            raise AbsentError("no data")
        return Study.plan(self, config)

    def prepare(self, config: Config) -> float:
        if config.sheet.slope_p90_deg == STEP_FAILS:
            raise StepError("Calibration found no board.")
        _log("prepare")
        return 0.25

    def run(self, config: Config, shared: Any, key: TrialKey) -> Outcome:
        slope = config.sheet.slope_p90_deg
        if slope == ALL_FAIL or (slope == TRIAL_1_FAILS and key.trial == 1):
            raise ValueError("sheet | is\nsteep")
        if slope == TRIAL_1_KILLS and key.trial == 1:
            os.kill(os.getpid(), signal.SIGKILL)
        if slope == KILLED_ONCE and key.trial == 1 and not Path("killed").exists():
            Path("killed").touch()
            os.kill(os.getpid(), signal.SIGKILL)
        if slope == SLOW:
            time.sleep(SLOW_SECONDS)
        record = Recorder(key)
        rng = key.generator()
        with record.stage("render"):
            noise = rng.normal(size=(100, 100))
        record.add("control", "-", {"corner_mean_px": 0.1 + shared})
        for method in config.methods:
            with record.attempt("restored", method):
                value = float(np.abs(np.linalg.svd(noise, compute_uv=False)).mean()) if slope != NAN else np.nan
                record.add("restored", method, {"corner_mean_px": value / slope, "corners_missing": key.trial})
        record.picture(f"page_{key.trial}", np.full((4, 4), key.trial, np.uint8))
        _log(f"trial {key.trial}")
        return record.outcome()


def _log(line: str) -> None:
    if "FAKE_LOG" in os.environ:
        with Path(os.environ["FAKE_LOG"]).open("a") as file:
            file.write(line + "\n")

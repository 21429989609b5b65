"""A study that costs nothing, whose figures a test can make worse."""

from __future__ import annotations

from typing import Any

import numpy as np

from deskew.errors import StepError
from experiments.reporting import Column, Layout
from experiments.settings import Config
from experiments.studies import Study
from experiments.trials import Outcome, Recorder, TrialKey

# What the present code does to the mean corner distance [px]; a number of corners that it loses.
STATE = {"worse_px": 0.0, "lost": 0.0, "bend_deg": 20.0}


class GatedStudy(Study):
    """Conditions: `unrestored`, `restored`. Methods: `breaks`, `broken_calibration` and anything else."""

    layout = Layout("Gated", "Numbers.", (Column("corner_mean_px", "mean [px]", 2),))

    def prepare(self, config: Config) -> None:
        if "broken_calibration" in config.methods:
            raise StepError("Calibration found no board.")

    def run(self, config: Config, shared: Any, key: TrialKey) -> Outcome:
        record = Recorder(key)
        noise = np.random.default_rng([key.trial, config.rig.noise_draw]).normal(0.0, 0.001)
        record.add("unrestored", "-", {"slope_p90_deg": STATE["bend_deg"], "corner_mean_px": 2.0})
        for method in config.methods:
            with record.attempt("restored", method):
                if method == "breaks" and key.trial == 1:
                    raise StepError("The sheet tore.")
                mean = 0.1 + 0.01 * key.trial + noise + STATE["worse_px"]
                record.add("restored", method, {"corner_mean_px": mean, "corners_missing": STATE["lost"], "steps": 900})
        return record.outcome()

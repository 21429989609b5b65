"""What a study is: plan the trials, prepare what they share, run one, say how the table looks."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

from experiments.reporting import Layout
from experiments.settings import Config
from experiments.trials import Outcome, TrialKey, trial_keys


class AbsentError(Exception):
    """The data that a study needs is not here: nothing is run, nothing is written, and that is no error."""


class Study(ABC):
    """One experiment. Its class docstring lists its conditions.

    It holds no state: what the trials share is returned by `prepare` and handed to each, in whatever process.
    """

    layout: ClassVar[Layout]

    def plan(self, config: Config) -> list[TrialKey]:
        """Return the keys of all trials; refuse here, before anything is written, what the study cannot do.

        Raises
        ------
        InputError
            If a setting does not suit this study.
        AbsentError
            If the data that it needs is not here.
        """
        return trial_keys(config)

    def inputs(self, config: Config) -> Mapping[str, Path]:
        """Return the files and folders that the trials read, by dotted key; the config hash covers their content."""
        return {}

    def about(self, config: Config) -> Mapping[str, Any]:
        """Return what rows depend on besides settings and sources, such as another program, for `run.json`."""
        return {}

    def prepare(self, config: Config) -> Any:
        """Do once what all trials share, such as the calibration; the result is pickled to the workers."""
        return None

    @abstractmethod
    def run(self, config: Config, shared: Any, key: TrialKey) -> Outcome:
        """Run one trial; its randomness comes from ``key.generator()`` alone."""

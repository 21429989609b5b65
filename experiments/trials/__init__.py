"""Trials: what a row is, which trials a run plans, who carries them out and where finished ones are kept."""

from experiments.trials.engines import Engine, Processes, Serial, chosen_engine
from experiments.trials.plan import content_digest, fingerprint, settings_of, trial_keys
from experiments.trials.record import Outcome, Recorder, reason_of
from experiments.trials.schema import Failure, Row, TrialKey, unit_of
from experiments.trials.store import Store

__all__ = [
    "Engine",
    "Failure",
    "Outcome",
    "Processes",
    "Recorder",
    "Row",
    "Serial",
    "Store",
    "TrialKey",
    "chosen_engine",
    "content_digest",
    "fingerprint",
    "reason_of",
    "settings_of",
    "trial_keys",
    "unit_of",
]

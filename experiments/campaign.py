"""One run: plan, skip what is finished, prepare once, carry out, keep, report."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from tqdm import tqdm

from deskew.errors import InputError, StepError
from deskew.own.confinement import hidden
from experiments.reporting.export import Results, require_targets, write_report
from experiments.reporting.provenance import provenance
from experiments.settings import Config
from experiments.studies import Study, about_own, find_study
from experiments.trials import Engine, Outcome, Processes, Row, Serial, Store, TrialKey, fingerprint, settings_of
from experiments.trials.engines import one_thread

_REPORTS = Path(__file__).resolve().parents[1] / "reports"


@dataclass(frozen=True, slots=True)
class Finished:
    """What a run did."""

    out: Path
    n_planned: int
    n_run: int
    n_failed: int


def carry_out_campaign(config: Config, out: Path) -> Finished:
    """Run what is missing of an experiment and write its report.

    Parameters
    ----------
    config : Config
        The checked configuration.
    out : Path
        Folder of the store and the report.

    Raises
    ------
    InputError, StepError
        If a setting is wrong, the shared work fails, or not one trial succeeds.
    AbsentError
        If the study's data is not here.
    """
    if config.budget.name == "smoke" and out.resolve().is_relative_to(_REPORTS):
        raise InputError("`out` must lie outside reports/ when `budget` is smoke, got a folder in it.")
    study = find_study(config.experiment)
    keys = study.plan(config)
    require_targets(out, study.layout)
    own = about_own(config)
    about = {**study.about(config), **own}
    settings = settings_of(config, study.inputs(config))
    identity = fingerprint({**settings, **about})
    with Store(out, identity) as store:
        store.forget_lost()
        finished = store.finished()
        missing = [key for key in keys if key not in finished]
        if missing:
            # What the trials share is in this process too, and no method of somebody's is to read it there.
            with hidden() if own else nullcontext():
                _run_missing(study, config, missing, store)
        prepared = _prepare_key(config)
        results = Results(
            store.rows(keys), store.rows([*keys, prepared], "timing"), store.failures(keys), store.pictures(keys)
        )
    if results.rows and all(row.metric == "failed" for row in results.rows):
        raise StepError(f"{config.experiment}: no trial succeeded; the first says: {results.failures[0].reason}")
    write_report(out, study.layout, results, {**provenance(config.experiment, settings, identity), **about})
    return Finished(out, len(keys), len(missing), len({(f.trial, f.condition, f.method) for f in results.failures}))


def _run_missing(study: Study, config: Config, missing: Sequence[TrialKey], store: Store) -> None:
    start = time.perf_counter()
    with one_thread():
        shared = study.prepare(config)
    seconds = time.perf_counter() - start
    key = _prepare_key(config)
    store.record(key, Outcome((), (Row.of(key, key.condition, key.method, "seconds_prepare", seconds),)))
    engine: Engine = Serial() if config.engine.name == "serial" else Processes(config.engine.workers)
    finished = engine.run(partial(study.run, config, shared), missing)
    for done, outcome in tqdm(finished, config.experiment, len(missing), unit="trial", file=sys.stderr, disable=None):
        store.record(done, outcome)


def _prepare_key(config: Config) -> TrialKey:
    return TrialKey(config.experiment, "prepare", "-", 0, config.seed)

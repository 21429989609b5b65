"""One run: plan, skip what is finished, prepare once, carry out, keep, report."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import closing, nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from deskew.errors import InputError, StepError
from deskew.own.confinement import hidden
from experiments.progress import Progress
from experiments.reporting.export import Results, require_targets, write_report
from experiments.reporting.provenance import provenance
from experiments.settings import Config
from experiments.studies import Study, about_own, find_study
from experiments.trials import Engine, Outcome, Row, Store, TrialKey, chosen_engine, fingerprint, settings_of
from experiments.trials.threads import one_thread

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
        If a setting is wrong, the engine cannot be had, the shared work fails, or not one trial succeeds.
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
    engine = chosen_engine(config.engine, out, identity)
    with Store(out, identity) as store:
        store.forget_lost()
        finished = store.finished()
        missing = [key for key in keys if key not in finished]
        if missing:
            progress = Progress(config.experiment, len(keys) - len(missing), len(keys))
            # What the trials share is in this process too, and no method of somebody's is to read it there.
            with hidden() if own else nullcontext():
                _run(study, config, missing, engine, store, progress)
        prepared = _prepare_key(config)
        results = Results(
            store.rows(keys), store.rows([*keys, prepared], "timing"), store.failures(keys), store.pictures(keys)
        )
    if results.rows and all(row.metric == "failed" for row in results.rows):
        raise StepError(f"{config.experiment}: no trial succeeded; the first says: {results.failures[0].reason}")
    write_report(out, study.layout, results, {**provenance(config.experiment, settings, identity), **about})
    return Finished(out, len(keys), len(missing), len({(f.trial, f.condition, f.method) for f in results.failures}))


def _run(
    study: Study, config: Config, missing: Sequence[TrialKey], engine: Engine, store: Store, progress: Progress
) -> None:
    """Have an engine carry out the missing trials, and keep each as soon as it is there."""

    def prepare() -> Any:
        start = time.perf_counter()
        with one_thread():
            shared = study.prepare(config)
        key = _prepare_key(config)
        row = Row.of(key, key.condition, key.method, "seconds_prepare", time.perf_counter() - start)
        store.record(key, Outcome((), (row,)))
        progress.start()
        return shared

    # Closed at once, whatever happens: an engine ends its workers then.
    with closing(engine.run(missing, partial(study.run, config), prepare)) as outcomes, progress:
        for key, outcome in outcomes:
            store.record(key, outcome)
            progress.add(outcome)


def _prepare_key(config: Config) -> TrialKey:
    return TrialKey(config.experiment, "prepare", "-", 0, config.seed)

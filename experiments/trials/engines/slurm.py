"""SLURM jobs, submitted by submitit: a few jobs that each carry many trials."""

from __future__ import annotations

import hashlib
import logging
import os
import pickle
import shutil
import signal
import subprocess
import time
from collections import Counter
from collections.abc import Iterable, Sequence
from contextlib import redirect_stderr
from dataclasses import dataclass
from functools import partial
from io import StringIO
from pathlib import Path
from typing import Any

import submitit
from submitit.core.utils import FailedJobError

from deskew.errors import InputError, StepError, in_one_line, require
from deskew.io import write_bytes
from experiments.trials.engines.engine import WORKERS_A_TRIAL, Finished, Prepare, Run
from experiments.trials.engines.handed import handed_over, taken_over
from experiments.trials.record import carry_out, failed_outcome
from experiments.trials.schema import TrialKey
from experiments.trials.threads import ONE_THREAD, environment, n_cores, one_thread

# Jobs of one run, unless `workers` says how many: far below what clusters allow in an array.
_JOBS = 100
_LOOK_SECONDS = 0.2
# How often SLURM is asked what became of its jobs; what they finish shows at every look.
_ASK_SECONDS = 20.0
_ROOT = Path(__file__).resolve().parents[3]
_WORK = "work.pickle"


@dataclass(frozen=True, slots=True)
class _Job:
    """A job of submitit and the trials that it carries, one after another."""

    handle: Any
    keys: list[TrialKey]


@dataclass(frozen=True, slots=True)
class Slurm:
    """Jobs of a SLURM cluster, or processes of this machine in their place.

    A job leaves each outcome in the folder as soon as it is there, so what ends it costs the trial in hand alone; the
    rest of its trials goes into a new job. Outcomes that an interrupted run left there are taken over.

    Attributes
    ----------
    folder : Path
        For the files of the jobs, on a disk that all nodes share; removed when the run is complete.
    cluster : str
        `slurm`, or `local` for processes of this machine that submitit starts.
    partition : str or None
        Where SLURM runs the jobs; None for its own choice. sbatch reads all else from variables such as SBATCH_ACCOUNT.
    minutes : int
        After these SLURM may end a job; a trial must fit.
    workers : int or None
        Jobs at once, among which the trials are divided; None for up to 100, or for one a core if they are local.
    """

    folder: Path
    cluster: str = "slurm"
    partition: str | None = None
    minutes: int = 60
    workers: int | None = None

    def run(self, keys: Sequence[TrialKey], run: Run, prepare: Prepare) -> Finished:
        """Yield the trials as they finish; one that two jobs ended under is lost.

        Raises
        ------
        InputError
            If there is no SLURM here.
        StepError
            If SLURM refuses the jobs.
        """
        if self.cluster == "slurm":
            _require_slurm()
        work = pickle.dumps((run, prepare()))
        self.folder.mkdir(parents=True, exist_ok=True)
        write_bytes(work, self.folder / _WORK)
        waiting, jobs = dict.fromkeys(keys), list[_Job]()
        try:
            for key, outcome in self._outcomes(waiting, jobs):
                del waiting[key]
                yield key, outcome
        finally:
            self._end(jobs, cancel=bool(waiting))
            if not waiting or not self._names():
                shutil.rmtree(self.folder, ignore_errors=True)

    def _outcomes(self, waiting: dict[TrialKey, None], jobs: list[_Job]) -> Finished:
        """Yield what jobs leave behind until no trial is `waiting`; `jobs` holds those that have not ended."""
        yield from self._left(waiting)
        n_jobs = min(self.workers or (_JOBS if self.cluster == "slurm" else n_cores()), len(waiting))
        jobs += self._submit([list(waiting)[start::n_jobs] for start in range(n_jobs)])
        deaths, asked = Counter[TrialKey](), time.monotonic()
        while waiting:
            time.sleep(_LOOK_SECONDS)
            if force := time.monotonic() - asked > _ASK_SECONDS:
                asked = time.monotonic()
            # Before the folder is read: what has ended by now has left there all that it ever will.
            ended = _ended(jobs, force)
            yield from self._left(waiting)
            for job in ended:
                jobs.remove(job)
                for key, reason in _lost(job, waiting, deaths):
                    yield key, failed_outcome(key, reason, lost=True)
                jobs += self._submit([[key for key in job.keys if key in waiting]])

    def _left(self, waiting: dict[TrialKey, None]) -> Finished:
        """Yield the outcomes that lie in the folder."""
        names = self._names()
        for key in list(waiting):
            if _name(key) in names:
                yield key, taken_over(self.folder / _name(key))

    def _names(self) -> set[str]:
        return {path.name for path in self.folder.glob("*.outcome")}

    def _submit(self, batches: Iterable[list[TrialKey]]) -> list[_Job]:
        """Submit a job for each list of trials that is not empty, all of them as one array."""
        batches = [batch for batch in batches if batch]
        logging.getLogger("submitit").setLevel(logging.ERROR)
        executor = submitit.AutoExecutor(self.folder / "submitit", cluster=self.cluster)
        executor.update_parameters(name="deskew", timeout_min=self.minutes, cpus_per_task=1)
        if self.partition is not None:
            executor.update_parameters(slurm_partition=self.partition)
        path = os.pathsep.join(filter(None, (str(_ROOT), os.environ.get("PYTHONPATH"))))
        try:
            # What sbatch has to say is in the error, too.
            with environment({**ONE_THREAD, "PYTHONPATH": path}), redirect_stderr(StringIO()):
                handles = executor.map_array(partial(_carry_out_all, self.folder), batches) if batches else []
        except (FailedJobError, OSError) as error:
            raise StepError(f"SLURM refused the jobs: {in_one_line(error)}; finished trials are kept.") from error
        return [_Job(handle, batch) for handle, batch in zip(handles, batches, strict=True)]

    def _end(self, jobs: Sequence[_Job], cancel: bool) -> None:
        """See the jobs off; those that have handed over everything are about to end by themselves."""
        for job in jobs:
            if cancel and not job.handle.done():
                job.handle.cancel(check=False)
        deadline = time.monotonic() + _ASK_SECONDS
        # What SLURM does with a cancelled job is its own affair.
        while (self.cluster == "local" or not cancel) and _ended(jobs) != list(jobs) and time.monotonic() < deadline:
            time.sleep(_LOOK_SECONDS)


def _ended(jobs: Sequence[_Job], force: bool = False) -> list[_Job]:
    """Return the jobs that are over; `force` asks SLURM, once for all jobs."""
    return [job for i, job in enumerate(jobs) if job.handle.done(force_check=force and i == 0)]


def _lost(job: _Job, waiting: dict[TrialKey, None], deaths: Counter[TrialKey]) -> list[tuple[TrialKey, str]]:
    """Return the trials that are given up now that their job has ended, and why."""
    rest = [key for key in job.keys if key in waiting]
    if not rest:
        return []
    if job.handle.paths.result_pickle.exists():
        # Not killed: it broke outside of a trial, as where a node lacks a package, and would again.
        reason = f"Its job broke: {in_one_line(job.handle.exception())}"
        return [(key, reason) for key in rest]
    deaths[rest[0]] += 1
    reason = f"Its job ended before it did ({job.handle.state})."
    return [(rest[0], reason)] if deaths[rest[0]] == WORKERS_A_TRIAL else []


def _name(key: TrialKey) -> str:
    return f"{hashlib.sha256(repr(key).encode()).hexdigest()[:24]}.outcome"


def _carry_out_all(folder: Path, keys: Sequence[TrialKey]) -> None:
    """Carry trials out in a job, and leave each outcome in `folder`."""
    # Shortly before a job's time is over submitit would raise an error here, which a trial would take for its own.
    signal.signal(getattr(signal, f"SIG{submitit.JobEnvironment.USR_SIG}"), signal.SIG_DFL)
    run, shared = pickle.loads((folder / _WORK).read_bytes())
    with one_thread():
        for key in keys:
            # A job of an interrupted run may still be at work here.
            if not (folder / _name(key)).exists():
                write_bytes(handed_over(carry_out(partial(run, shared), key)), folder / _name(key))


def _require_slurm() -> None:
    name, allowed = "engine.cluster", "be local, or slurm where sbatch is and sacct tells what became of a job"
    try:
        asked = subprocess.run(("sacct", "--noheader"), capture_output=True, text=True, timeout=20, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise InputError(f"`{name}` must {allowed}, got slurm: {in_one_line(error)}.") from error
    problem = "no sbatch" if shutil.which("sbatch") is None else asked.stderr.strip().rpartition("\n")[2]
    require(shutil.which("sbatch") is not None and asked.returncode == 0, name, allowed, f"slurm: {problem}")

"""The Hydra program: compose, check, run; every error ends in one line and its exit code."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

import hydra
from hydra._internal.utils import get_args_parser
from hydra.core.config_store import ConfigStore
from hydra.core.hydra_config import HydraConfig
from hydra.errors import HydraException
from hydra.types import RunMode
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from deskew.errors import DeskewError, InputError, StepError
from experiments.campaign import carry_out_campaign
from experiments.complaints import one_line, refuse_arguments
from experiments.composed import CONF
from experiments.settings import Config
from experiments.studies import STUDIES, AbsentError


def main(arguments: Sequence[str]) -> int:
    """Run `python -m experiments ARGUMENTS`.

    Returns
    -------
    int
        0 if it ran, 2 for wrong input, 3 if a step failed, 130 if it was interrupted; the worst of a multirun.
    """
    codes, crashes = [0], list[Exception]()
    ConfigStore.instance().store("schema", Config)

    def task(config: DictConfig) -> None:
        try:
            codes.append(_run_job(config, arguments))
        except Exception as error:
            crashes.append(error)
            raise

    try:
        with _hydra_raises(arguments):
            hydra.main(config_path=str(CONF), config_name="config", version_base="1.3")(task)()
    except (HydraException, OmegaConfBaseException, ValueError, KeyError, OSError) as error:
        # Hydra raises plain errors too for what it cannot use; a job's own are faults of this program.
        if error in crashes:
            raise
        return _complain(error, arguments)
    except KeyboardInterrupt:
        print("Interrupted; finished trials are kept, and the same command goes on from there.", file=sys.stderr)
        return 130
    return max(codes)


def _run_job(composed: DictConfig, arguments: Sequence[str]) -> int:
    try:
        config, out = _checked(composed)
        finished = carry_out_campaign(config, out)
    except AbsentError as absence:
        print(f"{composed.experiment}: absent: {absence}")
        return 0
    except (OmegaConfBaseException, DeskewError) as error:
        return _complain(error, arguments)
    except (OSError, MemoryError) as error:
        reason = str(error) or "there is not enough memory; choose fewer engine.workers"
        return _complain(StepError(f"{composed.experiment}: the system refused: {reason}."), arguments)
    failed = f", {finished.n_failed} failed (see {finished.out / 'run.json'})" if finished.n_failed else ""
    print(f"{config.experiment}: {finished.n_planned} trials, {finished.n_run} run now{failed} -> {finished.out}")
    return 0


def _complain(error: Exception, arguments: Sequence[str]) -> int:
    print(one_line(error, arguments), file=sys.stderr)
    return error.exit_code if isinstance(error, DeskewError) else InputError.exit_code


def _checked(composed: DictConfig) -> tuple[Config, Path]:
    """Turn the composed configuration into checked objects and say where the run writes."""
    job = HydraConfig.get()
    # As they were given: a reference that leads nowhere is complained of by its own key.
    overrides: Any = OmegaConf.to_container(job.overrides.task, resolve=False)
    for override in overrides:
        if override.startswith(("+", "~")):
            name = override.lstrip("+~").split("=")[0]
            raise InputError(f"`{name}` must be an existing key that is given as {name}=VALUE, got {override}.")
    if OmegaConf.is_missing(composed, "experiment"):
        raise InputError(f"`experiment` must be one of {', '.join(sorted(STUDIES))}, got nothing.")
    config = OmegaConf.to_object(composed)
    assert isinstance(config, Config)
    out = Path(config.out or f"out/{config.budget.name}/{config.experiment}")
    if job.mode == RunMode.MULTIRUN:
        out = Path(job.runtime.output_dir)
    return config, out


class _Parser(argparse.ArgumentParser):
    """Hydra's parser, which would print its usage and exit."""

    def error(self, message: str) -> NoReturn:
        raise InputError(f"The arguments must be KEY=VALUE or Hydra's own options (see --hydra-help), got: {message}.")


@contextmanager
def _hydra_raises(arguments: Sequence[str]) -> Iterator[None]:
    """Let Hydra read `arguments`, and raise its errors instead of printing them in many lines and exiting with 1."""
    before, full_error = sys.argv, os.environ.get("HYDRA_FULL_ERROR")
    sys.argv = ["experiments", *arguments]
    os.environ["HYDRA_FULL_ERROR"] = "1"
    try:
        refuse_arguments(_Parser(parents=[get_args_parser()], add_help=False).parse_args(list(arguments)), CONF)
        yield
    finally:
        sys.argv = before
        if full_error is None:
            del os.environ["HYDRA_FULL_ERROR"]
        else:
            os.environ["HYDRA_FULL_ERROR"] = full_error

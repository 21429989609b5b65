"""Who carries trials out: this process, a pool of processes, a Ray cluster or SLURM jobs.

Ray and submitit are extras, and imported only where they are asked for.
"""

from __future__ import annotations

import hashlib
from importlib import import_module
from pathlib import Path
from typing import Any

from deskew.errors import InputError
from experiments.settings import EngineSettings
from experiments.trials.engines.engine import Engine
from experiments.trials.engines.processes import Processes
from experiments.trials.engines.serial import Serial


def chosen_engine(settings: EngineSettings, out: Path, fingerprint: str) -> Engine:
    """Return the engine that the settings name.

    Parameters
    ----------
    settings : EngineSettings
        The group `engine` of the configuration.
    out : Path
        Where the run writes.
    fingerprint : str
        What its rows are computed from: outcomes that jobs left on disk are taken over by the same run alone.

    Raises
    ------
    InputError
        If the engine's package is not installed.
    """
    match settings.name:
        case "serial":
            return Serial()
        case "ray":
            engine: Engine = _extra("ray", "ray").Ray(settings.address, settings.workers)
            return engine
        case "slurm":
            run = hashlib.sha256(f"{out.resolve()}\0{fingerprint}".encode()).hexdigest()[:12]
            folder = Path(settings.folder or out).resolve() / f"jobs-{run}"
            jobs: Engine = _extra("slurm", "submitit").Slurm(
                folder, settings.cluster, settings.partition, settings.minutes, settings.workers
            )
            return jobs
        case _:
            return Processes(settings.workers)


def _extra(name: str, package: str) -> Any:
    """Import the module of an engine whose package may be missing."""
    try:
        return import_module(f"experiments.trials.engines.{name}")
    except ModuleNotFoundError as error:
        if error.name != package:
            raise
        raise InputError(
            f"`engine` must be one that is installed, got {name} without {package}: pip install 'deskew3d[{name}]'."
        ) from error


__all__ = ["Engine", "Processes", "Serial", "chosen_engine"]

"""What produced a result: commit, settings, versions and the machine, without any name of a host or a folder."""

from __future__ import annotations

import os
import platform
import subprocess
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

_DISTRIBUTIONS = ("deskew3d", "numpy", "scipy", "opencv-python-headless", "numba", "pandas", "matplotlib", "hydra-core")
_ROOT = Path(__file__).resolve().parents[2]


def provenance(experiment: str, settings: Mapping[str, Any], fingerprint: str) -> dict[str, Any]:
    """Return what `run.json` says besides the failures.

    Parameters
    ----------
    experiment : str
        Name of the study.
    settings : mapping
        The settings that rows depend on.
    fingerprint : str
        SHA-256 of those and of the sources.
    """
    return {
        "experiment": experiment,
        "commit": _git("rev-parse", "HEAD") or "unknown",
        "commit_date": _git("show", "--no-patch", "--format=%cs", "HEAD") or "unknown",
        "changed_since_commit": bool(_git("status", "--porcelain", "--", "*.py", "*.yaml")),
        "config": dict(settings),
        "config_hash": fingerprint,
        "versions": {"python": platform.python_version()} | {name: version(name) for name in _DISTRIBUTIONS},
        "machine": _machine(),
    }


def _git(*arguments: str) -> str:
    try:
        done = subprocess.run(("git", *arguments), cwd=_ROOT, capture_output=True, text=True, timeout=20, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""


def _machine() -> dict[str, Any]:
    facts: dict[str, Any] = {"system": platform.system(), "architecture": platform.machine(), "cores": os.cpu_count()}
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        facts["processor"] = next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
        kilobytes = Path("/proc/meminfo").read_text().split("MemTotal:")[1].split()[0]
        facts["memory_gb"] = round(int(kilobytes) / 1e6, 1)
    except (OSError, IndexError, StopIteration):
        facts["processor"] = platform.processor()
    return facts

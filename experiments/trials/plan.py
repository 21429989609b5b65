"""Which trials a run plans, and the fingerprint that decides whether an old row answers the same question."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from experiments.settings import Config
from experiments.trials.schema import TrialKey

# What decides where and how much is computed, and never the value of a row. `trials` may grow: old rows stay good.
# What is ablated stands in the trial's own key.
_NO_PART_OF_A_ROW = ("engine", "out", "calibrations", "budget", "trials", "trials_at", "ablations")
# Keys that belong to one experiment only.
_SECTIONS = {
    "real_boards": "real_boards",
    "stiffness": "stiffness",
    "surfaces": "surfaces",
    "ocr": "ocr_misses",
    "sensitivity": "sensitivity",
    "integrators": "integrators",
    "settling": "settling",
    "culling": "culling",
}
# Sources that rows come from; reporting, the program around it and who carries trials out change no row.
SOURCES = (
    "deskew",
    "data_synth",
    "experiments/studies",
    *(f"experiments/trials/{name}.py" for name in ("record", "schema", "threads")),
    "requirements.lock",
)
_ROOT = Path(__file__).resolve().parents[2]


def trial_keys(config: Config, condition: str = "-", method: str = "-") -> list[TrialKey]:
    """Return one key a trial: 0 .. `trials` - 1 under the run's seed."""
    return [TrialKey(config.experiment, condition, method, trial, config.seed) for trial in range(config.trials)]


def settings_of(config: Config, inputs: Mapping[str, Path]) -> dict[str, Any]:
    """Return the settings that a row depends on, each input file or folder named by its SHA-256 instead of its path.

    Parameters
    ----------
    config : Config
        The run's configuration.
    inputs : mapping of dotted key to path
        The files and folders that the study reads.
    """
    settings = {name: value for name, value in asdict(config).items() if name not in _NO_PART_OF_A_ROW}
    for section, experiment in _SECTIONS.items():
        if experiment != config.experiment:
            settings.pop(section)
    settings["method"] = config.methods
    for key, path in inputs.items():
        settings[f"sha256 of {key}"] = content_digest(sorted(path.rglob("*")) if path.is_dir() else [path], path)
    # The kinds of surfaces and further severities, as what is ablated, stand in the trial's own key.
    for group, key in (
        ("real_boards", "path"),
        ("sheet", "paths"),
        ("stiffness", "materials"),
        ("surfaces", "paths"),
        ("surfaces", "kinds"),
        ("ocr", "real_path"),
        ("ocr", "severities"),
        ("sensitivity", "slope_p90_deg"),
        ("sensitivity", "noise_scale"),
    ):
        settings.get(group, {}).pop(key, None)
    return settings


def fingerprint(settings: Mapping[str, Any]) -> str:
    """Return the SHA-256 of the settings and of the sources that compute a row."""
    files = [path for source in SOURCES for path in _python_files(_ROOT / source)]
    text = json.dumps(settings, sort_keys=True) + content_digest(files, _ROOT)
    return hashlib.sha256(text.encode()).hexdigest()


def _python_files(source: Path) -> list[Path]:
    return sorted(source.rglob("*.py")) if source.is_dir() else [source]


def content_digest(files: Iterable[Path], root: Path) -> str:
    """Return the SHA-256 of files, of their names under `root` and their content; what is no file is passed over."""
    total = hashlib.sha256()
    for path in files:
        if path.is_file():
            total.update(f"{path.relative_to(root)}\0".encode())
            total.update(hashlib.sha256(path.read_bytes()).digest())
    return total.hexdigest()

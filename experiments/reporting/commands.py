"""The command that makes a report again, read off its `run.json`: what differs from the experiment's own defaults."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from experiments.composed import composed
from experiments.trials.plan import settings_of

_GIVEN = "sha256 of "


def command(run: Mapping[str, Any], trials: int, out: str) -> str:
    """Return the shortest command line that gives a run's settings.

    Parameters
    ----------
    run : mapping
        A `run.json`: `experiment` and the settings that rows depend on, `config`. Settings that are newer than the run
        have their defaults.
    trials : int
        Of the run.
    out : str
        Folder to write to.
    """
    found, experiment = run["config"], run["experiment"]
    keys = {"seed": found["seed"], "trials": trials}
    keys |= dict(_changed(found, settings_of(composed([f"experiment={experiment}"]), {})))
    given = [name.removeprefix(_GIVEN) for name in found if name.startswith(_GIVEN)]
    parts = [f"experiment={experiment}", *(_assigned(key, value) for key, value in keys.items())]
    return " ".join(["python -m experiments", *parts, *(f"{key}=FOLDER" for key in given), f"out={out}"])


def _changed(found: Mapping[str, Any], defaults: Mapping[str, Any], group: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the dotted keys that both have, with the found value, where they differ."""
    for name, value in found.items():
        key = f"{group}{name}"
        if name not in defaults or key == "seed":
            continue
        if isinstance(value, Mapping):
            yield from _changed(value, defaults[name], f"{key}.")
        elif value != defaults[name]:
            yield key, value


def _assigned(key: str, value: Any) -> str:
    """Return `key=value` for a shell; brackets would be taken for a pattern."""
    text = f"{key}={_text(value)}"
    return f"'{text}'" if isinstance(value, list) else text


def _text(value: Any) -> str:
    """Return a value as Hydra reads it."""
    if isinstance(value, list):
        return f"[{','.join(_text(item) for item in value)}]"
    return "null" if value is None else str(value).lower() if isinstance(value, bool) else str(value)

"""The baseline's own trials, run again by the present code."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from deskew.errors import InputError, StepError, require
from experiments.gate.baseline import Arguments, Baseline, read_rows
from experiments.gate.verdict import Failed, Reasons
from experiments.program import main as run_experiment
from experiments.trials import Row

# Settings in which a rerun may differ from its baseline: whose method, and which draw of the noise.
_FREE = ("method", "rig.noise_draw")


@dataclass(frozen=True, slots=True)
class Rerun:
    """What a rerun, or a stored one, gave.

    Attributes
    ----------
    rows : tuple of Row
        Sorted.
    settings : tuple of mappings
        Of each run that says them.
    reasons : Reasons
        Why what failed did.
    """

    rows: tuple[Row, ...]
    settings: tuple[Mapping[str, Any], ...]
    reasons: Reasons


def rerun(baseline: Baseline, out: Path, method: str | None = None, more: Sequence[str] = ()) -> Rerun:
    """Run a baseline's trials.

    Parameters
    ----------
    baseline : Baseline
        Its runs.
    out : Path
        A new folder; each run writes under a folder of its own in it.
    method : str, optional
        In place of the baseline's first.
    more : sequence of str
        Further arguments of each run, such as `engine=serial`.

    Returns
    -------
    Rerun
        A run of which not one trial succeeded has no rows in it.

    Raises
    ------
    InputError
        If a run is refused.
    """
    folders = []
    for i, arguments in enumerate(baseline.runs):
        folder = out / f"run_{i}"
        own = [] if method is None else _with_method(baseline.settings[i], method)
        kept = [argument for argument in arguments if not (own and argument.startswith("method="))]
        # One rig is calibrated once, and by the present code.
        places = [f"out={folder}", f"calibrations={out / 'calibrations'}"]
        with redirect_stdout(sys.stderr):
            code = run_experiment([*kept, *own, *more, *places])
        if code == StepError.exit_code:
            continue
        if code != 0:
            raise InputError("")  # it has said why
        if not (folder / "results.csv").is_file():
            raise InputError(f"`{' '.join(arguments)}` must run here, got nothing: its data is absent.")
        folders.append(folder / "results.csv")
    return stored(folders)


def _with_method(settings: Mapping[str, Any], method: str) -> Arguments:
    """Return the argument that puts a method in the place of a run's first one."""
    others = settings["method"][1:]
    require(method not in others, "--method", f"be another than the baseline's own {', '.join(others)}", method)
    return (f"method=[{','.join([method, *others])}]",)


def stored(results: Sequence[Path]) -> Rerun:
    """Read results that are there already, with the `run.json` beside each, if there is one.

    Raises
    ------
    InputError
        If a file is not what it should be.
    """
    rows, settings, reasons = list[Row](), [], dict[Failed, str]()
    for path in results:
        rows += read_rows(path)
        about = path.with_name("run.json")
        if about.is_file():
            try:
                said = json.loads(about.read_text(encoding="utf-8"))
                settings.append(dict(said["config"]))
                for failure in said["failures"]:
                    place = (failure[name] for name in ("condition", "method", "trial", "seed"))
                    reasons[(said["experiment"], *place)] = str(failure["reason"])
            except (OSError, ValueError, KeyError, TypeError) as error:
                raise InputError(f"`{about}` must be the run.json of a run, got: {error!r}.") from error
    return Rerun(tuple(sorted(rows)), tuple(settings), reasons)


def with_method_named(found: Rerun, baseline: Baseline, method: str) -> Rerun:
    """Return a rerun whose method goes by the name of the one that it took the place of."""
    first = {settings["experiment"]: settings["method"][0] for settings in baseline.settings}

    def named(experiment: str, name: str) -> str:
        return str(first[experiment]) if name == method else name

    rows = (replace(row, method=named(row.experiment, row.method)) for row in found.rows)
    reasons = {(e, c, named(e, m), trial, seed): why for (e, c, m, trial, seed), why in found.reasons.items()}
    return Rerun(tuple(sorted(rows)), found.settings, reasons)


def require_same_settings(baseline: Baseline, found: Rerun) -> None:
    """Raise an InputError unless a rerun had the baseline's settings, as far as both state them.

    Settings that are newer than the baseline are passed over; a default that has changed since is not.
    """
    recorded = {(settings["experiment"], settings["seed"]): settings for settings in baseline.settings}
    for present in found.settings:
        place = present.get("experiment"), present.get("seed")
        known = " or ".join(f"{experiment} with seed {seed}" for experiment, seed in recorded)
        require(place in recorded, "the results", f"be of {known}", f"{place[0]} with seed {place[1]}")
        now = _dotted(present)
        for key, value in _dotted(recorded[place]).items():
            same = key in _FREE or now.get(key) == value
            require(same, key, f"be {value!r} as in the baseline, or a new baseline be recorded", repr(now.get(key)))


def _dotted(settings: Mapping[str, Any], group: str = "") -> dict[str, Any]:
    found = dict[str, Any]()
    for name, value in settings.items():
        found |= _dotted(value, f"{group}{name}.") if isinstance(value, Mapping) else {f"{group}{name}": value}
    return found

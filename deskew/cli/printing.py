"""What the commands say: figures on stdout, warnings and errors on stderr, one line each."""

from __future__ import annotations

import json
import math
import os
import sys
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from deskew.errors import StepError

if TYPE_CHECKING:
    from deskew.types import DepthMap, Flattened, ProjectorCheck


def say(message: str) -> None:
    """Write one line to stderr, whatever line breaks or escape codes a file's name or content brought along."""
    line = " ".join(message.split())
    print("deskew: " + "".join(c if c.isprintable() else "?" for c in line), file=sys.stderr)


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(part) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(part) for part in value]
    return value.item() if hasattr(value, "item") else value  # a number of numpy's


def _finite(value: Any) -> Any:
    """JSON has neither NaN nor infinity: null stands for them."""
    if isinstance(value, dict):
        return {key: _finite(part) for key, part in value.items()}
    if isinstance(value, list):
        return [_finite(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def json_text(figures: Mapping[str, Any], indent: int | None = None) -> str:
    """Write figures as JSON, numbers of numpy's as Python's, and null for what is not finite."""
    return json.dumps(_finite(_plain(figures)), indent=indent)


def report(figures: Mapping[str, Any], as_json: bool, *written: Path) -> None:
    """Print figures, and say what has been `written` already if nobody takes them."""
    plain = _plain(figures)
    lines = [f"{key}: {f'{value:.6g}' if isinstance(value, float) else value}" for key, value in plain.items()]
    try:
        print(json_text(plain) if as_json else "\n".join(lines), flush=True)
    except OSError as error:
        # Else the interpreter would try once more to print what is left in the buffer, and complain in its own words.
        with suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        named = ", ".join(f"`{path}`" for path in written)
        whole = "is written and whole" if len(written) == 1 else "are written and whole"
        done = f"{named} {whole}" if written else "nothing was to be written"
        raise StepError(f"Printing the figures failed: {error.strerror or error}; {done}.") from error


def depth_figures(depth: DepthMap) -> dict[str, Any]:
    """How many pixels have depth, and why the others have none."""
    from deskew.types import Reason

    reason = depth.reason
    missing = {kind.name.lower(): int((reason == kind).sum()) for kind in Reason if kind is not Reason.OK}
    return {"depth_pixels": int((reason == 0).sum()), "missing_pixels": missing}


def warn(check: ProjectorCheck, name: str) -> None:
    """Say on stderr what is wrong with the projector; the work goes on, since only its user can judge the result."""
    for fault in check.faults:
        say(f"warning: {name}: {fault}")


def projector_figures(check: ProjectorCheck) -> dict[str, Any]:
    """Name what the frames say of the projector; nothing where they could not tell."""
    known = {"projector_gamma": check.gamma, "projector_stray": check.stray}
    figures: dict[str, Any] = {name: value for name, value in known.items() if value is not None}
    return {**figures, "projector_faults": list(check.faults)} if figures or check.faults else {}


def flattened_figures(flattened: Flattened, what: str) -> dict[str, Any]:
    """Status and counters; what did not come to rest flat is still written, and said so on stderr."""
    from deskew.types import Status

    if flattened.status is not Status.AT_REST:
        say(f"warning: the {what} is {flattened.status}, not at rest and flat: {flattened.remedy}")
    return {"status": str(flattened.status), **flattened.counters}

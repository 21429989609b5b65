"""Outcomes as jobs hand them over in files: JSON, so that whatever lies in the folder can be read and nothing runs."""

from __future__ import annotations

import base64
import json
from dataclasses import astuple
from pathlib import Path

from deskew.errors import StepError, in_one_line
from deskew.io.files import read_bytes
from experiments.trials.record import Outcome
from experiments.trials.schema import Failure, Row


def handed_over(outcome: Outcome) -> bytes:
    """Return an outcome as the content of a file; numbers come back bit for bit."""
    values = {
        "rows": [astuple(row) for row in outcome.rows],
        "timings": [astuple(row) for row in outcome.timings],
        "failures": [astuple(failure) for failure in outcome.failures],
        "pictures": {name: base64.b64encode(png).decode() for name, png in outcome.pictures.items()},
        "lost": outcome.lost,
    }
    return json.dumps(values, allow_nan=False).encode()


def taken_over(path: Path) -> Outcome:
    """Read an outcome that a job, perhaps of an interrupted run, has left.

    Raises
    ------
    StepError
        If the file holds anything else.
    """
    try:
        values = json.loads(read_bytes(path))
        return Outcome(
            tuple(Row(*cells) for cells in values["rows"]),
            tuple(Row(*cells) for cells in values["timings"]),
            tuple(Failure(*cells) for cells in values["failures"]),
            {name: base64.b64decode(png) for name, png in values["pictures"].items()},
            bool(values["lost"]),
        )
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise StepError(f"`{path}` is no outcome of a job: {in_one_line(error)}; remove it and run again.") from error

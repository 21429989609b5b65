"""What is kept beside a model: the accuracy of the setup that measured it, as section 2.5 proposes."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from deskew.cli.printing import json_text
from deskew.errors import require

RECORD_VERSION = 1

Record = dict[str, Any]


def write_metadata(values: Mapping[str, Any], path: Path) -> None:
    """Write values as JSON, whole or not at all."""
    from deskew import io

    io.write_bytes((json_text(values, indent=1) + "\n").encode(), path)


def calibration_digest(path: Path) -> str:
    """SHA-256 of a calibration file: a record belongs to one."""
    from deskew.io.files import read_bytes

    return hashlib.sha256(read_bytes(path)).hexdigest()


def accuracy_record(calibration: Path, unit: str, planes: list[dict[str, Any]], average: Mapping[str, Any]) -> Record:
    """Put together what `deskew accuracy` found with one calibration.

    Parameters
    ----------
    calibration : Path
        Its file.
    unit : str
        Of every length.
    planes : list of figures
        One of each capture.
    average : figures
        Over the captures; the paper's estimate is its mean absolute deviation.
    """
    return {
        "version": RECORD_VERSION,
        "measure": "deviation of the points of planes from their best-fit planes (Brown and Seales 2001, section 2.5)",
        "unit": unit,
        "calibration_sha256": calibration_digest(calibration),
        "planes": planes,
        "average": average,
    }


def read_record(path: Path, calibration: Path) -> Record:
    """Read an accuracy record.

    Raises
    ------
    InputError
        If it is no record, or of another calibration than this one.
    """
    from deskew.io.fields import Fields
    from deskew.io.files import read_json

    fields = Fields(read_json(path), str(path))
    fields.only(("version", "measure", "unit", "calibration_sha256", "planes", "average"))
    fields.version("version", RECORD_VERSION)
    own, found = calibration_digest(calibration), fields.values["calibration_sha256"]
    require(found == own, str(path), f"be of the calibration {calibration}", "a record of another one")
    return dict(fields.values)

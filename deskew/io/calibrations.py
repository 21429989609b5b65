"""``calibration.json``: both devices, their uncertainties and residuals; numbers survive the round trip exactly."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

from deskew.errors import InputError, require
from deskew.io.fields import Fields
from deskew.io.files import read_json, shown, write_bytes
from deskew.types import Calibration, Pinhole

CALIBRATION_VERSION = 1

_RESIDUALS = ("camera_rms_px", "projector_rms_px", "stereo_rms_px")
_HELD_OUT = ("held_out_camera_rms_px", "held_out_projector_rms_px", "held_out_length_rms")
_DEVICE = ("size_px", "K", "distortion", "R", "t")


def _device_values(device: Pinhole) -> dict[str, Any]:
    arrays = {name: getattr(device, name).tolist() for name in _DEVICE[1:]}
    return {"size_px": list(device.size), **arrays}


def _device(fields: Fields) -> Pinhole:
    fields.only(_DEVICE)
    K = fields.array("K", (3, 3))
    upper = K[1, 0] == 0 and K[2].tolist() == [0, 0, 1]
    require(upper, f"{fields.name}: K", "be upper triangular with a last row of 0, 0, 1", shown(K.tolist()))
    require(K[0, 1] == 0, f"{fields.name}: K", "have no skew", K[0, 1])  # OpenCV's camera knows none
    rest = (fields.array("distortion", (5,)), fields.array("R", (3, 3)), fields.array("t", (3,)))
    try:
        return Pinhole(fields.pair("size_px"), K, *rest)
    except InputError as error:
        raise InputError(f"`{fields.name}`: {error}") from error


def _require_deviations(values: dict[str, float], name: str) -> None:
    for key, value in values.items():
        require(math.isfinite(value) and value >= 0, f"{name}: {key}", "be a finite number of at least 0", value)


def write_calibration(calibration: Calibration, path: Path) -> None:
    """Write ``calibration.json``, whole or not at all.

    Lengths (`t`, and uncertainties of lengths) are in `unit`; pixels and radians elsewhere.

    Parameters
    ----------
    calibration : Calibration
        With the three residuals that the file format names.
    path : Path
        Ends in ``.json``.

    Raises
    ------
    InputError
        If a residual is missing, a number is NaN or infinite, or the suffix is another.
    StepError
        If the file system refuses.
    """
    path = Path(path)
    require(path.suffix.lower() == ".json", str(path), "end in .json", path.suffix or "no suffix")
    residuals = {key: float(value) for key, value in calibration.residuals.items()}
    uncertainty = {key: float(value) for key, value in calibration.uncertainty.items()}
    convergence = {key: float(value) for key, value in calibration.convergence.items()}
    named = set(_RESIDUALS) <= set(residuals) <= {*_RESIDUALS, *_HELD_OUT}
    wanted = f"be {', '.join(_RESIDUALS)}, and may be {', '.join(_HELD_OUT)}"
    require(named, "residuals", wanted, ", ".join(residuals))
    for name, group in (("residuals", residuals), ("uncertainty", uncertainty), ("convergence", convergence)):
        _require_deviations(group, name)
    values = {
        "version": CALIBRATION_VERSION,
        "unit": calibration.unit,
        "n_poses": calibration.n_poses,
        "camera": _device_values(calibration.camera),
        "projector": _device_values(calibration.projector),
        "residuals": residuals,
        "uncertainty": uncertainty,
        "convergence": convergence,
    }
    if calibration.camera_psf_px is not None:
        values["camera_psf_px"] = float(calibration.camera_psf_px)
    write_bytes((json.dumps(values, indent=1, allow_nan=False) + "\n").encode(), path)


def read_calibration(path: Path) -> Calibration:
    """Read ``calibration.json``.

    Parameters
    ----------
    path : Path
        As :func:`write_calibration` left it; `uncertainty`, `convergence` and `camera_psf_px` may be absent.

    Returns
    -------
    Calibration
        Bit for bit what was written.

    Raises
    ------
    InputError
        Naming the field at fault.
    """
    path = Path(path)
    fields = Fields(read_json(path), str(path))
    optional = ("uncertainty", "convergence", "camera_psf_px")
    fields.only(("version", "unit", "n_poses", "camera", "projector", "residuals"), optional)
    fields.version("version", CALIBRATION_VERSION)
    residuals = fields.table("residuals")
    residuals.only(_RESIDUALS, _HELD_OUT)
    return Calibration(
        camera=_device(fields.table("camera")),
        projector=_device(fields.table("projector")),
        residuals=residuals.deviations(),
        uncertainty=fields.table("uncertainty").deviations() if "uncertainty" in fields.values else {},
        convergence=fields.table("convergence").deviations() if "convergence" in fields.values else {},
        n_poses=fields.integer("n_poses", 0, 1 << 20),
        unit=fields.word("unit"),
        camera_psf_px=fields.positive("camera_psf_px") if "camera_psf_px" in fields.values else None,
    )

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from deskew.errors import InputError
from deskew.io import read_calibration, write_calibration
from deskew.types import Calibration, Pinhole

NUMBER = st.floats(allow_nan=False, allow_infinity=False, width=64)
DEVIATION = st.floats(min_value=0, allow_infinity=False)
FOCAL = st.floats(min_value=1e-3, max_value=1e6)
ANGLE = st.floats(min_value=-3, max_value=3)
RESIDUALS = ("camera_rms_px", "projector_rms_px", "stereo_rms_px")


@st.composite
def pinholes(draw: st.DrawFn) -> Pinhole:
    K = [[draw(FOCAL), 0, draw(NUMBER)], [0, draw(FOCAL), draw(NUMBER)], [0, 0, 1]]
    rotation = cv2.Rodrigues(np.array([draw(ANGLE), draw(ANGLE), draw(ANGLE)]))[0]
    size = (draw(st.integers(1, 1 << 16)), draw(st.integers(1, 1 << 16)))
    five, three = ([draw(NUMBER) for _ in range(n)] for n in (5, 3))
    return Pinhole(size, np.array(K), np.array(five), rotation, np.array(three))


def same(a: Calibration, b: Calibration) -> bool:
    """Bit for bit, the sign of a zero too."""
    arrays = ("K", "distortion", "R", "t")
    devices = [(a.camera, b.camera), (a.projector, b.projector)]
    return (
        all(getattr(x, n).tobytes() == getattr(y, n).tobytes() for x, y in devices for n in arrays)
        and all(x.size == y.size for x, y in devices)
        and (a.residuals, a.uncertainty, a.convergence) == (b.residuals, b.uncertainty, b.convergence)
        and (a.n_poses, a.unit) == (b.n_poses, b.unit)
        and a.camera_psf_px == b.camera_psf_px
    )


@settings(max_examples=60, deadline=None)
@given(
    camera=pinholes(),
    projector=pinholes(),
    residuals=st.tuples(DEVIATION, DEVIATION, DEVIATION),
    uncertainty=st.dictionaries(st.text(min_size=1, max_size=20), DEVIATION, max_size=5),
    n_poses=st.integers(0, 1000),
    unit=st.sampled_from(["mm", "units", "µm"]),
    psf=st.none() | st.floats(min_value=0, exclude_min=True, allow_infinity=False),
)
def test_every_number_survives_exactly(
    tmp_path_factory: pytest.TempPathFactory,
    camera: Pinhole,
    projector: Pinhole,
    residuals: tuple[float, float, float],
    uncertainty: dict[str, float],
    n_poses: int,
    unit: str,
    psf: float | None,
) -> None:
    path = tmp_path_factory.mktemp("calibration") / "c.json"
    stated = dict(zip(RESIDUALS, residuals, strict=True))
    written = Calibration(camera, projector, stated, uncertainty, n_poses, unit, psf)
    write_calibration(written, path)
    assert same(read_calibration(path), written)


def test_the_file_states_version_and_unit(tmp_path: Path, calibration: Calibration) -> None:
    write_calibration(calibration, tmp_path / "c.json")
    values = json.loads((tmp_path / "c.json").read_text())
    parts = ["version", "unit", "n_poses", "camera", "projector", "residuals", "uncertainty", "convergence"]
    assert list(values) == parts
    assert list(values["camera"]) == ["size_px", "K", "distortion", "R", "t"]
    assert (values["version"], values["unit"], values["camera"]["size_px"]) == (1, "mm", [12, 8])


def test_uncertainty_may_be_left_out(tmp_path: Path, calibration: Calibration) -> None:
    write_calibration(calibration, tmp_path / "c.json")
    values = json.loads((tmp_path / "c.json").read_text())
    del values["uncertainty"]
    (tmp_path / "c.json").write_text(json.dumps(values))
    assert same(read_calibration(tmp_path / "c.json"), replace(calibration, uncertainty={}))


def test_figures_on_left_out_boards_and_the_convergence_survive(tmp_path: Path, calibration: Calibration) -> None:
    held_out = {"held_out_camera_rms_px": 0.11, "held_out_projector_rms_px": 0.2, "held_out_length_rms": 0.003}
    residuals = {**calibration.residuals, **held_out}
    full = replace(calibration, residuals=residuals, convergence={"steps": 14.0, "condition": 812.5})
    write_calibration(full, tmp_path / "c.json")
    assert same(read_calibration(tmp_path / "c.json"), full)
    with pytest.raises(InputError, match=r"`residuals` must be camera_rms_px, .* and may be held_out_camera_rms_px"):
        write_calibration(replace(calibration, residuals={**residuals, "held_in": 1.0}), tmp_path / "d.json")


def test_a_spread_that_is_not_known_is_left_out(tmp_path: Path, calibration: Calibration) -> None:
    write_calibration(replace(calibration, camera_psf_px=0.8), tmp_path / "c.json")
    values = json.loads((tmp_path / "c.json").read_text())
    assert values.pop("camera_psf_px") == 0.8
    (tmp_path / "c.json").write_text(json.dumps(values))
    assert same(read_calibration(tmp_path / "c.json"), calibration)
    assert calibration.camera_psf_px is None


@pytest.mark.parametrize("psf", [0.0, -0.8, np.nan, np.inf])
def test_a_spread_is_positive(calibration: Calibration, psf: float) -> None:
    with pytest.raises(InputError, match=r"`camera_psf_px` must be finite and positive \[px\], or None"):
        replace(calibration, camera_psf_px=psf)


def put(*keys: str | int, value: Any) -> Callable[[dict[str, Any]], object]:
    def change(values: Any) -> None:
        for key in keys[:-1]:
            values = values[key]
        values[keys[-1]] = value

    return change


WRONG: dict[str, tuple[Callable[[dict[str, Any]], object], str]] = {
    "no version": (lambda v: v.pop("version"), "must have the keys .*, got none named version"),
    "later version": (put("version", value=2), "version` must be 1, got 2"),
    "version a string": (put("version", value="1"), "version` must be 1, got '1'"),
    "version 1.0": (put("version", value=1.0), "version` must be 1, got 1.0"),
    "unknown key": (put("comment", value="hi"), "must have the keys .*, got also 'comment'"),
    "unit a number": (put("unit", value=1), "unit` must be 1 to 64 printable characters, got 1"),
    "unit empty": (put("unit", value=""), "unit` must be 1 to 64 printable characters, got ''"),
    "unit with a line break": (put("unit", value="m\nm"), "unit` must be 1 to 64 printable characters"),
    "negative poses": (put("n_poses", value=-1), r"n_poses` must be an integer in \[0, 1048576\], got -1"),
    "poses a float": (put("n_poses", value=9.0), r"n_poses` must be an integer in"),
    "camera a list": (put("camera", value=[]), r"camera` must be a table, got \[\]"),
    "camera without K": (lambda v: v["camera"].pop("K"), "camera` must have the keys .*, got none named K"),
    "camera with fov": (put("camera", "fov", value=1), "camera` must have the keys .*, got also 'fov'"),
    "size reversed sign": (put("camera", "size_px", value=[-12, 8]), r"size_px` must be two integers in"),
    "size true": (put("camera", "size_px", value=[True, 8]), r"size_px` must be two integers in"),
    "K of two rows": (lambda v: v["camera"]["K"].pop(), "camera: K` must hold 3 x 3 finite numbers"),
    "K flat": (put("camera", "K", value=[1.0] * 9), "camera: K` must hold 3 x 3 finite numbers"),
    "K with a string": (put("camera", "K", 0, 0, value="900"), "camera: K` must hold 3 x 3 finite numbers"),
    "K with null": (put("projector", "K", 0, 0, value=None), "projector: K` must hold 3 x 3 finite numbers"),
    "K with true": (put("projector", "K", 0, 0, value=True), "projector: K` must hold 3 x 3 finite numbers"),
    "K of endless size": (put("camera", "K", 0, 0, value=10**400), "camera: K` must hold 3 x 3 finite numbers"),
    "K with zero focal length": (put("camera", "K", 1, 1, value=0), "camera`: `K` must have positive focal lengths"),
    "K with skew": (put("projector", "K", 0, 1, value=0.1), r"projector: K` must have no skew, got 0\.1"),
    "K with another last row": (put("camera", "K", 2, 2, value=2), "camera: K` must be upper triangular"),
    "distortion of four": (lambda v: v["camera"]["distortion"].pop(), "distortion` must hold 5 finite numbers"),
    "R scaled": (put("camera", "R", 0, 0, value=1.1), "camera`: `R` must be a rotation"),
    "R reflected": (put("projector", "R", 2, 2, value=-1), "projector`: `R` must be a rotation, not a reflection"),
    "t a number": (put("projector", "t", value=3), "projector: t` must hold 3 finite numbers, got 3"),
    "residual missing": (lambda v: v["residuals"].pop("stereo_rms_px"), "residuals` must have the keys"),
    "residual negative": (put("residuals", "stereo_rms_px", value=-1), "stereo_rms_px.*must be a finite number of at"),
    "residual a string": (
        put("residuals", "camera_rms_px", value="low"),
        "camera_rms_px.*must be a finite number of at",
    ),
    "uncertainty negative": (put("uncertainty", "camera_fx_px", value=-1), "camera_fx_px.*must be a finite number"),
    "spread of zero": (put("camera_psf_px", value=0), "camera_psf_px` must be a finite number above 0, got 0"),
    "spread null": (put("camera_psf_px", value=None), "camera_psf_px` must be a finite number above 0"),
    "uncertainty a list": (put("uncertainty", value=[1]), "uncertainty` must be a table"),
}

WRONG_TEXT = {
    "empty": ("", "must be valid JSON"),
    "cut": ('{"version": 1, "unit": "m', "must be valid JSON"),
    "a list": ("[1]", r"must hold a JSON object, got \[1\]"),
    "NaN": ('{"version": NaN}', "must be valid JSON, got 'NaN'"),
    "infinity": ('{"version": -Infinity}', "must be valid JSON, got '-Infinity'"),
    "repeated key": ('{"version": 1, "version": 1}', "must be valid JSON, got 'a repeated key'"),
    "nested without end": ("[" * 200_000, "must be valid JSON"),
    "overflow": ('{"version": 1e999}', "must have the keys"),
    "endless digits": ('{"version": ' + "9" * 5000 + "}", "must be valid JSON"),
    "not text": ("\udcff\udcfe", "must be valid JSON"),
}


@pytest.mark.parametrize("case", list(WRONG))
def test_every_wrong_field_is_named(tmp_path: Path, calibration: Calibration, case: str) -> None:
    path = tmp_path / "c.json"
    write_calibration(calibration, path)
    values = json.loads(path.read_text())
    change, message = WRONG[case]
    change(values)
    path.write_text(json.dumps(values))
    with pytest.raises(InputError, match=rf"c\.json.*{message}") as caught:
        read_calibration(path)
    assert len(str(caught.value)) < 500


@pytest.mark.parametrize("case", list(WRONG_TEXT))
def test_what_is_no_calibration_at_all_is_refused(tmp_path: Path, case: str) -> None:
    text, message = WRONG_TEXT[case]
    (tmp_path / "c.json").write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(InputError, match=rf"c\.json` {message}"):
        read_calibration(tmp_path / "c.json")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"residuals": {"camera_rms_px": 1.0}}, "`residuals` must be camera_rms_px, projector_rms_px, stereo_rms_px"),
        ({"residuals": dict.fromkeys(RESIDUALS, np.nan)}, "`residuals: camera_rms_px` must be a finite number"),
        ({"uncertainty": {"camera_fx_px": np.inf}}, "`uncertainty: camera_fx_px` must be a finite number"),
    ],
    ids=["residuals missing", "residual NaN", "uncertainty infinite"],
)
def test_what_could_not_be_read_is_not_written(
    tmp_path: Path, calibration: Calibration, change: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        write_calibration(replace(calibration, **change), tmp_path / "c.json")
    assert list(tmp_path.iterdir()) == []

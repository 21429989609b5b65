from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from deskew.errors import InputError, StepError
from deskew.flattening import METHODS, ParticleSettings, find_method, flatten
from deskew.types import Sheet, Status
from tests.flattening.bent_sheets import flat_grid

PLUGIN = """
from deskew.errors import InputError
from deskew.types import Flattened, Status

def squash(sheet, *, lift=0.0):
    vertices = sheet.vertices.copy()
    vertices[..., 2] = lift
    return Flattened(vertices, Status.AT_REST)

def returns_an_array(sheet):
    return sheet.vertices

def returns_a_row(sheet):
    return Flattened(sheet.vertices[0], Status.AT_REST)

def breaks(sheet):
    return 1 / 0

def refuses(sheet):
    raise InputError("`sheet` must be blue, got red.")

def exits(sheet):
    raise SystemExit("first line\\nsecond line")

def tears(sheet):
    return Flattened(sheet.vertices * float("nan"), Status.AT_REST)

def tears_and_says_so(sheet):
    return Flattened(sheet.vertices * float("nan"), Status.DIVERGED)

def returns_lists(sheet):
    return Flattened(sheet.vertices.tolist(), Status.AT_REST)

def has_a_status_of_its_own(sheet):
    return Flattened(sheet.vertices, "flat")

a_number = 3
"""


@pytest.fixture
def plugin(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    (tmp_path / "plugged_in.py").write_text(PLUGIN)
    monkeypatch.syspath_prepend(str(tmp_path))
    return "plugged_in"


def test_function_from_outside_plugs_in_by_its_name(plugin: str) -> None:
    result = flatten(Sheet(flat_grid()), method=f"{plugin}:squash", lift=2.0)
    assert result.status is Status.AT_REST
    assert (result.vertices[..., 2] == 2.0).all()


@pytest.mark.parametrize(
    "name", ["paper_heun", "", "plugged_in", ":squash", "plugged_in:", "..x:y", ".x:y", "x..z:y", None, 5, []]
)
def test_unknown_method_lists_the_known_ones(name: Any) -> None:
    with pytest.raises(
        InputError,
        match=r"`method` must be one of spring, paper_euler, paper_rk4, particles, lscm, arap, slim, or package\.mod",
    ):
        flatten(Sheet(flat_grid()), method=name)


def test_missing_module_or_function_is_named(plugin: str) -> None:
    with pytest.raises(InputError, match="No module named 'no_such_module'"):
        flatten(Sheet(flat_grid()), method="no_such_module:squash")
    for attribute in ("no_such_function", "a_number"):
        with pytest.raises(InputError, match="`method` must name a function in plugged_in"):
            flatten(Sheet(flat_grid()), method=f"{plugin}:{attribute}")


@pytest.mark.parametrize(
    ("function", "message"),
    [
        ("returns_an_array", "must return a Flattened, got ndarray"),
        ("returns_a_row", r"must keep the shape \(9, 11, 3\), got \(11, 3\)"),
        ("breaks", "failed: ZeroDivisionError"),
        ("exits", r"failed: SystemExit: first line second line\."),
        ("tears", "must return finite vertices unless it diverged, got at_rest with NaN"),
        ("returns_lists", "must return vertices as an array of real numbers, got list"),
        ("has_a_status_of_its_own", "must return a Status, got 'flat'"),
    ],
)
def test_misbehaving_function_from_outside_is_a_step_error(plugin: str, function: str, message: str) -> None:
    with pytest.raises(StepError, match=message):
        flatten(Sheet(flat_grid()), method=f"{plugin}:{function}")


@pytest.mark.parametrize("text", ["def", "1 / 0", "import sys\nsys.exit('bye')"])
def test_module_that_cannot_be_imported_is_a_wrong_method_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str
) -> None:
    (tmp_path / "not_to_import.py").write_text(text)
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(InputError, match=r"^`method` must be one of .*, got 'not_to_import:f': \w+: .*\.$"):
        find_method("not_to_import:f")


def test_a_function_from_outside_may_diverge(plugin: str) -> None:
    assert flatten(Sheet(flat_grid()), method=f"{plugin}:tears_and_says_so").status is Status.DIVERGED


def test_error_of_a_function_from_outside_in_our_wording_passes(plugin: str) -> None:
    with pytest.raises(InputError, match="must be blue"):
        flatten(Sheet(flat_grid()), method=f"{plugin}:refuses")


@pytest.mark.parametrize("method", sorted(METHODS))
def test_unknown_setting_is_refused_by_name(method: str) -> None:
    with pytest.raises(InputError, match=r"`stifness` must be (a setting of .* \(k_s, |left out: \w+ has no settings)"):
        flatten(Sheet(flat_grid()), method=method, stifness=2.0)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *[(name, value) for name in ("k_s", "mass", "eps_mm", "dt") for value in (0, -1.0, np.nan, np.inf, "1", True)],
        *[
            (name, value)
            for name in ("k_d", "gravity", "weak_gravity", "drag")
            for value in (-1e-9, np.nan, np.inf, "1")
        ],
        *[("k_r", value) for value in (-0.1, 1.1, np.nan, None)],
        *[("max_steps", value) for value in (0, -5, 2.5, True, 10**30)],
        *[(name, value) for name in ("k_s", "mass", "dt", "eps_mm") for value in (1e-300, 1e300, 10**400)],
        *[(name, 1e300) for name in ("k_d", "gravity", "weak_gravity", "drag")],
        ("k_s", None),
        ("halving", "thirds"),
    ],
)
def test_setting_out_of_range_is_refused_by_name(name: str, value: object) -> None:
    with pytest.raises(InputError, match=rf"`{name}` must .*, got "):
        ParticleSettings(**{name: value})  # type: ignore[arg-type]


@pytest.mark.parametrize("k_r", [0, 0.0, 0.1, 1, 1.0])
def test_restitution_may_be_anything_from_0_to_1(k_r: float) -> None:
    assert flatten(Sheet(flat_grid()), method="paper_euler", k_r=k_r).status is Status.AT_REST


def test_mixed_numbers_of_numpy_are_numbers() -> None:
    assert ParticleSettings(k_s=np.float64(2.0), mass=np.float32(0.5)).k_s == 2.0
    assert flatten(Sheet(flat_grid()), k_s=np.float32(2.0), noise_mm=np.int64(0)).status is Status.AT_REST


@pytest.mark.parametrize("extreme", [{"k_s": 1e12}, {"k_s": 1e-9}, {"mass": 1e12}, {"mass": 1e-9}, {"dt": 1e12}])
def test_settings_at_the_ends_of_their_ranges_end_without_a_warning(extreme: dict[str, float]) -> None:
    assert isinstance(flatten(Sheet(flat_grid((3, 4))), method="paper_euler", max_steps=400, **extreme).status, Status)


@pytest.mark.parametrize(
    ("scale", "message"),
    [(1e200, "`vertices` must lie within 1e\\+09 mm of the origin"), (1e-200, "`vertices` must be distinct")],
)
def test_sheets_beyond_all_measure_are_refused(scale: float, message: str) -> None:
    with pytest.raises(InputError, match=message):
        flatten(Sheet(flat_grid() * scale))
    with pytest.raises(InputError, match="`stiffness` must be in"):
        flatten(Sheet(flat_grid(), stiffness=np.full((8, 10), scale)))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"vertices": flat_grid() + 1j}, "`vertices` must be an array of real numbers, got complex128"),
        ({"vertices": [[0, 0, 0]]}, "`vertices` must be an array of real numbers, got list"),
        ({"vertices": np.eye(3), "faces": np.eye(3)}, "`faces` must be an array of whole numbers, got float64"),
        ({"vertices": np.eye(3), "faces": np.eye(3) > 0}, "`faces` must be an array of whole numbers, got bool"),
        ({"vertices": np.eye(3), "faces": [[0, 1, 2]]}, "`faces` must be an array of whole numbers, got list"),
        (
            {"vertices": np.ma.masked_less(flat_grid(), -40.0)},
            "`vertices` must be an array of real numbers, got masked values",
        ),
        ({"vertices": np.eye(3), "faces": np.array([[0, 1, -1]])}, r"`faces` must have indices in \[0, 2\], got -1"),
        ({"vertices": np.eye(3), "faces": np.array([[0, 1, 3]])}, r"`faces` must have indices in \[0, 2\], got 3"),
        ({"vertices": np.eye(3), "faces": np.zeros((0, 3), int)}, "`faces` must be 1 or more, got 0"),
        ({"vertices": np.zeros((0, 3)), "faces": np.zeros((1, 3), int)}, "`vertices` must be 1 or more, got 0"),
        ({"vertices": flat_grid(), "cut": [[False]]}, r"`cut` must be bool of shape \(8, 10\).*, got list"),
        ({"vertices": flat_grid(), "cut": np.zeros((8, 10), int)}, "`cut` must be bool .*, got int64 of shape"),
        ({"vertices": flat_grid(), "crease_width": "wide"}, r"`crease_width` must be in \[0, 10\].*, got 'wide'"),
        ({"vertices": flat_grid(), "crease_width": np.nan}, r"`crease_width` must be in \[0, 10\].*, got nan"),
        (
            {"vertices": flat_grid(), "stiffness": np.full((8, 10), np.nan)},
            r"`stiffness` must be in .*, got nan to nan",
        ),
        ({"vertices": flat_grid(), "stiffness": [[1.0]]}, "`stiffness` must be an array of real numbers, got list"),
    ],
)
def test_sheets_of_something_else_than_numbers_are_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Sheet(**change)

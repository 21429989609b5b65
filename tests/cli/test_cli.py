"""The command line against a pipeline of stand-ins: what it reads, writes, prints and refuses."""

from __future__ import annotations

import importlib
import json
import subprocess
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import deskew
from deskew import io
from deskew.acquisition import DepthSettings
from deskew.cli import main
from deskew.errors import StepError
from deskew.recipes import BEST, PAPER, Recipe
from deskew.restoration import Textures
from deskew.types import (
    Board,
    Calibration,
    Capture,
    Correspondence,
    DepthMap,
    Flattened,
    PatternKind,
    Pinhole,
    ProjectorCheck,
    Scan,
    Sheet,
    Status,
)

COMMANDS = ("calibrate", "scan", "accuracy", "flatten", "restore", "run", "score", "edit")
SIZE = (12, 8)
CAMERA = Pinhole(
    SIZE, np.array([[10.0, 0, 5.5], [0, 10, 3.5], [0, 0, 1]]), np.zeros(5), np.eye(3), np.array([0, 0, 9.0])
)
PROJECTOR = replace(CAMERA, size=(6, 5))
CALIBRATION = Calibration(
    CAMERA, PROJECTOR, {"camera_rms_px": 0.1, "projector_rms_px": 0.2, "stereo_rms_px": 0.3}, {}, 2, "mm"
)


def capture(seed: int = 0) -> Capture:
    rng = np.random.default_rng(seed)
    white, black, *planes = (rng.integers(0, 255, (8, 12), dtype=np.uint8) for _ in range(14))
    uv = {"uv": rng.integers(0, 255, (8, 12), dtype=np.uint8)}
    return Capture(white, black, (6, 5), PatternKind.GRAY_CODE, planes[:6], planes[6:], uv)


class StandIn:
    """Records what the command passes on, and answers with fixed values."""

    def __init__(self) -> None:
        self.calls: dict[str, Any] = {}
        self.status = Status.AT_REST
        self.fails: str | None = None
        self.check = ProjectorCheck()

    def _step(self, name: str, **values: Any) -> None:
        if self.fails == name:
            raise StepError(f"{name} found no page: put it on a darker desk.")
        self.calls[name] = values

    def calibrate(
        self, board: Board, captures: Iterable[Capture], *, watch: Callable[[Correspondence], None]
    ) -> Calibration:
        poses = [np.stack([*c.columns, *c.rows]) for c in captures]
        for _ in poses:
            watch(Correspondence(np.zeros((1, 1)), np.zeros((1, 1)), np.zeros((1, 1), np.uint8), None, self.check))
        self._step("calibrate", board=board, poses=poses)
        return replace(CALIBRATION, n_poses=len(poses))

    def scan_by(
        self,
        recipe: Recipe,
        page: Capture,
        calibration: Calibration,
        *,
        shape: tuple[int, int],
        mask: Any,
        depth: DepthSettings | None = None,
        max_hole_px: float = 12.0,
    ) -> Scan:
        frames, gates = [*page.columns, *page.rows], (depth, max_hole_px)
        self._step("scan", recipe=recipe, frames=frames, calibration=calibration, shape=shape, mask=mask, gates=gates)
        reason = np.zeros((8, 12), np.uint8)
        reason[0, :3] = 1
        measured = DepthMap(np.where(reason == 0, 9.0, np.nan), reason, CAMERA)
        x, y = np.meshgrid(np.linspace(-1, 1, shape[1]), np.linspace(1, -1, shape[0]))
        sheet = Sheet(np.stack([x, y, 0 * x], -1))
        images, outline = {"white": page.white, **page.textures}, np.zeros((4, 2))
        return Scan(images, measured, CAMERA, sheet, outline, self.check, profiles=page.profiles)

    def with_stiffness(self, scan: Scan, materials: io.StiffnessMap) -> Scan:
        self._step("stiffness", materials=materials)
        return scan

    def with_shading_removed(self, scan: Scan, page: Capture, calibration: Calibration, recipe: Recipe) -> Scan:
        self._step("unshade", calibration=calibration, recipe=recipe)
        return replace(scan, images={**scan.images, "unshaded": page.white - page.black})

    def restore_lights(
        self, scan: Scan, *, method: str, lights: Sequence[str], scale: float, **settings: object
    ) -> Textures:
        self._step("restore", scan=scan, method=method, lights=list(lights), scale=scale, settings=settings)
        remedy = "" if self.status is Status.AT_REST else "push harder"
        flattened = Flattened(
            scan.sheet.vertices, self.status, remedy, {"steps": 7, "spring_energy": np.float64("nan")}
        )
        images = {light: scan.images[light][::-1].copy() for light in lights}
        return Textures(images, np.zeros((8, 12, 2), np.float32), CAMERA, flattened, {})


@pytest.fixture
def steps(monkeypatch: pytest.MonkeyPatch) -> StandIn:
    stand_in = StandIn()
    monkeypatch.setattr(deskew, "pipeline", stand_in, raising=False)
    monkeypatch.setitem(sys.modules, "deskew.pipeline", stand_in)
    return stand_in


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with valid inputs of every kind, and an empty `out`."""
    io.write_capture(capture(), tmp_path / "page")
    io.write_board(Board((5, 4), 25.0), [capture(1), capture(2)], tmp_path / "board")
    io.write_calibration(CALIBRATION, tmp_path / "c.json")
    io.write_scan(StandIn().scan_by(BEST, capture(), CALIBRATION, shape=(3, 4), mask=None), tmp_path / "scan.npz")
    (tmp_path / "out").mkdir()
    for name, size, level in (("mask", (8, 12), 255), ("dark", (8, 12), 0), ("small", (4, 4), 255)):
        io.write_image(np.full(size, level, np.uint8), tmp_path / f"{name}.png")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(line: str, capsys: pytest.CaptureFixture[str]) -> tuple[int, str, str]:
    code = main(line.split())
    printed = capsys.readouterr()
    return code, printed.out, printed.err


def test_calibrate_reads_a_board_and_writes_a_calibration(
    here: Path, steps: StandIn, capsys: pytest.CaptureFixture[str]
) -> None:
    code, out, err = run("calibrate board -o out/c.json --json", capsys)
    assert (code, err) == (0, "")
    assert json.loads(out) == {"calibration": "out/c.json", "n_poses": 2, **CALIBRATION.residuals}
    assert steps.calls["calibrate"]["board"] == Board((5, 4), 25.0)
    wanted = [np.stack([*capture(seed).columns, *capture(seed).rows]) for seed in (1, 2)]
    assert np.array_equal(steps.calls["calibrate"]["poses"], wanted)
    assert io.read_calibration(here / "out" / "c.json").n_poses == 2


@pytest.mark.parametrize(("option", "shape"), [("", (45, 45)), ("--shape 3 5", (3, 5))])
def test_scan_writes_everything_for_restore(
    here: Path, steps: StandIn, capsys: pytest.CaptureFixture[str], option: str, shape: tuple[int, int]
) -> None:
    code, out, err = run(f"scan page --calibration c.json -o out/s.npz --json {option}", capsys)
    assert (code, err) == (0, "")
    figures = json.loads(out)
    assert figures["vertices"] == shape[0] * shape[1]
    assert figures["depth_pixels"] == 93
    assert figures["missing_pixels"]["shadow"] == 3
    assert steps.calls["scan"]["shape"] == shape
    assert io.read_scan(here / "out" / "s.npz").sheet.vertices.shape == (*shape, 3)
    assert run("restore out/s.npz -o out/r.png", capsys)[0] == 0
    assert np.array_equal(io.read_image(here / "out" / "r.png"), capture().white[::-1])


def test_a_mask_is_taken_when_asked_for(here: Path, steps: StandIn, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("run page -c c.json -o out/r.png", capsys)[0] == 0
    assert steps.calls["scan"]["mask"] is None
    assert run("scan page -c c.json -o out/s.npz --mask mask.png", capsys)[0] == 0
    assert steps.calls["scan"]["mask"].shape == (8, 12)
    assert steps.calls["scan"]["mask"].dtype == np.bool_


@pytest.mark.parametrize(
    ("line", "recipe"),
    [
        ("run page -c c.json -o out/r.png", replace(BEST, ink=False)),  # a Gray code, whose decoder leaves ink out
        ("run page -c c.json -o out/r.png --ink", BEST),
        ("run page -c c.json -o out/r.png -m paper_rk4", PAPER),
        ("run page -c c.json -o out/r.png -m paper_rk4 --ink", replace(PAPER, ink=True)),
        ("scan page -c c.json -o out/s.npz", replace(BEST, ink=False)),
        ("scan page -c c.json -o out/s.npz --no-ink --no-denoise", replace(BEST, ink=False, denoise=False)),
    ],
)
def test_a_page_is_scanned_as_its_method_asks_unless_told_otherwise(
    here: Path, steps: StandIn, capsys: pytest.CaptureFixture[str], line: str, recipe: Recipe
) -> None:
    assert run(line, capsys)[0] == 0
    assert steps.calls["scan"]["recipe"] == recipe


@pytest.mark.parametrize("line", ["scan page -c c.json -o out/s.npz", "run page -c c.json -o out/r.png"])
def test_what_is_believed_of_depth_can_be_said(
    here: Path, steps: StandIn, capsys: pytest.CaptureFixture[str], line: str
) -> None:
    assert run(line, capsys)[0] == 0
    assert steps.calls["scan"]["gates"] == (DepthSettings(), 12.0)
    assert run(f"{line} --heights -1500 1500 --neighbour 6 --jump 15 --hole 100", capsys)[0] == 0
    wanted = DepthSettings(z_min_mm=-1500.0, z_max_mm=1500.0, neighbour_mm=6.0, jump_mm=15.0)
    assert steps.calls["scan"]["gates"] == (wanted, 100.0)


def test_a_scanned_mesh_carries_its_place_in_the_white_image(
    here: Path, steps: StandIn, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("scan page -c c.json -o out/s.ply --shape 2 2", capsys)[0] == 0
    mesh = io.read_mesh(here / "out" / "s.ply")
    assert mesh.vertices.tolist() == [[-1, 1, 0], [1, 1, 0], [-1, -1, 0], [1, -1, 0]]
    # x = 10 * X / 9 + 5.5 px of 12, its centre at + 0.5; y likewise of 8, and t runs upwards.
    s, t = (5.5 + 10 / 9 + 0.5) / 12, 1 - (3.5 + 10 / 9 + 0.5) / 8
    assert mesh.texture is not None
    assert np.allclose(mesh.texture, [[1 - s, t], [s, t], [1 - s, 1 - t], [s, 1 - t]], rtol=0, atol=1e-7)


def test_run_goes_from_a_folder_to_a_page(here: Path, steps: StandIn, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = run("run page -c c.json -o out/r.tif --method paper_rk4 --json", capsys)
    assert (code, err) == (0, "")
    figures = json.loads(out)
    assert figures.pop("dpi") == pytest.approx([25.4 * 10 / 9] * 2)  # a focal length of 10 px, 9 mm away
    assert figures == {
        "restored": "out/r.tif",
        "method": "paper_rk4",
        "filled_fraction": 0.0,
        "status": "at_rest",
        "steps": 7,
        "spring_energy": None,
    }
    assert steps.calls["restore"]["method"] == "paper_rk4"
    assert len(steps.calls["scan"]["frames"]) == 12
    assert np.array_equal(io.read_image(here / "out" / "r.tif"), capture().white[::-1])


@pytest.mark.parametrize("start", ["run page -c c.json", "restore scan.npz"])
def test_a_stiffness_map_is_taken_when_asked_for(
    here: Path, steps: StandIn, capsys: pytest.CaptureFixture[str], start: str
) -> None:
    (here / "mask.toml").write_text("[stiffness]\n255 = 3.5\n")
    assert run(f"{start} -o out/r.png", capsys)[0] == 0
    assert "stiffness" not in steps.calls
    assert run(f"{start} -o out/s.png --stiffness mask.png", capsys)[0] == 0
    materials = steps.calls["stiffness"]["materials"]
    assert (materials.size, dict(materials.constants)) == (SIZE, {255: 3.5})
    steps.calls.clear()
    code, out, err = run(f"{start} -o out/t.png --stiffness dark.png", capsys)
    assert (code, out, err) == (2, "", "deskew: `dark.toml` must be a file, got nothing there.\n")
    assert not steps.calls


@pytest.mark.parametrize("start", ["run page -c c.json", "restore scan.npz"])
def test_a_free_scale_is_the_methods_setting_and_needs_a_map(
    here: Path, steps: StandIn, capsys: pytest.CaptureFixture[str], start: str
) -> None:
    (here / "mask.toml").write_text("[stiffness]\n255 = 3.5\n")
    assert run(f"{start} -o out/r.png --stiffness mask.png", capsys)[0] == 0
    assert steps.calls["restore"]["settings"] == {}
    assert run(f"{start} -o out/r.png --stiffness mask.png --free-scale", capsys)[0] == 0
    assert steps.calls["restore"]["settings"] == {"free_scale": True}
    steps.calls.clear()
    wanted = "deskew: `--free-scale` must come with --stiffness, a map of two materials, got none.\n"
    assert run(f"{start} -o out/r.png --free-scale", capsys) == (2, "", wanted)
    wanted = "deskew: `--free-scale` must be left out, since only the method spring finds a scale, got paper_rk4.\n"
    assert run(f"{start} -o out/r.png -m paper_rk4 --stiffness mask.png --free-scale", capsys) == (2, "", wanted)
    assert not steps.calls


def test_a_map_of_another_size_is_refused_before_the_scan(
    here: Path, steps: StandIn, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / "small.toml").write_text("[stiffness]\n255 = 3.5\n")
    wanted = "deskew: `small.png` must be 12x8 px, got 4x4 px.\n"
    assert run("run page -c c.json -o out/r.png --stiffness small.png", capsys) == (2, "", wanted)
    assert not steps.calls


@pytest.mark.parametrize("start", ["run page -c c.json", "restore scan.npz"])
def test_every_light_and_combination_is_written_on_request(
    here: Path, steps: StandIn, capsys: pytest.CaptureFixture[str], start: str
) -> None:
    uv = capture().textures["uv"][::-1]
    assert run(f"{start} -o out/r.png --light uv --scale 2", capsys)[0] == 0
    assert steps.calls["restore"]["lights"] == ["uv"]
    assert steps.calls["restore"]["scale"] == 2.0
    assert np.array_equal(io.read_image(here / "out" / "r.png"), uv)
    (here / "out" / "r.png").unlink()
    code, out, _ = run(f"{start} -o out/r.png -l uv -l white --combine mean --combine ratio:uv/white --json", capsys)
    assert code == 0
    names = ["r-uv.png", "r-white.png", "r-mean.png", "r-ratio-uv-white.png"]
    assert json.loads(out)["restored"] == [f"out/{name}" for name in names]
    assert sorted(path.name for path in (here / "out").iterdir()) == sorted(names)
    assert np.array_equal(io.read_image(here / "out" / "r-uv.png"), uv)


def test_the_projectors_shading_is_removed_when_asked_for(
    here: Path, steps: StandIn, capsys: pytest.CaptureFixture[str]
) -> None:
    even = (capture().white - capture().black)[::-1]
    assert run("run page -c c.json -o out/plain.png --combine mean", capsys)[0] == 0
    assert "unshade" not in steps.calls
    assert run("run page -c c.json -o out/r.png --light unshaded", capsys)[0] == 0
    assert np.array_equal(io.read_image(here / "out" / "r.png"), even)
    assert run("run page -c c.json -o out/q.png --combine ratio:unshaded/white", capsys)[0] == 0
    assert steps.calls["restore"]["lights"] == ["unshaded", "white"]
    assert run("scan page -c c.json -o out/s.npz --unshaded", capsys)[0] == 0
    assert run("restore out/s.npz -o out/t.png --light unshaded", capsys)[0] == 0
    assert np.array_equal(io.read_image(here / "out" / "t.png"), even)
    code, _, err = run("restore scan.npz -o out/u.png --light unshaded", capsys)
    assert (code, err) == (2, "deskew: `--light` must be one of white, uv, got unshaded.\n")


def test_combinations_alone_are_made_of_all_lights(
    here: Path, steps: StandIn, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("restore scan.npz -o out/r.png --combine components", capsys)[0] == 0
    assert steps.calls["restore"]["lights"] == ["white", "uv"]
    assert sorted(path.name for path in (here / "out").iterdir()) == ["r-component-1.png", "r-component-2.png"]


def test_a_ratio_asks_for_its_two_lights_alone(here: Path, steps: StandIn, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("restore scan.npz -o out/r.png --light uv --combine ratio:white/uv", capsys)[0] == 0
    assert steps.calls["restore"]["lights"] == ["uv", "white"]
    scan = StandIn().scan_by(BEST, capture(), CALIBRATION, shape=(3, 4), mask=None)
    more = replace(scan, images={**scan.images, "mean": scan.images["uv"], "raking": scan.images["uv"]})
    io.write_scan(more, here / "more.npz")
    assert run("restore more.npz -o out/s.png --combine ratio:white/uv", capsys)[0] == 0
    assert steps.calls["restore"]["lights"] == ["white", "uv"]
    steps.calls.clear()
    wanted = "deskew: `--combine` must give pictures of different names, got several called mean.\n"
    assert run("restore more.npz -o out/t.png -l white -l mean --combine mean", capsys) == (2, "", wanted)
    (here / "out" / "u-uv.png").mkdir()
    code, _, err = run("restore more.npz -o out/u.png -l white -l uv", capsys)
    assert (code, err.count("\n")) == (2, 1)
    assert not steps.calls  # told before the long work
    assert not (here / "out" / "u-white.png").exists()


def test_accuracy_measures_the_page_and_not_the_desk(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    acquisition = importlib.import_module("deskew.acquisition")

    def decoded(page: Capture) -> SimpleNamespace:
        return SimpleNamespace(n=len(list(page.columns)), projector=ProjectorCheck())

    monkeypatch.setattr(deskew, "pipeline", SimpleNamespace(decode=decoded), raising=False)
    z = np.full((8, 12), 9.0)
    z[:, :3] = 5.0  # the desk
    z[4, 6] = 9.5
    depth = DepthMap(z, np.zeros((8, 12), np.uint8), CAMERA)
    corners = np.array([[4.0, 1], [10, 1], [10, 6], [4, 6]])
    monkeypatch.setattr(acquisition, "depth_map", lambda devices, seen, settings: depth)
    monkeypatch.setattr(acquisition, "page_outline", lambda *images, depth: SimpleNamespace(corners=corners))
    code, out, err = run("accuracy page page -c c.json --json", capsys)
    assert (code, err) == (0, "")
    figures = json.loads(out)
    assert [row["capture"] for row in figures["planes"]] == ["page", "page"]
    assert figures["planes"][0]["n"] == 7 * 6
    assert 0.3 < figures["average"]["max_mm"] < 0.5
    assert run("accuracy page -c c.json", capsys)[1].startswith("capture: page\nmean_abs_mm: 0.0")


def test_accuracy_refuses_a_capture_of_another_projector(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    io.write_calibration(replace(CALIBRATION, projector=CAMERA), here / "c.json")
    wanted = "deskew: `capture.projector_size` must equal calibration.projector.size (12, 8), got (6, 5).\n"
    assert run("accuracy page -c c.json", capsys) == (2, "", wanted)


@pytest.mark.parametrize("line", ["scan page -c c.json -o out/s.npz", "run page -c c.json -o out/r.png"])
def test_a_faulty_projector_is_said_on_stderr_and_in_the_figures(
    here: Path, steps: StandIn, capsys: pytest.CaptureFixture[str], line: str
) -> None:
    steps.check = ProjectorCheck(("The fringes are no sines.", "Out of step."), gamma=1.4, stray=0.2)
    code, out, err = run(f"{line} --json", capsys)
    figures = json.loads(out)
    assert (code, figures["projector_gamma"], figures["projector_stray"]) == (0, 1.4, 0.2)
    assert figures["projector_faults"] == list(steps.check.faults)
    assert err == "".join(f"deskew: warning: page: {fault}\n" for fault in steps.check.faults)
    steps.check = ProjectorCheck(stray=0.001)
    code, out, err = run(f"{line.replace('out/', 'out/2')} --json", capsys)
    assert (code, json.loads(out)["projector_faults"], err) == (0, [], "")


def test_calibrate_says_which_pose_shows_a_faulty_projector(
    here: Path, steps: StandIn, capsys: pytest.CaptureFixture[str]
) -> None:
    steps.check = ProjectorCheck(("Out of step.",), stray=0.2)
    code, out, err = run("calibrate board -o out/c.json --json", capsys)
    assert (code, json.loads(out)["projector_faults_in"]) == (0, ["pose_00", "pose_01"])
    assert err == "deskew: warning: pose 00: Out of step.\ndeskew: warning: pose 01: Out of step.\n"


@pytest.mark.parametrize("status", [Status.LOCKED, Status.FOLDED])
def test_a_page_that_is_not_flat_is_shown_and_said_so(
    here: Path, steps: StandIn, capsys: pytest.CaptureFixture[str], status: Status
) -> None:
    steps.status = status
    code, out, err = run("run page -c c.json -o out/r.png --json", capsys)
    assert (code, json.loads(out)["status"]) == (0, status)
    assert err == f"deskew: warning: the page is {status}, not at rest and flat: push harder\n"
    assert (here / "out" / "r.png").exists()


@pytest.mark.parametrize(
    ("step", "line"),
    [
        ("calibrate", "calibrate board -o out/c.json"),
        ("scan", "scan page -c c.json -o out/s.npz"),
        ("scan", "run page -c c.json -o out/r.png"),
        ("restore", "restore scan.npz -o out/r.png"),
    ],
)
def test_a_failed_step_is_one_line_and_code_3(
    here: Path, steps: StandIn, capsys: pytest.CaptureFixture[str], step: str, line: str
) -> None:
    steps.fails = step
    assert run(line, capsys) == (3, "", f"deskew: {step} found no page: put it on a darker desk.\n")
    assert list((here / "out").iterdir()) == []


def test_an_error_of_several_lines_is_said_in_one(
    here: Path, steps: StandIn, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*args: Any, **kwargs: Any) -> Scan:
        raise StepError("Scanning failed:\n  no light\x1b[2J in the picture.")

    monkeypatch.setattr(steps, "scan_by", fail)
    wanted = "deskew: Scanning failed: no light?[2J in the picture.\n"
    assert run("run page -c c.json -o out/r.png", capsys) == (3, "", wanted)


WRONG_LINES = {
    "nothing": ("", "Missing command."),
    "unknown command": ("scna page", "No such command 'scna'"),
    "unknown option": ("scan page -c c.json -o out/s.npz --fast", "No such option: --fast"),
    "unknown option of the program": ("--verbose scan", "No such option: --verbose"),
    "no capture": ("scan -c c.json -o out/s.npz", "Missing argument 'CAPTURE'"),
    "no calibration": ("run page -o out/r.png", "Missing option '--calibration'"),
    "no output": ("run page -c c.json", "Missing option '--output'"),
    "no planes": ("accuracy -c c.json", "Missing argument 'CAPTURE...'"),
    "two captures of one name": ("run page page -c c.json -o out", "`CAPTURE...` must be folders of different names"),
    "two captures, one picture": ("run page board -c c.json -o out/r.png/s", "`out/r.png/s` must be a folder, for"),
    "shape of one": ("run page -c c.json -o out/r.png --shape 45", "'--shape' requires 2 arguments"),
    "shape of words": ("run page -c c.json -o out/r.png --shape 45 x", "Invalid value for '--shape'"),
    "shape of fractions": ("run page -c c.json -o out/r.png --shape 4.5 4", "Invalid value for '--shape'"),
    "ratio of one": ("restore scan.npz -o out/r.png --combine ratio:uv/uv", "two different lights"),
    "mask missing": ("scan page -c c.json -o out/s.npz --mask none.png", "none.png"),
    "mask of another size": ("run page -c c.json -o out/r.png --mask small.png", "small.png"),
    "mask of nothing": ("run page -c c.json -o out/r.png --mask dark.png", "`--mask` must show the page"),
    "shape 1": ("run page -c c.json -o out/r.png --shape 1 45", "`--shape` must be 2 to 1000 vertices down and across"),
    "shape endless": ("run page -c c.json -o out/r.png --shape 1000000 3", "`--shape` must be 2 to 1000 vertices"),
    "shape negative": ("scan page -c c.json -o out/s.npz --shape -4 -4", "`--shape` must be 2 to 1000"),
    "no such capture": ("scan gone -c c.json -o out/s.npz", "`gone` must be a folder, got nothing there"),
    "capture a file": ("scan c.json -c c.json -o out/s.npz", "`c.json` must be a folder, got a file"),
    "board for capture": ("scan board -c c.json -o out/s.npz", "`board/capture.toml` must be a file"),
    "capture for board": ("calibrate page -o out/c.json", "`page/board.toml` must be a file"),
    "no such calibration": ("scan page -c gone.json -o out/s.npz", "`gone.json` must be a file, got nothing there"),
    "calibration a folder": ("scan page -c board -o out/s.npz", "`board` must be a file, got a folder"),
    "image for calibration": ("scan page -c page/white.png -o out/s.npz", "`page/white.png` must be valid JSON"),
    "toml for calibration": ("scan page -c page/capture.toml -o out/s.npz", "must be valid JSON"),
    "image for scan": ("restore page/white.png -o out/r.png", "`page/white.png` must be a whole NPZ file"),
    "no such scan": ("restore gone.npz -o out/r.png", "`gone.npz` must be a file, got nothing there"),
    "unknown light": ("run page -c c.json -o out/r.png --light ir", "`--light` must be one of white, uv, got ir"),
    "unknown light of a scan": ("restore scan.npz -o out/r.png -l ir", "`--light` must be one of white, uv, got ir"),
    "unknown combination": ("run page -c c.json -o out/r.png --combine sum", "`combine` must be one of mean, max"),
    "ratio by no light": ("restore scan.npz -o out/r.png --combine ratio:uv/ir", "must name two of white, uv, got ir"),
    "mean of one light": ("restore scan.npz -o out/r.png -l uv --combine mean", "must be of at least 2 lights"),
    "scale 0": ("restore scan.npz -o out/r.png --scale 0", "`--scale` must lie in (0, 16], got 0.0"),
    "output a JPEG": ("run page -c c.json -o out/r.jpg", "`out/r.jpg` must end in .png or .tif or .tiff, got .jpg"),
    "output without suffix": ("calibrate board -o out/c", "`out/c` must end in .json, got no suffix"),
    "output in no folder": ("scan page -c c.json -o no/s.npz", "`no/s.npz` must lie in an existing folder"),
    "output under a file": ("scan page -c c.json -o c.json/s.npz", "must lie in an existing folder"),
    "output a folder": ("calibrate board -o out/d.json", "`out/d.json` must be a file name, got a folder"),
}  # fmt: skip


@pytest.mark.parametrize("case", list(WRONG_LINES))
def test_a_wrong_line_is_one_line_and_code_2(
    here: Path, steps: StandIn, capsys: pytest.CaptureFixture[str], case: str
) -> None:
    (here / "out" / "d.json").mkdir()
    line, message = WRONG_LINES[case]
    code, out, err = run(line, capsys)
    assert (code, out) == (2, "")
    assert err.startswith("deskew: ")
    assert message in err
    assert err.count("\n") == 1
    assert err.endswith("\n")
    assert [p.name for p in (here / "out").rglob("*")] == ["d.json"]
    assert not steps.calls


WRONG_INPUTS: dict[str, tuple[Callable[[Path], object], str]] = {
    "frame missing": (lambda d: (d / "page/gray/04.png").unlink(), "run page -c c.json -o out/r.png"),
    "frame cut": (lambda d: (d / "page/gray/04.png").write_bytes(b"\x89PNG\r\n"), "scan page -c c.json -o out/s.npz"),
    "name with line breaks": (lambda d: (d / "page/gray/a\nb\x1b[2J.png").touch(), "scan page -c c.json -o out/s.ply"),
    "pose damaged": (lambda d: (d / "board/pose_01/white.png").write_bytes(b"x"), "calibrate board -o out/c.json"),
    "second plane missing": (lambda d: (d / "c.json").write_text("{}"), "accuracy page gone -c c.json"),
    "scan damaged": (lambda d: (d / "scan.npz").write_bytes(b"PK\3\4" + bytes(99)), "restore scan.npz -o out/r.png"),
}  # fmt: skip


@pytest.mark.parametrize("case", list(WRONG_INPUTS))
def test_a_wrong_input_is_one_line_and_code_2(
    here: Path, steps: StandIn, capfd: pytest.CaptureFixture[str], case: str
) -> None:
    break_it, line = WRONG_INPUTS[case]
    break_it(here)
    code = main(line.split())
    printed = capfd.readouterr()
    assert (code, printed.out, printed.err.count("\n")) == (2, "", 1)
    assert printed.err.startswith("deskew: `")
    assert printed.err.rstrip("\n").isprintable()
    assert list((here / "out").iterdir()) == []


@pytest.mark.parametrize("error", [OSError(5, "Input/output error"), MemoryError()])
def test_a_failing_machine_is_one_line_and_code_3(
    here: Path, steps: StandIn, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    def fail(*args: Any, **kwargs: Any) -> Scan:
        raise error

    monkeypatch.setattr(steps, "scan_by", fail)
    code, out, err = run("run page -c c.json -o out/r.png", capsys)
    assert (code, out, err.count("\n")) == (3, "", 1)
    assert err.startswith("deskew: The system refused: ")
    assert list((here / "out").iterdir()) == []


def test_an_interrupt_leaves_nothing(
    here: Path, steps: StandIn, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def stop(*args: Any, **kwargs: Any) -> Scan:
        raise KeyboardInterrupt

    monkeypatch.setattr(steps, "scan_by", stop)
    assert run("run page -c c.json -o out/r.png", capsys)[0] == 130
    assert list((here / "out").iterdir()) == []


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_shows_an_example(capsys: pytest.CaptureFixture[str], command: str) -> None:
    code, out, err = run(f"{command} --help", capsys)
    assert (code, err) == (0, "")
    assert f"Example: deskew {command} " in " ".join(out.split())


def test_help_loads_no_stage_and_lists_the_commands() -> None:
    """In a process of its own, by the module's name: what a user waits for when she asks for help."""
    code = (
        "import sys, runpy\n"
        "sys.argv = ['deskew', '--help']\n"
        "try: runpy.run_module('deskew', run_name='__main__')\n"
        "except SystemExit as end: code = end.code\n"
        "slow = {'numba', 'cv2', 'scipy', 'trimesh'} & set(sys.modules)\n"
        "sys.exit(f'{slow}' if slow else code)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")
    assert all(f"\n  {command} " in done.stdout for command in COMMANDS)


def test_the_module_ends_with_the_exit_code() -> None:
    line = [sys.executable, "-m", "deskew", "scan", "nowhere", "-c", "c.json", "-o", "s.npz"]
    done = subprocess.run(line, capture_output=True, text=True, check=False, timeout=60)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "deskew: `c.json` must be a file, got nothing there.\n"


def test_figures_that_nobody_takes_are_one_line_that_says_what_was_written(here: Path) -> None:
    program = (
        "import sys; from deskew.cli import main, restoring\n"
        "def restore(found, method, wanted, settings):\n"
        "    wanted.output.touch(); return {}, [wanted.output]\n"
        "restoring.restore_page = restore\n"
        "sys.exit(main(['restore', 'scan.npz', '-o', 'out/r.png']))\n"
    )
    with Path("/dev/full").open("w") as full:
        line = [sys.executable, "-c", program]
        done = subprocess.run(line, stdout=full, stderr=subprocess.PIPE, text=True, check=False, timeout=60)
    wanted = "deskew: Printing the figures failed: No space left on device; `out/r.png` is written and whole.\n"
    assert (done.returncode, done.stderr) == (3, wanted)


def test_an_interrupt_during_the_imports_is_one_line_and_code_130() -> None:
    program = (
        "import sys, runpy\n"
        "class Stop:\n"
        "    def find_spec(self, name, *rest):\n"
        "        if name == 'typer': raise KeyboardInterrupt\n"
        "sys.meta_path.insert(0, Stop())\n"
        "runpy.run_module('deskew', run_name='__main__')\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "deskew: interrupted; nothing was written.\n")

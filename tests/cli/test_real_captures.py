"""The commands on whole capture folders of odd sizes, as a camera and a projector leave them: nothing stands in."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageCms

import data_synth as ds
from data_synth.captures import scaled
from deskew import acquisition, io, metrics, restoration
from deskew.cli import main
from deskew.projection import onto_bed, project
from deskew.types import Array, PatternKind
from tests.cli.conftest import Command

PAGE_MM = (231.0, 176.0)
PAGE = ds.Checkerboard(PAGE_MM, (7, 5), 31.0)
PLANE_MM = (200.0, 150.0)


_SRGB = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
PROFILE = _SRGB[:16] + b"GRAY" + _SRGB[20:]  # another program's, made into one of a grey picture


@dataclass(frozen=True)
class Folder:
    """A calibrated rig's captures on disk, and the flat page as the same camera sees it."""

    path: Path
    pattern: PatternKind
    control: Array

    def mean_error_mm(self, image: Array) -> float:
        """Distance of the page's corners in an undistorted view from exact squares, after a rigid fit."""
        camera = io.read_calibration(self.path / "c.json").camera
        view = restoration.view_camera(camera)
        exact = (PAGE.corners.reshape(-1, 2) - np.array(PAGE_MM) / 2) * [1.0, -1.0]
        seeds = project(view, np.column_stack([exact, np.zeros(len(exact))]))
        control = acquisition.refine_saddle(restoration.undistorted_view(self.control, camera), seeds)
        found = onto_bed(view, acquisition.refine_saddle(image, control, search_px=6.0))[:, :2]
        assert np.isfinite(found).all()
        return float(np.linalg.norm(metrics.fit_rigid(found, exact).apply(found) - exact, axis=1).mean())


@pytest.fixture(scope="module", params=[PatternKind.GRAY_CODE, PatternKind.LINE_SWEEP], ids=str)
def folder(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Folder:
    """Camera 181 x 136, projector 290 x 217, a texture of 236 x 169: no size is another's multiple."""
    path, pattern = tmp_path_factory.mktemp("captures"), request.param
    rig = scaled(ds.default_rig(), 0.283)
    if pattern is PatternKind.GRAY_CODE:
        rig = replace(rig, config=replace(rig.config, exposures=2))  # 16 bits
    assert (rig.camera.size, rig.projector.size) == ((181, 136), (290, 217))
    fine = ds.Format((236, 169), (1.25, 1.18), (3.2, 4.1))
    uv, above = ds.standard_lights()[2], replace(ds.standard_lights(fine)[0], name="above")
    rng = np.random.default_rng(5)
    sheet = ds.crumpled(rng, PAGE_MM, 25.0)
    page = ds.photograph(rig, sheet, PAGE, rng, pattern, lights=(uv, above))
    io.write_capture(replace(page, profiles={"white": PROFILE, "above": PROFILE}), path / "page")
    tilted = ds.plane(PLANE_MM, tilt_deg=9.0, azimuth_deg=40.0)
    io.write_capture(ds.photograph(rig, tilted, ds.Blank(PLANE_MM), rng, pattern), path / "plane")
    boards = (ds.render_board(rig, pose, rng, pattern=pattern) for pose in ds.board_poses(3))
    io.write_board(ds.BOARD, boards, path / "board")
    assert main(f"calibrate {path}/board -o {path}/c.json --json".split()) == 0
    assert main(f"run {path}/page -c {path}/c.json -o {path}/r.png --light all --combine mean --json".split()) == 0
    return Folder(path, pattern, ds.photograph(rig, ds.flat_sheet(PAGE_MM), PAGE, rng, pattern).white)


def test_a_folder_becomes_a_restored_page_under_every_light(folder: Folder) -> None:
    here = folder.path
    names = ["white", "uv", "above", "mean"]
    assert sorted(p.name for p in here.glob("r-*")) == sorted(f"r-{name}.png" for name in names)
    raw = io.read_image(here / "page" / "white.png")
    camera = io.read_calibration(here / "c.json").camera
    assert folder.mean_error_mm(restoration.undistorted_view(raw, camera)) > 0.5
    assert 0.05 < folder.mean_error_mm(io.read_image(here / "r-white.png")) < 0.3
    for name in names:
        # Pillow as the outside reader. 1.68 mm a pixel on the bed: 640 px of 0.475 mm are 181 here.
        with Image.open(here / f"r-{name}.png") as picture:
            assert picture.mode == {np.uint8: "L", np.uint16: "I;16"}[raw.dtype.type]
            assert picture.info["dpi"] == pytest.approx([25.4 / (0.475 * 640 / 181)] * 2, rel=0.01)
            assert picture.info.get("icc_profile") == (PROFILE if name in ("white", "above") else None)


def test_a_scan_that_is_kept_gives_the_same_pages_later(deskew: Command, folder: Folder) -> None:
    here = folder.path
    assert deskew(f"scan {here}/page -c {here}/c.json -o {here}/s.npz --json")[0] == 0
    assert deskew(f"restore {here}/s.npz -o {here}/r2.png --light all --combine mean --json")[0] == 0
    for name in ("white", "uv", "above", "mean"):
        assert (here / f"r2-{name}.png").read_bytes() == (here / f"r-{name}.png").read_bytes()


def test_a_model_carries_its_picture_and_the_accuracy_of_its_scanner(deskew: Command, folder: Folder) -> None:
    here = folder.path
    code, out, err = deskew(f"accuracy {here}/plane -c {here}/c.json -o {here}/a.json --json")
    assert (code, err) == (0, "")
    assert json.loads(out) == json.loads((here / "a.json").read_text())
    # Quarter the pixels across, four times the error of full size, 0.02 mm; section 2.5 reports 0.25 to 0.5 mm.
    assert 0.02 < json.loads(out)["average"]["mean_abs_mm"] < 0.15
    suffix = "ply" if folder.pattern is PatternKind.GRAY_CODE else "obj"
    line = f"scan {here}/page -c {here}/c.json -o {here}/p.{suffix} --accuracy {here}/a.json --shape 9 12 --json"
    code, out, err = deskew(line)
    assert (code, err) == (0, "")
    beside = json.loads((here / "p.json").read_text())
    assert beside == {**json.loads(out), "unit": "mm", "accuracy": json.loads((here / "a.json").read_text())}
    assert len(io.read_mesh(here / f"p.{suffix}").vertices) == 9 * 12
    assert np.array_equal(io.read_image(here / "p-white.png"), io.read_image(here / "page" / "white.png"))
    (here / "other.json").write_bytes((here / "c.json").read_bytes() + b"\n")
    code, _, err = deskew(f"scan {here}/page -c {here}/other.json -o {here}/q.ply --accuracy {here}/a.json")
    wanted = f"`{here}/a.json` must be of the calibration {here}/other.json, got a record of another one."
    assert (code, err) == (2, f"deskew: {wanted}\n")
    assert not (here / "q.ply").exists()


def test_a_board_left_out_tells_lengths_as_well(deskew: Command, folder: Folder) -> None:
    here = folder.path
    code, out, err = deskew(f"accuracy {here}/board/pose_01 --board {here}/board -c {here}/c.json --radius 6 --json")
    assert (code, err) == (0, "")
    (row,) = json.loads(out)["planes"]
    assert 30 <= row["n"] <= 88  # corners; a square has 9 px here, and a Gray code leaves the edges of ink out
    assert 0.005 < row["length_error_mm"] < 0.3
    assert 0.003 < row["mean_abs_mm"] < 0.2
    assert 0.2 < row["depth_coverage"] <= 1.0

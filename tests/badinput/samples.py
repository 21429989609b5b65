"""Small valid files of every kind that the project reads: what the corpus breaks and the fuzzer begins from."""

from __future__ import annotations

import json
import struct
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

import data_synth
from deskew import io
from deskew.types import (
    Array,
    Board,
    Calibration,
    Capture,
    DepthMap,
    Fringe,
    PatternKind,
    Pinhole,
    Scan,
    Sheet,
    n_frames,
)

SIZE = (24, 16)
PROJECTOR = (8, 7)
PAGE_MM = data_synth.PAGE_SIZE_MM
TABLE = """experiment,condition,method,trial,seed,metric,value,unit
surfaces,flattened/cone,arap,0,1,flat_mean_mm,0.25,mm
surfaces,flattened/cone,spring,0,1,flips,0.0,1
"""
FLOORS = """experiment,condition,method,metric,unit,draws,run_sd,page_sd
surfaces,flattened/cone,arap,flat_mean_mm,mm,10,0.01,0.02
"""
SEEDS = f"salt {'0' * 64}\n123456\n"


def pixels(seed: int, size: tuple[int, int] = SIZE, channels: int = 0, dtype: type = np.uint8) -> Array:
    """A picture of noise, no two alike."""
    shape = (size[1], size[0], channels) if channels else (size[1], size[0])
    return np.random.default_rng(seed).integers(0, np.iinfo(dtype).max, shape, dtype=dtype, endpoint=True)


def camera() -> Pinhole:
    """A camera 9 mm above the bed."""
    K = np.array([[10.0, 0, 5.5], [0, 10, 3.5], [0, 0, 1]])
    return Pinhole(SIZE, K, np.zeros(5), np.diag([1.0, -1.0, -1.0]), np.array([0, 0, 9.0]))


def calibration() -> Calibration:
    """Both devices, for `page` and `sweep`."""
    K = np.array([[20.0, 0, 2.5], [0, 20, 2.0], [0, 0, 1]])
    projector = Pinhole(PROJECTOR, K, np.zeros(5), np.diag([1.0, -1.0, -1.0]), np.array([1.0, 0, 9.0]))
    residuals = {"camera_rms_px": 0.1, "projector_rms_px": 0.2, "stereo_rms_px": 0.3}
    return Calibration(camera(), projector, residuals, {"camera_fx_px": 0.5}, 2, "mm", 0.8, {"steps": 4.0})


def capture(pattern: PatternKind = PatternKind.GRAY_CODE, seed: int = 0) -> Capture:
    """A capture of noise with one light."""
    fringes = {PatternKind.GRAY_PHASE: (Fringe(4.0, 5),)}.get(pattern, ())
    counts = [n_frames(pattern, extent, fringes) for extent in PROJECTOR]
    planes = [pixels(100 * seed + i) for i in range(2 + sum(counts))]
    columns, rows = planes[2 : 2 + counts[0]], planes[2 + counts[0] :]
    return Capture(planes[0], planes[1], PROJECTOR, pattern, columns, rows, {"uv": pixels(99, (9, 7), 3)}, fringes)


def icc_profile() -> bytes:
    """The header of an RGB profile and nothing else."""
    head = bytearray(struct.pack(">I", 132) + bytes(128))
    head[16:20], head[36:40] = b"RGB ", b"acsp"
    return bytes(head)


def scan() -> Scan:
    """A flat page, with stiffness and a cut."""
    reason = np.zeros(SIZE[::-1], np.uint8)
    reason[0, :3] = 1
    depth = DepthMap(np.where(reason == 0, 9.0, np.nan), reason, camera())
    x, y = np.meshgrid(np.linspace(-3, 3, 4), np.linspace(2, -2, 3))
    sheet = Sheet(np.stack([x, y, 0 * x], -1), stiffness=np.full((2, 3), 30.0), cut=np.eye(2, 3) > 0)
    return Scan({"white": pixels(1), "uv": pixels(2)}, depth, camera(), sheet, np.eye(4, 2), filled_fraction=0.1)


def mesh(rows: int = 5, columns: int = 6) -> io.Mesh:
    """A page bent round a cylinder, its texture coordinates the true flat places [mm]."""
    s, y = (axis.ravel() for axis in np.meshgrid(np.linspace(0, 40, columns), np.linspace(0, -30, rows)))
    bent = np.stack([25 * np.sin(s / 25 - 0.8), y, 25 * np.cos(s / 25 - 0.8)], axis=-1)
    return io.Mesh(bent, io.grid_faces(rows, columns), np.stack([s, y], axis=-1))


def unit_mesh() -> io.Mesh:
    """The same with texture coordinates in [0, 1], as a stiffness map asks."""
    bent = mesh()
    assert bent.texture is not None
    return io.Mesh(bent.vertices, bent.faces, (bent.texture - bent.texture.min(0)) / np.ptp(bent.texture, axis=0))


def sheet_arrays() -> dict[str, Array]:
    """A flat sheet of the rig's page."""
    x, y = np.meshgrid(np.linspace(0, PAGE_MM[0], 4), np.linspace(0, PAGE_MM[1], 5))
    return {"V": np.stack([x - PAGE_MM[0] / 2, PAGE_MM[1] / 2 - y, 0 * x], -1), "F": np.stack([x, y], -1)}


def write_samples(folder: Path) -> None:
    """Fill a folder with one valid input of every kind.

    Parameters
    ----------
    folder : Path
        Empty. Gets `page` (Gray code), `sweep`, `phase`, `board`, `c.json`, `scan.npz`, `depth.npz`, `bent.obj`,
        `bent.ply`, `unit.obj`, `segment`, `materials.png` and `.toml`, `mask.png`, `grey.png`, `colour.png`,
        `deep.tif`, `profiled.png`, `sheet.npz`, `reports/NAME/results.csv`, `seeds.txt`, `photograph.jpg`,
        `words.json`, `baseline.csv`, `.json` and `.floors.csv`, `map.draft.npz` and an empty folder `out`.
    """
    io.write_capture(capture(), folder / "page")
    io.write_capture(capture(PatternKind.LINE_SWEEP, 1), folder / "sweep")
    io.write_capture(capture(PatternKind.GRAY_PHASE, 2), folder / "phase")
    io.write_board(Board((5, 4), 25.0), [capture(seed=3), capture(seed=4), capture(seed=5)], folder / "board")
    io.write_calibration(calibration(), folder / "c.json")
    io.write_scan(scan(), folder / "scan.npz")
    io.write_depth(scan().depth, folder / "depth.npz")
    for name, made in (("bent.obj", mesh()), ("bent.ply", mesh()), ("unit.obj", unit_mesh())):
        io.write_mesh(made, folder / name)
    (folder / "segment").mkdir()
    for axis, plane in zip("xyz", np.moveaxis(mesh().vertices.reshape(5, 6, 3), -1, 0), strict=True):
        io.write_depth(_depth_of(plane), folder / "segment" / f"{axis}.tif")
    (folder / "segment" / "meta.json").write_text('{"format": "tifxyz", "scale": [0.05, 0.05]}\n')
    for name, image in (
        ("materials", 255 * (np.arange(24 * 16).reshape(16, 24) % 2).astype(np.uint8)),
        ("mask", np.full(SIZE[::-1], 255, np.uint8)),
        ("grey", pixels(3, (64, 48))),
        ("colour", pixels(4, (64, 48), 3)),
    ):
        io.write_image(image, folder / f"{name}.png")
    io.write_image(pixels(5, (64, 48), dtype=np.uint16), folder / "deep.tif")
    io.write_image(pixels(8, (64, 48), 3), folder / "profiled.png", profile=icc_profile(), dpi=(300.0, 300.0))
    (folder / "materials.toml").write_text("[stiffness]\n0 = 30.0\n255 = 0.3\n")
    io.write_arrays(sheet_arrays(), folder / "sheet.npz")
    for report in ("surfaces", "corner_distance"):
        (folder / "reports" / report).mkdir(parents=True)
        (folder / "reports" / report / "results.csv").write_text(TABLE)
    _write_baseline(folder)
    table = np.frombuffer(b'[[0, "paper", 30.0], [255, "vellum", 0.3]]', np.uint8)
    io.write_arrays({"labels": pixels(7).astype(np.uint16) // 128 * 255, "materials": table}, folder / "map.draft.npz")
    (folder / "seeds.txt").write_text(SEEDS)
    (folder / "photograph.jpg").write_bytes(cv2.imencode(".jpg", pixels(6, (64, 48), 3))[1].tobytes())
    (folder / "words.json").write_text('[{"text": "Invoice"}, {"text": "2001", "box": [1, 2]}]')
    (folder / "out").mkdir()


def _write_baseline(folder: Path) -> None:
    """Write `baseline.csv` of the gate with what lies beside it, and what a page of the reports needs."""
    (folder / "baseline.csv").write_text(TABLE)
    settings = [{"experiment": "surfaces", "seed": 1, "method": ["arap", "spring"]}]
    about = {"version": 1, "runs": [["experiment=surfaces", "trials=1"]], "settings": settings}
    (folder / "baseline.json").write_text(json.dumps(about, indent=1))
    (folder / "baseline.floors.csv").write_text(FLOORS)
    run = {"commit": "0" * 40, "config": {"seed": 1}, "experiment": "surfaces", "machine": {}, "versions": {}}
    failure = {"condition": "flattened/cone", "method": "arap", "trial": 0, "seed": 1, "reason": "none"}
    (folder / "reports" / "surfaces" / "run.json").write_text(json.dumps({**run, "failures": [failure]}, indent=1))


def _depth_of(plane: Array) -> DepthMap:
    device = camera()
    sized = Pinhole((plane.shape[1], plane.shape[0]), device.K, device.distortion, device.R, device.t)
    return DepthMap(plane, np.zeros(plane.shape, np.uint8), sized)


def write_rendered(folder: Path) -> None:
    """Write `rendered`, a Gray-code capture of a crumpled page, `rendered.json`, its calibration, and `whole.png`."""
    rig = data_synth.default_rig()
    rig = replace(rig, camera=_smaller(rig.camera, 4), projector=_smaller(rig.projector, 4))
    rng = np.random.default_rng(3)
    sheet = data_synth.crumpled(rng, slope_p90_deg=10.0)
    seen = data_synth.photograph(rig, sheet, data_synth.Checkerboard(), rng, PatternKind.GRAY_CODE)
    io.write_capture(seen, folder / "rendered")
    io.write_calibration(replace(calibration(), camera=rig.camera, projector=rig.projector), folder / "rendered.json")
    mask = np.zeros(seen.white.shape[:2], np.uint8)
    mask[30:90, 50:110] = 255
    io.write_image(mask, folder / "whole.png")


def _smaller(device: Pinhole, factor: int) -> Pinhole:
    """The same view with fewer pixels."""
    K = device.K.copy()
    K[:2, 2] = (K[:2, 2] + 0.5) / factor - 0.5
    K[[0, 0, 1], [0, 1, 1]] /= factor
    return replace(device, size=(device.size[0] // factor, device.size[1] // factor), K=K)

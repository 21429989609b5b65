from __future__ import annotations

import io
import tracemalloc
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from deskew.errors import InputError
from deskew.io import read_depth, read_depth_image, read_scan, write_depth, write_scan
from deskew.io.arrays import read_arrays, write_arrays
from deskew.types import Array, Calibration, DepthMap, Scan, Sheet


@pytest.fixture
def depth(calibration: Calibration) -> DepthMap:
    rng = np.random.default_rng(5)
    reason = rng.integers(0, 3, (8, 12)).astype(np.uint8)
    z = np.where(reason == 0, rng.uniform(700, 900, reason.shape), np.nan)
    return DepthMap(z, reason, replace(calibration.camera, distortion=np.zeros(5)))


@pytest.fixture
def scan(calibration: Calibration, depth: DepthMap) -> Scan:
    rng = np.random.default_rng(6)
    images = {
        "white": rng.integers(0, 255, (8, 12), dtype=np.uint8),
        "raking": rng.integers(0, 65535, (20, 30, 3), dtype=np.uint16),
    }
    surface = rng.normal(size=(7, 10, 3))
    sheet = Sheet(
        surface[::3, ::3],
        stiffness=rng.uniform(1, 2, (2, 3)),
        cut=np.eye(2, 3, dtype=bool),
        surface=surface,
        crease_width=0.7,
    )
    return Scan(images, depth, calibration.camera, sheet, rng.uniform(0, 9, (4, 2)), filled_fraction=0.25)


def repacked(path: Path, change: Callable[[dict[str, Any]], object]) -> None:
    arrays = dict(np.load(path))
    change(arrays)
    np.savez_compressed(path, **arrays)


def test_a_scan_keeps_its_unit_and_its_lights_profiles(tmp_path: Path, scan: Scan) -> None:
    icc = bytearray(range(200))
    icc[:4], icc[16:20], icc[36:40] = (200).to_bytes(4, "big"), b"RGB ", b"acsp"
    write_scan(replace(scan, unit="units", profiles={"raking": bytes(icc)}), tmp_path / "s.npz")
    found = read_scan(tmp_path / "s.npz")
    assert (found.unit, found.profiles) == ("units", {"raking": bytes(icc)})
    for change, message in (
        (lambda arrays: arrays.update(profile_white=arrays["profile_raking"]), "`profile_'white'` must be the ICC"),
        (lambda arrays: arrays.update(unit=np.zeros(3, np.uint8)), "`unit` must be 1 to 64 printable"),
    ):
        write_scan(replace(scan, profiles={"raking": bytes(icc)}), tmp_path / "s.npz")
        repacked(tmp_path / "s.npz", change)
        with pytest.raises(InputError, match=message):
            read_scan(tmp_path / "s.npz")


def test_a_depth_map_survives_exactly(tmp_path: Path, depth: DepthMap) -> None:
    write_depth(depth, tmp_path / "d.npz")
    found = read_depth(tmp_path / "d.npz")
    assert found.z.tobytes() == depth.z.tobytes()
    assert np.array_equal(found.reason, depth.reason)
    assert found.camera.size == depth.camera.size
    assert np.array_equal(found.camera.R, depth.camera.R)


@pytest.mark.parametrize("suffix", [".tif", ".tiff"])
def test_a_depth_tiff_keeps_float32_and_its_gaps(tmp_path: Path, depth: DepthMap, suffix: str) -> None:
    write_depth(depth, tmp_path / f"d{suffix}")
    found = read_depth_image(tmp_path / f"d{suffix}")
    assert found.dtype == np.float32
    assert np.array_equal(np.isnan(found), depth.reason != 0)
    assert 0 < float(np.nanmax(np.abs(found - depth.z))) < 1e-4


def test_a_scan_survives_exactly(tmp_path: Path, scan: Scan) -> None:
    write_scan(scan, tmp_path / "s.npz")
    found = read_scan(tmp_path / "s.npz")
    assert set(found.images) == {"white", "raking"}
    for light, image in scan.images.items():
        assert found.images[light].dtype == image.dtype
        assert np.array_equal(found.images[light], image)
    assert found.sheet.vertices.tobytes() == scan.sheet.vertices.tobytes()
    assert found.sheet.cut is not None
    assert np.array_equal(found.sheet.cut, np.eye(2, 3, dtype=bool))
    assert np.array_equal(found.sheet.surface, scan.sheet.surface)
    assert (found.sheet.refinement, found.sheet.crease_width) == (3, 0.7)
    assert found.filled_fraction == scan.filled_fraction == 0.25
    assert found.sheet.stiffness is not None
    assert found.sheet.stiffness.tobytes() == scan.sheet.stiffness.tobytes()  # type: ignore[union-attr]
    assert found.camera.distortion.tobytes() == scan.camera.distortion.tobytes()
    assert found.outline.tobytes() == scan.outline.tobytes()
    assert found.depth.z.tobytes() == scan.depth.z.tobytes()


def test_a_scan_without_a_surface_has_none_when_read(tmp_path: Path, scan: Scan) -> None:
    write_scan(replace(scan, sheet=Sheet(scan.sheet.vertices)), tmp_path / "s.npz")
    found = read_scan(tmp_path / "s.npz").sheet
    assert found.surface is None
    assert (found.refinement, found.crease_width) == (1, 0.0)


def test_a_surface_that_is_not_the_grids_is_refused_by_name(tmp_path: Path, scan: Scan) -> None:
    write_scan(scan, tmp_path / "s.npz")
    repacked(tmp_path / "s.npz", lambda arrays: arrays.update(sheet_surface=arrays["sheet_surface"] + 1.0))
    with pytest.raises(InputError, match="`surface` must hold the grid as every 3-th of its vertices"):
        read_scan(tmp_path / "s.npz")


def test_the_same_scan_gives_the_same_bytes(tmp_path: Path, scan: Scan) -> None:
    write_scan(scan, tmp_path / "a.npz")
    write_scan(scan, tmp_path / "b.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


WRONG: dict[str, tuple[Callable[[dict[str, Any]], object], str]] = {
    "no depth": (lambda a: a.pop("depth_z"), "must hold the arrays .*depth_z"),
    "no white": (lambda a: a.pop("image_white"), "must hold the arrays .*image_white"),
    "later version": (lambda a: a.update(version=np.array(9)), "version` must be 1, got 9"),
    "depth of a row": (
        lambda a: a.update(depth_z=np.zeros(12)),
        r"depth_z` must have shape \('any', 'any'\), got \(12,\)",
    ),
    "depth of another size": (lambda a: a.update(depth_z=np.zeros((9, 12))), "`z` must have the camera's shape"),
    "depth and reason at odds": (lambda a: a["depth_reason"].fill(1), "`z` must be finite exactly where reason is 0"),
    "unknown reason": (lambda a: a["depth_reason"].fill(99), r"depth_reason` must be uint8 in \[0, 7\]"),
    "reason of floats": (lambda a: a.update(depth_reason=a["depth_z"]), "depth_reason` must be uint8"),
    "camera NaN": (lambda a: a["camera_K"].fill(np.nan), "`K` must be finite"),
    "camera of 4x4": (lambda a: a.update(camera_K=np.eye(4)), r"camera_K` must have shape \(3, 3\)"),
    "white of another size": (lambda a: a.update(image_white=np.zeros((9, 9), np.uint8)), "have the camera's size"),
    "white of floats": (lambda a: a.update(image_white=np.zeros((8, 12))), "image_white` must have 8 or 16 bits"),
    "sheet NaN": (lambda a: a["sheet_vertices"].fill(np.nan), "`vertices` must be finite"),
    "sheet of one row": (lambda a: a.update(sheet_vertices=np.zeros((1, 4, 3))), "R, C >= 2"),
    "filled more than all": (lambda a: a["filled_fraction"].fill(1.5), r"`filled_fraction` must be in \[0, 1\]"),
    "camera of half pixels": (
        lambda a: a.update(camera_size=np.array([12.5, 8])),
        "camera_size` must be whole numbers",
    ),
    "camera of no size": (lambda a: a.update(camera_size=np.array([np.nan, 8])), "camera_size` must be whole numbers"),
    "light with a slash": (lambda a: a.update({"image_x/y": a["image_white"]}), "image_LIGHT` must name its light"),
    "light without a name": (lambda a: a.update({"image_": a["image_white"]}), "image_LIGHT` must name its light"),
    "stiffness negative": (lambda a: a["sheet_stiffness"].fill(-1), r"`stiffness` must be in \[1e-09, 1e\+12\]"),
    "outline of three": (lambda a: a.update(outline=np.zeros((3, 2))), r"outline` must have shape \(4, 2\)"),
    "outline NaN": (lambda a: a["outline"].fill(np.nan), "`outline` must be finite"),
}


@pytest.mark.parametrize("case", list(WRONG))
def test_a_wrong_scan_is_refused(tmp_path: Path, scan: Scan, case: str) -> None:
    path = tmp_path / "s.npz"
    write_scan(scan, path)
    change, message = WRONG[case]
    repacked(path, change)
    with pytest.raises(InputError, match=rf"s\.npz.*{message}"):
        read_scan(path)


def test_a_depth_map_file_is_no_scan(tmp_path: Path, depth: DepthMap) -> None:
    write_depth(depth, tmp_path / "d.npz")
    with pytest.raises(InputError, match=r"d\.npz` must hold the arrays"):
        read_scan(tmp_path / "d.npz")


def test_nothing_is_ever_unpickled(tmp_path: Path) -> None:
    ran = []

    class Bomb:
        def __reduce__(self) -> tuple[Any, tuple[int]]:
            return ran.append, (1,)

    np.savez(tmp_path / "a.npz", x=np.array([Bomb()], dtype=object), allow_pickle=True)
    with pytest.raises(InputError, match=r"a\.npz.*must (hold numbers|be a whole NPZ)"):
        read_arrays(tmp_path / "a.npz")
    assert ran == []


def lying_header() -> bytes:
    """An array of 8 bytes that declares 80 GB."""
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(stream, {"descr": "<f8", "fortran_order": False, "shape": (10**10,)})
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr("x.npy", stream.getvalue() + bytes(8))
    return packed.getvalue()


def zeros(n_bytes: int) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("x.npy", "w") as stream:
        for _ in range(n_bytes >> 20):
            stream.write(bytes(1 << 20))
    return packed.getvalue()


def test_an_array_that_declares_more_than_it_holds_costs_no_memory(tmp_path: Path) -> None:
    (tmp_path / "a.npz").write_bytes(lying_header())
    tracemalloc.start()
    with pytest.raises(InputError, match="x'` must hold 80000000000 bytes as its header says"):
        read_arrays(tmp_path / "a.npz")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 1 << 20


def test_a_zip_bomb_is_refused_unopened(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("deskew.io.arrays.MAX_ARRAY_BYTES", 7 << 20)
    (tmp_path / "a.npz").write_bytes(zeros(8 << 20))
    with pytest.raises(InputError, match="must unpack to at most 7340032 bytes, got 8388608"):
        read_arrays(tmp_path / "a.npz")


@pytest.mark.parametrize("content", [b"", b"PK\3\4", b"not a zip at all", lying_header()[:-30]])
def test_what_is_no_npz_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.npz").write_bytes(content)
    with pytest.raises(InputError, match=r"a\.npz` must be a whole NPZ file"):
        read_arrays(tmp_path / "a.npz")


def test_a_damaged_npz_is_refused_or_read(tmp_path: Path, scan: Scan) -> None:
    path = tmp_path / "s.npz"
    write_scan(scan, path)
    whole, rng, n_refused = path.read_bytes(), np.random.default_rng(8), 0
    for _ in range(300):
        damaged = bytearray(whole)
        damaged[int(rng.integers(len(whole)))] ^= 1 << int(rng.integers(8))
        path.write_bytes(damaged)
        try:
            read_scan(path)
        except InputError:
            n_refused += 1
    assert 100 < n_refused <= 300  # the rest hit file times and the like


@pytest.mark.parametrize("values", [np.array(["text"]), np.array([None]), np.array([1j])])
def test_only_numbers_are_stored(tmp_path: Path, values: Array) -> None:
    with pytest.raises(InputError, match="`x` must hold numbers"):
        write_arrays({"x": values}, tmp_path / "a.npz")
    assert list(tmp_path.iterdir()) == []

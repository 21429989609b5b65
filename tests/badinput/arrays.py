"""NPZ files that are no archives, hold pickles, lie about their arrays, or hold the wrong ones."""

from __future__ import annotations

import pickle
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from deskew import io
from deskew.types import Array
from tests.badinput.case import Break, Case, written
from tests.badinput.forged import npy, npz, npz_bomb, npz_that_declares
from tests.badinput.images import cut, sparse
from tests.badinput.samples import pixels

RESTORE = "deskew restore scan.npz -o out/r.png"


class Opened:
    """Would make a file if it were unpickled."""

    def __reduce__(self) -> tuple[Callable[[str, str], object], tuple[str, str]]:
        return open, ("UNPICKLED", "w")


def archive(what: str, data: bytes, *words: str) -> Case:
    """A scan that is no archive of plain numbers."""
    return Case(what, RESTORE, ("scan.npz", *words), written("scan.npz", data))


def changed(change: Callable[[dict[str, Array]], object]) -> Break:
    """Return what changes the arrays of the scan."""

    def write(here: Path) -> None:
        arrays = io.read_arrays(here / "scan.npz")
        change(arrays)
        np.savez(here / "scan.npz", **arrays)  # type: ignore[arg-type]

    return write


def scan(what: str, change: Callable[[dict[str, Array]], object], *words: str) -> Case:
    """A scan of wrong arrays."""
    return Case(what, RESTORE, ("scan.npz", *words), changed(change))


def _objects(here: Path) -> None:
    np.savez(here / "scan.npz", version=np.array([Opened()], dtype=object))


def _twice(here: Path) -> None:
    with zipfile.ZipFile(here / "scan.npz", "a") as opened:
        opened.writestr(zipfile.ZipInfo("version"), npy("'<i8'", "()", bytes(8)))


ARCHIVES = (
    archive("an empty NPZ", b"", "whole NPZ"),
    archive("an NPZ that is a PNG", b"\x89PNG\r\n\x1a\n" + bytes(99), "whole NPZ"),
    archive("a bare pickle named .npz", pickle.dumps(Opened()), "whole NPZ"),
    archive("an NPZ without arrays", npz({}), "hold the arrays"),
    archive("an NPZ of a text", npz({"version.npy": b"hello"}), "header of an array"),
    archive("an NPZ of a pickle", npz({"version.npy": pickle.dumps(Opened())}), "header of an array"),
    archive(
        "an array of objects by its header", npz({"a.npy": npy("'|O'", "(1,)", pickle.dumps(Opened()))}), "hold numbers"
    ),
    archive(
        "an array of 80 GB by its header",
        npz({"a.npy": npy("'<f8'", "(10000000000,)", bytes(8))}),
        "as its header says",
    ),
    archive("an array of a negative length", npz({"a.npy": npy("'<f8'", "(-1,)", bytes(8))}), "a"),
    archive("an array of 10^30 elements", npz({"a.npy": npy("'<f8'", f"({10**30},)", bytes(8))}), "as its header says"),
    archive(
        "an array of a nested type", npz({"a.npy": npy("[('x', '<f8', (2, 2))]", "(1,)", bytes(32))}), "hold numbers"
    ),
    archive("an array of complex numbers", npz({"a.npy": npy("'<c16'", "(1,)", bytes(16))}), "hold numbers"),
    archive("an array of dates", npz({"a.npy": npy("'<M8[s]'", "(1,)", bytes(8))}), "hold numbers"),
    archive(
        "a header that is code",
        npz({"a.npy": npy("__import__('os').system('touch RUN')", "(1,)", bytes(8))}),
        "header of an array",
    ),
    archive("a header that never closes", npz({"a.npy": npy("'''", "(1,)", bytes(8))}), "header of an array"),
    archive("a header of brackets 3000 deep", npz({"a.npy": npy("[" * 3000, "(1,)", bytes(8))}), "header of an array"),
    archive("a header with a NUL", npz({"a.npy": npy("'\0'", "(1,)", bytes(8))}), "header of an array"),
    archive("an array of a version unknown", npz({"a.npy": b"\x93NUMPY\x09\x00" + bytes(99)}), "header of an array"),
    archive("an array cut in its first word", npz({"a.npy": b"\x93NUMPY"}), "header of an array"),
    Case("an NPZ of objects", RESTORE, ("scan.npz", "hold numbers", "|O"), _objects),
    Case("an NPZ with a name twice", RESTORE, ("`scan.npz`", "name each array once"), _twice),
    Case(
        "an NPZ bomb of 2 GB",
        RESTORE,
        ("`scan.npz`", "unpack to at most 805306368 bytes"),
        lambda here: (here / "scan.npz").write_bytes(npz_that_declares(1 << 31)),
    ),
    Case(
        "an NPZ of 256 MB of zeros that is no scan",
        RESTORE,
        ("`scan.npz`", "hold the arrays"),
        lambda here: (here / "scan.npz").write_bytes(npz_bomb(1 << 28)),
    ),
    Case("an NPZ cut in half", RESTORE, ("`scan.npz`", "whole NPZ"), cut("scan.npz", 2000)),
    Case(
        "a sparse NPZ of 3 GB",
        RESTORE,
        ("`scan.npz`", "at most 805306368 bytes"),
        sparse("scan.npz", b"PK\3\4", 3 << 30),
    ),
    Case("a scan that is a folder", "deskew restore page -o out/r.png", ("`page`", "be a file", "a folder")),
)

SCANS = (
    scan("a scan without depth", lambda a: a.pop("depth_z"), "hold the arrays"),
    scan("a scan of version 9", lambda a: a.update(version=np.array(9)), "version", "be 1", "9"),
    scan("a camera matrix of NaN", lambda a: a["camera_K"].fill(np.nan), "`K`", "finite"),
    scan("a rotation of 1e300", lambda a: a["camera_R"].fill(1e300), "`R`", "rotation"),
    scan("a camera of 10^19 px", lambda a: a.update(camera_size=np.array([10**19, 16], np.uint64)), "image_white"),
    scan("a camera of a negative size", lambda a: a.update(camera_size=np.array([-24, 16])), "size"),
    scan("depth of another size", lambda a: a.update(depth_z=np.zeros((9, 9))), "`z`"),
    scan("depth of 80 dimensions' worth of shape", lambda a: a.update(depth_z=np.zeros((1,) * 20)), "depth_z"),
    scan("vertices of infinity", lambda a: a["sheet_vertices"].fill(np.inf), "`vertices`", "finite"),
    scan(
        "vertices of truth values",
        lambda a: a.update(sheet_vertices=np.ones((3, 4, 3), bool)),
        "`vertices`",
        "real numbers",
    ),
    scan("a grid of one row", lambda a: a.update(sheet_vertices=np.zeros((1, 4, 3))), "R, C >= 2"),
    scan("stiffness below zero", lambda a: a["sheet_stiffness"].fill(-1.0), "`stiffness`"),
    scan("every quad cut", lambda a: a["sheet_cut"].fill(True), "leave a quad whole"),
    scan("a light of floats", lambda a: a.update(image_uv=np.zeros((16, 24))), "8 or 16 bits"),
    scan("a light of a hostile name", lambda a: a.update({"image_../x": pixels(1)}), "image_LIGHT"),
    scan("an outline of NaN", lambda a: a["outline"].fill(np.nan), "`outline`", "finite"),
    scan("filled by 200 %", lambda a: a.update(filled_fraction=np.array(2.0)), "[0, 1]", "2.0"),
    scan("a crease width of three numbers", lambda a: a.update(sheet_crease_width=np.zeros(3)), "crease_width"),
)

CASES: tuple[Case, ...] = ARCHIVES + SCANS

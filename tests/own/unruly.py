"""Methods that do what methods must not: each breaks one rule. `flatten` keeps them all."""

from __future__ import annotations

import ctypes
import gc
import os
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

import deskew
from deskew.types import Array, Flattened, Restoration, Scan, Sheet, Status


def flatten(sheet: Sheet) -> Flattened:
    """Press the sheet flat: no good method, and one that keeps to the rules."""
    return Flattened(sheet.vertices * [1.0, 1.0, 0.0], Status.AT_REST, "", {"steps": 3.0})


def crash(sheet: Sheet) -> Flattened:
    print("not again", file=sys.stderr, flush=True)
    ctypes.string_at(0)
    return flatten(sheet)


def hang(sheet: Sheet) -> Flattened:
    time.sleep(3600)
    return flatten(sheet)


def hoard(sheet: Sheet) -> Flattened:
    return Flattened(np.ones((1 << 32, 3)), Status.AT_REST)


def tear(sheet: Sheet) -> Flattened:
    return Flattened(sheet.vertices * np.nan, Status.AT_REST)


def shorten(sheet: Sheet) -> Flattened:
    return Flattened(sheet.vertices[:-1], Status.AT_REST)


def mirror(sheet: Sheet) -> Flattened:
    return Flattened(sheet.vertices * [-1.0, 1.0, 0.0], Status.AT_REST)


def leave(sheet: Sheet) -> Flattened:
    os._exit(0)


def raise_two_lines(sheet: Sheet) -> Flattened:
    raise ValueError("first line\n  second line")


def return_an_object(sheet: Sheet) -> Flattened:
    return Flattened(np.array([{"not": "a number"}], dtype=object), Status.AT_REST)


def return_nothing(sheet: Sheet) -> Any:
    return None


def prattle(sheet: Sheet) -> Flattened:
    """Write without end, and keep to the rules otherwise."""
    os.write(1, b"\x1b[2J\xff\x00 nonsense \n" * 1000)
    raise ValueError("tired of \x1b[31mtalking")


def forge(sheet: Sheet) -> Flattened:
    """Leave a result that would unpack to more than memory holds, and go."""
    header = b"\x93NUMPY\x01\x00v\x00" + b"{'descr': '<f8', 'fortran_order': False, 'shape': (1099511627776,), }".ljust(
        117
    )
    import zipfile

    with zipfile.ZipFile("returned.npz", "w") as archive:
        archive.writestr("vertices.npy", header + b"\n")
    os._exit(0)


def pickle_code(sheet: Sheet) -> Flattened:
    """Leave a result that would run code where it is read."""

    class Trap:
        def __reduce__(self) -> Any:
            return os.system, (f"touch {Path(__file__).with_name('sprung')}",)

    np.savez("returned.npz", vertices=np.array([Trap()], dtype=object), status=np.array(0), allow_pickle=True)
    os._exit(0)


def flood(sheet: Sheet) -> Flattened:
    with Path("flood").open("wb") as file:
        file.truncate(1 << 40)
    return flatten(sheet)


def abandon(sheet: Sheet) -> Flattened:
    """Leave a process behind that has left group and session, and says who it is beside this file."""
    if os.fork() == 0:
        os.setsid()
        if os.fork() == 0:
            Path(str(os.environ["HOME"])).joinpath("gone").touch()
            time.sleep(3600)
        os._exit(0)
    while not Path("gone").exists():
        time.sleep(0.01)
    return flatten(sheet)


def spy(sheet: Sheet) -> Flattened:
    """Look for the truth wherever a process can look, and count what is found as `seen_...`."""
    named = ("data_synth", "experiments", "_pytest")
    frames, frame = 0, sys._getframe()
    while frame.f_back is not None:
        frames, frame = frames + 1, frame.f_back
    memory = 0
    for name in ("mem", "maps", "environ"):
        try:
            memory += os.open(f"/proc/{os.getppid()}/{name}", os.O_RDONLY) > 0
        except OSError:
            continue
    seen = {
        "modules": sum(module.partition(".")[0] in named for module in sys.modules),
        "objects": sum(type(thing).__module__.partition(".")[0] in named for thing in gc.get_objects()),
        "arrays": sum(isinstance(thing, np.ndarray) and thing.shape[-1:] == (2,) for thing in gc.get_objects()),
        "secrets": sum("SECRET" in name for name in os.environ) + sum("SECRET" in word for word in sys.argv),
        "frames": frames > 6,
        "memory": memory,
        "files": len({path.name for path in Path().iterdir()} - {"given.npz", "output.txt"}),
        "descriptors": sum(_regular(number) for number in range(3, 64)),
    }
    return Flattened(flatten(sheet).vertices, Status.AT_REST, "", {f"seen_{k}": float(v) for k, v in seen.items()})


def _regular(number: int) -> bool:
    return Path(f"/proc/self/fd/{number}").is_file()


@deskew.restorer
def restore(scan: Scan) -> Restoration:
    """Show the page as the camera does, bent."""
    from deskew.restoration import undistorted_view, undistortion_map, view_camera

    view = view_camera(scan.camera)
    image = undistorted_view(scan.images["white"], scan.camera)
    return Restoration(image, undistortion_map(scan.camera), view)


@deskew.dewarper
def dewarp(image: Array) -> Array:
    """Return the picture as it is, twice as wide and high."""
    return np.asarray(np.repeat(np.repeat(image, 2, axis=0), 2, axis=1))


@deskew.dewarper
def dewarp_with_map(image: Array) -> tuple[Array, Array]:
    """Return the picture as it is, and say so."""
    y, x = np.indices(image.shape, dtype=np.float32)
    return image, np.stack([x, y], axis=-1)


@deskew.dewarper
def dewarp_mirrored(image: Array) -> tuple[Array, Array]:
    image, places = dewarp_with_map(image)
    return image[:, ::-1], places[:, ::-1]


@deskew.dewarper
def dewarp_nothing(image: Array) -> Array:
    return image[:0]


@deskew.restorer
def restore_elsewhere(scan: Scan) -> Restoration:
    """Return a page through another camera than the one that is asked for."""
    found = restore(scan)
    return Restoration(found.image, found.backward_map, scan.camera)

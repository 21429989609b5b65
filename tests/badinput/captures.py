"""Capture and calibration folders with frames that are missing, doubled, shuffled or unlike the others."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np

from deskew import io
from tests.badinput.case import Break, Case, edited, written
from tests.badinput.forged import png
from tests.badinput.images import cut
from tests.badinput.samples import pixels

RUN, SWEEP = "deskew run page -c c.json -o out/r.png", "deskew scan sweep -c c.json -o out/s.npz"
RENDERED = "deskew run rendered -c rendered.json -o out/r.png --shape 12 9 --mask whole.png"


def gone(name: str) -> Break:
    """Return what removes a file or a folder."""

    def remove(here: Path) -> None:
        path = here / name
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink()

    return remove


def copied(old: str, new: str) -> Break:
    """Return what copies a file over another or to a new name."""
    return lambda here: shutil.copy(here / old, here / new)


def swapped(one: str, other: str) -> Break:
    """Return what exchanges two files."""

    def swap(here: Path) -> None:
        (here / one).rename(here / "kept")
        (here / other).rename(here / one)
        (here / "kept").rename(here / other)

    return swap


def pictured(name: str, **kind: object) -> Break:
    """Return what puts another picture in a frame's place: `size`, `channels` or `dtype` as `samples.pixels` has."""
    return lambda here: io.write_image(pixels(1, **kind), here / name)  # type: ignore[arg-type]


def linked(name: str, target: str) -> Break:
    """Return what puts a symbolic link in a file's place."""

    def link(here: Path) -> None:
        gone(name)(here)
        (here / name).symlink_to(target.format(here=here.parent))

    return link


def _all_white(here: Path) -> None:
    for path in (here / "rendered" / "gray").iterdir():
        shutil.copy(here / "rendered" / "white.png", path)


FRAMES = (
    Case("a frame missing", RUN, ("`page/gray`", "hold 12 frames", "'05.png' missing"), gone("page/gray/05.png")),
    Case("the last frame missing", RUN, ("`page/gray`", "'11.png' missing"), gone("page/gray/11.png")),
    Case(
        "a frame too many",
        RUN,
        ("hold 12 frames", "13 images, also '12.png'"),
        copied("page/gray/11.png", "page/gray/12.png"),
    ),
    Case(
        "a frame under two names",
        SWEEP,
        ("`sweep/columns`", "also '1.png'"),
        copied("sweep/columns/0001.png", "sweep/columns/1.png"),
    ),
    Case(
        "frames numbered from 1",
        RUN,
        ("'00.png' missing",),
        lambda here: (here / "page/gray/00.png").rename(here / "page/gray/12.png"),
    ),
    Case(
        "frames of another width of numbers",
        RUN,
        ("missing",),
        lambda here: (here / "page/gray/00.png").rename(here / "page/gray/000.png"),
    ),
    Case("no frames at all", RUN, ("`page/gray`", "be a folder", "nothing there"), gone("page/gray")),
    Case(
        "frames that are a file",
        RUN,
        ("`page/gray`", "be a folder", "a file"),
        lambda here: (gone("page/gray")(here), written("page/gray", "")(here)),
    ),
    Case("a row sweep missing", SWEEP, ("`sweep/rows`", "be a folder"), gone("sweep/rows")),
    Case("columns and rows exchanged", SWEEP, ("`sweep/columns`", "8 frames"), swapped("sweep/columns", "sweep/rows")),
    Case(
        "a JPEG among the frames",
        SWEEP,
        ("also '0008.jpg'",),
        lambda here: (here / "sweep/columns/0008.jpg").write_bytes(b"\xff\xd8"),
    ),
    Case(
        "a frame that is a folder",
        SWEEP,
        ("`sweep/rows/0002.png`", "be a file", "a folder"),
        lambda here: (gone("sweep/rows/0002.png")(here), (here / "sweep/rows/0002.png").mkdir()),
    ),
    Case(
        "a frame cut in its pixels", SWEEP, ("`sweep/columns/0003.png`", "whole PNG"), cut("sweep/columns/0003.png", 90)
    ),
    Case(
        "a frame of another size",
        SWEEP,
        ("`sweep/columns/0002.png`", "24x16 px", "16x24 px"),
        pictured("sweep/columns/0002.png", size=(16, 24)),
    ),
    Case(
        "a frame in colour among grey ones",
        SWEEP,
        ("`sweep/rows/0004.png`", "shape (16, 24)", "(16, 24, 3)"),
        pictured("sweep/rows/0004.png", channels=3),
    ),
    Case(
        "a frame of 16 bits among 8",
        SWEEP,
        ("`sweep/rows/0004.png`", "type uint8", "uint16"),
        pictured("sweep/rows/0004.png", dtype=np.uint16),
    ),
    Case(
        "a frame of a palette among grey ones",
        SWEEP,
        ("`sweep/rows/0004.png`",),
        written("sweep/rows/0004.png", png(24, 16, 8, 6)),
    ),
    Case(
        "a frame that is a bomb",
        SWEEP,
        ("`sweep/columns/0000.png`", "60000x60000"),
        written("sweep/columns/0000.png", png(60000, 60000, raw=b"")),
    ),
    Case("white missing", RUN, ("`page/white.png`", "be a file"), gone("page/white.png")),
    Case("black in colour", RUN, ("`page/black.png`", "shape"), pictured("page/black.png", channels=3)),
    Case(
        "white of another size than is stated",
        RUN,
        ("`page/white.png`", "24x16 px", "25x16 px"),
        pictured("page/white.png", size=(25, 16)),
    ),
    Case("white of no pixels", RUN, ("`page/white.png`", "0 bytes"), written("page/white.png", b"")),
    Case("a light's picture missing", RUN, ("`page/textures/uv.png`", "be a file"), gone("page/textures/uv.png")),
    Case(
        "a light's picture that no light names",
        RUN,
        ("lights", "'ir.png'"),
        copied("page/textures/uv.png", "page/textures/ir.png"),
    ),
    Case(
        "a light's picture that is a bomb",
        RUN,
        ("`page/textures/uv.png`", "60000x60000"),
        written("page/textures/uv.png", png(60000, 60000, raw=b"")),
    ),
    Case(
        "a capture folder that is not there",
        "deskew run nowhere -c c.json -o out/r.png",
        ("`nowhere`", "be a folder", "nothing there"),
    ),
    Case(
        "a capture folder that is a file",
        "deskew run c.json -c c.json -o out/r.png",
        ("`c.json`", "be a folder", "a file"),
    ),
    Case("an empty capture folder", "deskew run out -c c.json -o out/r.png", ("`out/capture.toml`", "be a file")),
    Case("a calibration folder for a capture", "deskew run board -c c.json -o out/r.png", ("`board/capture.toml`",)),
    Case(
        "a capture of another camera than is calibrated",
        "deskew scan page -c c.json -o out/s.npz",
        ("camera",),
        lambda here: _resize_camera(here),
    ),
    Case(
        "a plane's capture without frames",
        "deskew accuracy sweep -c c.json",
        ("`sweep/rows`",),
        gone("sweep/rows"),
    ),
)

LINKS = (
    Case(
        "a frame that leads out of its folder",
        SWEEP,
        ("`sweep/columns/0001.png`", "stay inside sweep"),
        linked("sweep/columns/0001.png", "/etc/hostname"),
    ),
    Case(
        "a frame that leads to the folder beside",
        SWEEP,
        ("stay inside sweep",),
        linked("sweep/columns/0001.png", "../../page/white.png"),
    ),
    Case(
        "a frame in a loop of links", SWEEP, ("`sweep/columns/0001.png`",), linked("sweep/columns/0001.png", "0001.png")
    ),
    Case(
        "white that leads to a device",
        RUN,
        ("`page/white.png`", "stay inside page", "/dev/zero"),
        linked("page/white.png", "/dev/zero"),
    ),
    Case(
        "frames that lead out of their folder", RUN, ("stay inside page",), linked("page/gray", "../board/pose_00/gray")
    ),
    Case(
        "a light that leads out of its folder",
        RUN,
        ("`page/textures/uv.png`", "stay inside page"),
        linked("page/textures/uv.png", "/etc/passwd"),
    ),
    Case(
        "a capture.toml that leads out of its folder",
        RUN,
        ("`page/capture.toml`", "stay inside page"),
        linked("page/capture.toml", "../sweep/capture.toml"),
    ),
    Case(
        "a pose that leads out of its folder",
        "deskew calibrate board -o out/c.json",
        ("`board/pose_01`", "stay inside board"),
        linked("board/pose_01", "../page"),
    ),
)

BOARDS = (
    Case(
        "a board without its first pose",
        "deskew calibrate board -o out/c.json",
        ("`board`", "without a gap", "'pose_01'"),
        gone("board/pose_00"),
    ),
    Case(
        "a board without poses",
        "deskew calibrate board -o out/c.json",
        ("`board`", "pose_00", "none"),
        lambda here: [gone(f"board/pose_0{i}")(here) for i in range(3)],
    ),
    Case(
        "a pose that is a file",
        "deskew calibrate board -o out/c.json",
        ("`board/pose_02`", "a file"),
        lambda here: (gone("board/pose_02")(here), written("board/pose_02", "")(here)),
    ),
    Case(
        "a pose of another camera",
        "deskew calibrate board -o out/c.json",
        ("pose_01", "camera_size"),
        lambda here: _other_pose(here),
    ),
    Case("a capture for a board", "deskew calibrate page -o out/c.json", ("`page/board.toml`", "be a file")),
    Case("a board of pictures that show none", "deskew calibrate board -o out/c.json", (), code=3),
)

IMPORT = "deskew import {} -o out/board --inner-corners {} --square {}"
IMPORTS = (
    Case("an import of no folder", IMPORT.format("nowhere", "9 7", 75), ("`nowhere`", "be a folder", "nothing there")),
    Case("an import of no poses", IMPORT.format("page", "9 7", 75), ("`page`", "capture_0", "none")),
    Case(
        "an import of an empty pose",
        IMPORT.format(".", "9 7", 75),
        ("capture_0", "hold 42 frames", "0 images"),
        lambda here: (here / "capture_0").mkdir(),
    ),
    Case("an import of squares of NaN", IMPORT.format("page", "9 7", "nan"), ("`square`", "nan")),
    Case("an import of two corners", IMPORT.format("page", "2 7", 75), ("`shape`", "at least 3", "2")),
)

CONTENT = (
    Case("two planes exchanged", RENDERED, (), swapped("rendered/gray/00.png", "rendered/gray/02.png"), code=3),
    Case(
        "a plane and its inverse exchanged",
        RENDERED,
        (),
        swapped("rendered/gray/06.png", "rendered/gray/07.png"),
        code=3,
    ),
    Case(
        "a plane in its inverse's place", RENDERED, (), copied("rendered/gray/04.png", "rendered/gray/05.png"), code=3
    ),
    Case(
        "white and black exchanged", RENDERED, ("check",), swapped("rendered/white.png", "rendered/black.png"), code=3
    ),
    Case("every plane white", RENDERED, (), _all_white, code=3),
    Case("noise for a capture", RUN, (), code=3),
)

CASES: tuple[Case, ...] = FRAMES + LINKS + BOARDS + IMPORTS + CONTENT


def _resize_camera(here: Path) -> None:
    edited("c.json", "24,\n   16", "48,\n   32")(here)


def _other_pose(here: Path) -> None:
    pose = here / "board" / "pose_01"
    edited("board/pose_01/capture.toml", "[24, 16]", "[16, 24]")(here)
    for path in (pose / "white.png", pose / "black.png"):
        io.write_image(pixels(2, (16, 24)), path)

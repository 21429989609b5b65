"""Images that are none, are others than they are called, or declare more than they hold."""

from __future__ import annotations

import shutil
import struct
from pathlib import Path

import cv2
import numpy as np

from tests.badinput.case import Break, Case, written
from tests.badinput.forged import SIGNATURE, chunk, png, tiff
from tests.badinput.samples import pixels


def encoded(name: str, suffix: str, channels: int = 3) -> Break:
    """Return what writes a true image of one kind under the name of another."""
    return lambda here: (here / name).write_bytes(cv2.imencode(suffix, pixels(8, (64, 48), channels))[1].tobytes())


def cut(name: str, n_bytes: int) -> Break:
    """Return what leaves the first bytes of a file, or all but the last ones."""
    return lambda here: (here / name).write_bytes((here / name).read_bytes()[:n_bytes])


def flipped(name: str, at: int) -> Break:
    """Return what flips a bit of a file."""

    def flip(here: Path) -> None:
        data = bytearray((here / name).read_bytes())
        data[at] ^= 4
        (here / name).write_bytes(data)

    return flip


def sparse(name: str, begin: bytes, n_bytes: int) -> Break:
    """Return what makes a file of so many bytes that take no room."""

    def make(here: Path) -> None:
        with (here / name).open("wb") as stream:
            stream.write(begin)
            stream.truncate(n_bytes)

    return make


SCORE = "deskew score {} --truth grey.png"
PNG, WHOLE = "must be a PNG image", "must be a whole PNG"
BOMB = "must decode to at most 402653184 bytes"


def scored(what: str, name: str, words: tuple[str, ...], broken: Break) -> Case:
    """A restored picture that cannot be compared."""
    return Case(what, SCORE.format(name), (f"`{name}`", *words), broken)


def _many_chunks(here: Path) -> None:
    head = SIGNATURE + chunk(b"IHDR", struct.pack(">IIBBBBB", 64, 48, 8, 0, 0, 0, 0))
    (here / "a.png").write_bytes(head + chunk(b"IDAT", b"") * 300_000)


CASES: tuple[Case, ...] = (
    scored("a JPEG named .png", "a.png", (PNG, "xff\\xd8"), encoded("a.png", ".jpg")),
    scored("a PNG named .tif", "a.tif", ("must be a TIFF image", "x89PNG"), encoded("a.tif", ".png")),
    scored("a TIFF named .png", "a.png", (PNG, "II*"), encoded("a.png", ".tif")),
    scored("a WebP named .png", "a.png", (PNG, "RIFF"), encoded("a.png", ".webp")),
    scored("a page of HTML named .png", "a.png", (PNG, "<html>"), written("a.png", "<html><script>alert(1)</script>")),
    scored("a shell script named .tif", "a.tif", ("TIFF", "#!/bin"), written("a.tif", "#!/bin/sh\nrm -rf /\n")),
    scored("an empty .png", "a.png", (PNG, "0 bytes"), written("a.png", b"")),
    scored("an empty .tif", "a.tif", ("TIFF", "0 bytes"), written("a.tif", b"")),
    scored("a PNG of its signature alone", "a.png", (PNG, "8 bytes"), written("a.png", SIGNATURE)),
    scored("a PNG cut in its pixels", "colour.png", (WHOLE, "its end after"), cut("colour.png", 4000)),
    scored("a PNG without its last byte", "colour.png", (WHOLE, "its end after"), cut("colour.png", -1)),
    scored("a PNG with a flipped bit", "colour.png", ("undamaged", "checksum"), flipped("colour.png", 2000)),
    scored("a TIFF cut before its directory", "deep.tif", ("TIFF", "no complete directory"), cut("deep.tif", 100)),
    scored("a TIFF cut in its first word", "deep.tif", ("TIFF", "3 bytes"), cut("deep.tif", 3)),
    scored("a PNG of 60000 x 60000", "a.png", (BOMB, "60000x60000"), written("a.png", png(60000, 60000, raw=bytes(9)))),
    scored("a PNG of 2^32 x 2^32", "a.png", (BOMB,), written("a.png", png(2**32 - 1, 2**32 - 1, 16, 6, bytes(9)))),
    scored(
        "a TIFF of 60000 x 60000",
        "a.tif",
        (BOMB, "60000x60000"),
        written("a.tif", tiff({256: 60000, 257: 60000, 258: 8, 277: 3, 273: 8, 279: 9})),
    ),
    scored(
        "a TIFF of 100 megapixels in 60 bytes",
        "a.tif",
        ("hold the 10000x10000 px",),
        written("a.tif", tiff({256: 10000, 257: 10000, 258: 8, 277: 1, 273: 8, 279: 9})),
    ),
    scored("a PNG of no width", "a.png", ("valid PNG header",), written("a.png", png(0, 48, raw=b""))),
    scored("a TIFF of no height", "a.tif", ("at least 1 pixel", "(64, 0)"), written("a.tif", tiff({256: 64, 257: 0}))),
    scored(
        "a PNG whose pixels go on for 32 MB",
        "a.png",
        ("pixels its header declares", "more pixel data"),
        lambda here: (here / "a.png").write_bytes(png(64, 48, raw=bytes(1 << 25))),
    ),
    scored("a PNG with too few rows", "a.png", ("pixels its header",), written("a.png", png(64, 48, raw=bytes(65)))),
    scored("a PNG of 300000 chunks", "a.png", ("at most 262144 chunks",), _many_chunks),
    scored("a sparse .png of half a terabyte", "a.png", ("bytes",), sparse("a.png", SIGNATURE, 1 << 39)),
    scored("a sparse .png of 200 MB", "a.png", ("PNG",), sparse("a.png", SIGNATURE, 200_000_000)),
    scored("a sparse .tif of 200 MB", "a.tif", ("TIFF",), sparse("a.tif", b"II*\0\0\0\0\x1d", 200_000_000)),
    scored("a PNG with an unknown row filter", "a.png", ("filter 9",), written("a.png", png(8, 2, raw=b"\x09" * 18))),
    scored("a PNG of a palette that is not there", "a.png", ("palette",), written("a.png", png(64, 48, colour=3))),
    scored(
        "a PNG of a palette of 257 colours",
        "a.png",
        ("palette", "771 bytes"),
        written("a.png", png(64, 48, colour=3, extra=chunk(b"PLTE", bytes(771)))),
    ),
    scored("a transparent PNG", "a.png", ("transparency", "alpha down to 0"), written("a.png", png(64, 48, colour=6))),
    scored(
        "an interlaced PNG cut to one pass",
        "a.png",
        ("pixels its header",),
        written("a.png", png(64, 48, interlace=1, raw=bytes(54))),
    ),
    scored("a PNG interlaced in a way unknown", "a.png", ("header",), written("a.png", png(8, 8, interlace=7))),
    scored("a PNG of 3 bits", "a.png", ("valid PNG header",), written("a.png", png(64, 48, depth=3))),
    scored(
        "a PNG whose header stands twice",
        "a.png",
        ("chunks in order", "IHDR"),
        lambda here: (here / "a.png").write_bytes(_twice()),
    ),
    scored("a picture in a format that is not read", "a.jpg", ("end in one of", ".jpg"), encoded("a.jpg", ".jpg")),
    scored(
        "a TIFF of 64-bit colour",
        "a.tif",
        ("8 or 16 bits", "float64"),
        lambda here: (here / "a.tif").write_bytes(cv2.imencode(".tif", np.ones((48, 64, 3)))[1].tobytes()),
    ),
    scored("a truth that is a mesh", "grey.png", (), lambda here: shutil.copy(here / "bent.obj", here / "grey.png")),
    Case(
        "a mask of another size",
        "deskew scan page -c c.json -o out/s.npz --mask grey.png",
        ("`grey.png`", "24x16 px", "64x48 px"),
    ),
    Case(
        "a mask that is black all over",
        "deskew scan page -c c.json -o out/s.npz --mask mask.png",
        ("`--mask`", "not black all over", "mask.png"),
        written("mask.png", png(24, 16)),
    ),
    Case(
        "a mask that is a folder",
        "deskew run page -c c.json -o out/r.png --mask page.png",
        ("`page.png`", "be a file", "a folder"),
        lambda here: (here / "page.png").mkdir(),
    ),
    Case(
        "a stiffness map in colour",
        "deskew flatten unit.obj -o out/f.ply --stiffness materials.png",
        ("`materials.png`", "grey", "8-bit RGB"),
        written("materials.png", png(24, 16, colour=2)),
    ),
    Case(
        "a stiffness map of one bit",
        "deskew flatten unit.obj -o out/f.ply --stiffness materials.png",
        ("`materials.png`", "1-bit grey"),
        written("materials.png", png(24, 16, depth=1)),
    ),
    Case(
        "a stiffness map of a palette",
        "deskew flatten unit.obj -o out/f.ply --stiffness materials.png",
        ("`materials.png`", "palette"),
        written("materials.png", png(24, 16, colour=3, extra=chunk(b"PLTE", bytes(6)))),
    ),
    Case(
        "a stiffness map of another size than the camera's",
        "deskew run page -c c.json -o out/r.png --stiffness materials.png",
        ("`materials.png`", "24x16 px", "25x16 px"),
        written("materials.png", png(25, 16)),
    ),
)


def _twice() -> bytes:
    whole = png(64, 48)
    return whole[:33] + whole[8:33] + whole[33:]

from __future__ import annotations

import errno
import os
import struct
import tracemalloc
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest

from deskew.errors import InputError, StepError
from deskew.io import read_image, write_image
from deskew.types import Array

SIGNATURE = b"\x89PNG\r\n\x1a\n"
ADAM7 = ((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2))


def chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def ihdr(width: int, height: int, depth: int = 8, colour: int = 0, interlace: int = 0) -> bytes:
    return chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, interlace))


def png(header: bytes, raw: bytes, *extra: bytes) -> bytes:
    return SIGNATURE + header + b"".join(extra) + chunk(b"IDAT", zlib.compress(raw)) + chunk(b"IEND", b"")


def rows(values: Array) -> bytes:
    return b"".join(b"\0" + row.tobytes() for row in values)


def tiff_entry(tag: int, value: int) -> bytes:
    return struct.pack("<HHII", tag, 4, 1, value)


GREY = np.random.default_rng(3).integers(0, 255, (7, 9), dtype=np.uint8)
END = chunk(b"IEND", b"")
WRONG = {
    "pixels missing": png(ihdr(9, 7), rows(GREY)[:-1]),
    "pixels too many": png(ihdr(9, 7), rows(GREY) + b"\0"),
    "pixels damaged": SIGNATURE + ihdr(9, 7) + chunk(b"IDAT", zlib.compress(rows(GREY))[:-4] + b"1234") + END,
    "pixels cut": SIGNATURE + ihdr(9, 7) + chunk(b"IDAT", zlib.compress(rows(GREY))[:-4]) + END,
    "data after the pixels": SIGNATURE + ihdr(9, 7) + chunk(b"IDAT", zlib.compress(rows(GREY)) + b"more") + END,
    "unknown row filter": png(ihdr(9, 7), rows(GREY).replace(b"\0", b"\5", 1)),
    "no pixels": SIGNATURE + ihdr(9, 7) + END,
    "two headers": png(ihdr(9, 7), rows(GREY), ihdr(9, 7)),
    "no size": png(ihdr(0, 7), b""),
    "unknown colour type": png(ihdr(9, 7, colour=5), rows(GREY)),
    "unknown depth": png(ihdr(9, 7, depth=3), rows(GREY)),
    "palette missing": png(ihdr(9, 7, colour=3), rows(GREY)),
    "palette uneven": png(ihdr(9, 7, colour=3), rows(GREY), chunk(b"PLTE", b"abcd")),
    "transparent": png(ihdr(9, 7, colour=4), rows(np.stack([GREY, GREY], -1))),
}


def assert_same(found: Array, wanted: Array) -> None:
    assert found.dtype == wanted.dtype
    assert np.array_equal(found, wanted)


@pytest.mark.parametrize("suffix", [".png", ".tif", ".tiff", ".PNG"])
@pytest.mark.parametrize("shape", [(5, 7), (5, 7, 3), (1, 1)])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_an_image_comes_back_as_it_was_written(
    tmp_path: Path, dtype: type, shape: tuple[int, ...], suffix: str
) -> None:
    image = np.random.default_rng(1).integers(0, np.iinfo(dtype).max, shape, dtype=dtype)
    path = tmp_path / f"image{suffix}"
    write_image(image, path)
    assert_same(read_image(path), image)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_colour_is_rgb_in_memory(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "red.png"), np.full((2, 2, 3), (0, 0, 200), np.uint8))  # OpenCV's order is BGR
    assert read_image(tmp_path / "red.png")[0, 0].tolist() == [200, 0, 0]


def test_an_interlaced_image_is_read(tmp_path: Path) -> None:
    raw = b"".join(rows(GREY[y::dy, x::dx]) for x, y, dx, dy in ADAM7)
    (tmp_path / "a.png").write_bytes(png(ihdr(9, 7, interlace=1), raw))
    assert_same(read_image(tmp_path / "a.png"), GREY)


def test_a_palette_becomes_colour(tmp_path: Path) -> None:
    palette = np.random.default_rng(2).integers(0, 255, (256, 3), dtype=np.uint8)
    (tmp_path / "a.png").write_bytes(png(ihdr(9, 7, colour=3), rows(GREY), chunk(b"PLTE", palette.tobytes())))
    assert_same(read_image(tmp_path / "a.png"), palette[GREY])


def test_one_bit_becomes_black_and_white(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(png(ihdr(9, 2, depth=1), b"\0\xaa\x80\0\x55\x00"))
    assert read_image(tmp_path / "a.png").tolist() == [[255, 0, 255, 0, 255, 0, 255, 0, 255], [0, 255] * 4 + [0]]


def test_opaque_alpha_is_dropped(tmp_path: Path) -> None:
    rgba = np.dstack([np.random.default_rng(4).integers(0, 255, (7, 9, 3), dtype=np.uint8), np.full((7, 9), 255)])
    (tmp_path / "a.png").write_bytes(png(ihdr(9, 7, colour=6), rows(rgba.astype(np.uint8))))
    assert_same(read_image(tmp_path / "a.png"), rgba[..., :3].astype(np.uint8))


def test_a_faulty_colour_profile_is_nobodys_error(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    extra = [chunk(b"iCCP", b"broken"), chunk(b"gAMA", b"\0"), chunk(b"tEXt", b"no separator")]
    (tmp_path / "a.png").write_bytes(png(ihdr(9, 7), rows(GREY), *extra))
    assert_same(read_image(tmp_path / "a.png"), GREY)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("case", list(WRONG))
def test_an_inconsistent_png_is_refused_in_silence(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], case: str
) -> None:
    (tmp_path / "a.png").write_bytes(WRONG[case])
    with pytest.raises(InputError, match=r"a\.png` must .*, got "):
        read_image(tmp_path / "a.png")
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("suffix", [".png", ".tif"])
def test_an_image_cut_anywhere_is_refused_in_silence(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], suffix: str
) -> None:
    path = tmp_path / f"a{suffix}"
    write_image(GREY, path)
    whole = path.read_bytes()
    for n_bytes in range(len(whole) - (1 if suffix == ".png" else 8)):
        path.write_bytes(whole[:n_bytes])
        with pytest.raises(InputError, match=r"a\.\w+` must .*, got "):
            read_image(path)
    assert capfd.readouterr() == ("", "")


def test_any_flipped_bit_of_a_png_is_found(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.png"
    write_image(GREY, path)
    whole = path.read_bytes()
    for bit in range(0, 8 * len(whole), 5):  # every byte at least once, every bit of a byte somewhere
        flipped = bytearray(whole)
        flipped[bit // 8] ^= 1 << bit % 8
        path.write_bytes(flipped)
        with pytest.raises(InputError, match=r"a\.png` must .*, got "):
            read_image(path)
    assert capfd.readouterr() == ("", "")


def test_a_damaged_tiff_is_refused_or_read_at_its_size_in_silence(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.tif"
    write_image(GREY, path)
    whole, rng, n_refused = path.read_bytes(), np.random.default_rng(5), 0
    for _ in range(400):
        damaged = bytearray(whole)
        damaged[int(rng.integers(len(whole)))] ^= 1 << int(rng.integers(8))
        path.write_bytes(damaged)
        try:
            assert read_image(path, size=(9, 7)).shape[:2] == (7, 9)
        except InputError:
            n_refused += 1
    assert 50 < n_refused < 400
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("suffix", "content"),
    [
        (".png", png(ihdr(60_000, 60_000), bytes(1 << 20))),
        (".png", png(ihdr(0xFFFFFFFF, 0xFFFFFFFF, 16, 6), b"")),
        (".tif", struct.pack("<2sHIH", b"II", 42, 8, 2) + b"".join(map(tiff_entry, (256, 257), (60_000, 60_000)))),
    ],
    ids=["png of 3.6 gigapixels", "png of 2^64 pixels", "tiff of 3.6 gigapixels"],
)
def test_a_decompression_bomb_is_refused_before_it_costs_memory(tmp_path: Path, suffix: str, content: bytes) -> None:
    path = tmp_path / f"bomb{suffix}"
    path.write_bytes(content)
    tracemalloc.start()
    with pytest.raises(InputError, match=r"bomb\.\w+` must decode to at most 402653184 bytes, got \d+x\d+ px"):
        read_image(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 1 << 20


@pytest.mark.parametrize("name", ["a.jpg", "a", "a.svg"])
def test_only_lossless_formats_are_read_and_written(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(b"x")
    with pytest.raises(InputError, match=r"must end in \.png or \.tif or \.tiff"):
        read_image(tmp_path / name)
    with pytest.raises(InputError, match=r"must end in \.png or \.tif or \.tiff"):
        write_image(GREY, tmp_path / name)
    assert (tmp_path / name).read_bytes() == b"x"


@pytest.mark.parametrize(
    "image", [np.zeros((4, 4)), np.zeros((4, 4), bool), np.zeros((4, 4, 4), np.uint8), np.zeros((0, 4), np.uint8)]
)
def test_only_pictures_are_written(tmp_path: Path, image: Array) -> None:
    with pytest.raises(InputError, match="`image` must"):
        write_image(image, tmp_path / "a.png")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["no/a.png", "b\0.png", "x" * 300 + ".png"])
def test_an_impossible_name_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="must be a file, got nothing there"):
        read_image(tmp_path / name)
    with pytest.raises((InputError, StepError), match=r"must lie in an existing folder|null byte|at most 255 bytes"):
        write_image(GREY, tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_a_failed_write_keeps_the_old_file_and_leaves_no_other(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_image(GREY, tmp_path / "a.png")

    def full(path: Path, content: bytes) -> int:
        path.touch()
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(StepError, match=r"Writing `.*a\.png` failed: No space left on device; choose a writable"):
        write_image(GREY[::-1], tmp_path / "a.png")
    assert [p.name for p in tmp_path.iterdir()] == ["a.png"]
    assert_same(read_image(tmp_path / "a.png"), GREY)

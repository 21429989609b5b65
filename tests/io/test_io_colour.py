"""Colour profiles and resolution of pictures, with Pillow as the outside reader and writer."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageCms

from deskew.errors import InputError
from deskew.io import read_capture, read_image, read_profile, write_capture, write_image
from deskew.io.colour import MAX_PROFILE_BYTES
from deskew.types import Capture

RGB = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
GREY = RGB[:16] + b"GRAY" + RGB[20:]
COLOUR = np.random.default_rng(1).integers(0, 255, (5, 7, 3), dtype=np.uint8)


@pytest.mark.parametrize("suffix", [".png", ".tif"])
@pytest.mark.parametrize("dpi", [None, (300.0, 299.5), (26.73, 5.08)])
@pytest.mark.parametrize("icc", [None, RGB])
def test_another_program_reads_pixels_profile_and_resolution(
    tmp_path: Path, suffix: str, dpi: tuple[float, float] | None, icc: bytes | None
) -> None:
    path = tmp_path / f"a{suffix}"
    write_image(COLOUR, path, profile=icc, dpi=dpi)
    with Image.open(path) as picture:
        assert np.array_equal(np.asarray(picture), COLOUR)
        assert picture.info.get("icc_profile") == icc
        if dpi is not None:
            assert picture.info["dpi"] == pytest.approx(dpi, abs=0.02)  # PNG counts whole dots a metre
    assert np.array_equal(read_image(path), COLOUR)


@pytest.mark.parametrize("suffix", [".png", ".tif"])
@pytest.mark.parametrize("shape", [(5, 7), (5, 7, 3), (300, 400)])
def test_sixteen_bits_stay_sixteen_bits(tmp_path: Path, suffix: str, shape: tuple[int, ...]) -> None:
    image = np.random.default_rng(2).integers(0, 65535, shape, dtype=np.uint16)
    write_image(image, tmp_path / f"a{suffix}", profile=RGB if len(shape) == 3 else GREY, dpi=(250.0, 250.0))
    found = read_image(tmp_path / f"a{suffix}")
    assert found.dtype == np.uint16
    assert np.array_equal(found, image)
    if len(shape) == 2:  # Pillow makes 8 bits of 16-bit colour
        with Image.open(tmp_path / f"a{suffix}") as picture:
            assert np.array_equal(np.asarray(picture), image)
            assert picture.info["icc_profile"] == GREY


def test_a_profile_that_another_program_wrote_is_found(tmp_path: Path) -> None:
    Image.fromarray(COLOUR).save(tmp_path / "a.png", icc_profile=RGB)
    assert read_profile(tmp_path / "a.png") == RGB
    Image.fromarray(COLOUR).save(tmp_path / "b.png")
    assert read_profile(tmp_path / "b.png") is None


def chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


NO_PROFILES: dict[str, bytes] = {
    "no name": b"broken",
    "another method": b"icc\0\1" + zlib.compress(RGB),
    "damaged": b"icc\0\0" + zlib.compress(RGB)[:-9] + b"123456789",
    "cut": b"icc\0\0" + zlib.compress(RGB)[:-4],
    "of a grey picture": b"icc\0\0" + zlib.compress(GREY),
    "another size": b"icc\0\0" + zlib.compress(RGB + b"more"),
    "no signature": b"icc\0\0" + zlib.compress(RGB[:36] + b"none" + RGB[40:]),
    "a bomb": b"icc\0\0" + zlib.compress(bytes(MAX_PROFILE_BYTES + 1)),
    "too short": b"icc\0\0" + zlib.compress(RGB[:100]),
}


@pytest.mark.parametrize("case", list(NO_PROFILES))
def test_what_is_no_profile_is_passed_over(tmp_path: Path, case: str, capfd: pytest.CaptureFixture[str]) -> None:
    write_image(COLOUR, tmp_path / "a.png")
    data = (tmp_path / "a.png").read_bytes()
    (tmp_path / "a.png").write_bytes(data[:33] + chunk(b"iCCP", NO_PROFILES[case]) + data[33:])
    assert read_profile(tmp_path / "a.png") is None
    assert np.array_equal(read_image(tmp_path / "a.png"), COLOUR)
    assert capfd.readouterr() == ("", "")


def test_a_capture_keeps_its_lights_profiles(tmp_path: Path, new_capture: Callable[..., Capture]) -> None:
    capture = replace(new_capture(channels=3, lights=("uv", "raking")), profiles={"white": RGB, "raking": RGB})
    write_capture(capture, tmp_path / "page")
    assert read_capture(tmp_path / "page").profiles == {"white": RGB, "raking": RGB}
    with pytest.raises(InputError, match="`profile` must be the ICC profile of a picture with 3 channels"):
        write_capture(replace(capture, profiles={"white": GREY}), tmp_path / "other")
    assert [p.name for p in tmp_path.iterdir()] == ["page"]


@pytest.mark.parametrize("dpi", [(0.0, 300.0), (300.0, float("nan")), (float("inf"), 1.0)])
def test_a_resolution_that_is_none_is_refused(tmp_path: Path, dpi: tuple[float, float]) -> None:
    with pytest.raises(InputError, match="`dpi` must be two finite numbers above 0"):
        write_image(COLOUR, tmp_path / "a.png", dpi=dpi)
    assert list(tmp_path.iterdir()) == []

"""Stiffness maps: labels from a picture, constants from the table beside it."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest

from deskew.errors import InputError
from deskew.io import Mesh, StiffnessMap, face_stiffness, read_stiffness, write_image, write_stiffness

LABELS = np.array([[0, 0, 7], [0, 200, 7]], dtype=np.uint8)
TABLE = "[stiffness]\n0 = 30\n7 = 0.3\n200 = 3e3\n"


@pytest.fixture
def materials(tmp_path: Path) -> Path:
    write_image(LABELS, tmp_path / "m.png")
    (tmp_path / "m.toml").write_text(TABLE)
    return tmp_path / "m.png"


def png(colour: int, depth: int, row: bytes, *extra: tuple[bytes, bytes]) -> bytes:
    """One row of four pixels, as the PNG specification has it."""
    chunks = [(b"IHDR", struct.pack(">IIBBBBB", 4, 1, depth, colour, 0, 0, 0)), *extra]
    chunks += [(b"IDAT", zlib.compress(b"\0" + row)), (b"IEND", b"")]
    parts = [struct.pack(">I", len(b)) + k + b + struct.pack(">I", zlib.crc32(k + b)) for k, b in chunks]
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def test_each_label_has_its_constant_at_the_nearest_pixel(materials: Path) -> None:
    found = read_stiffness(materials)
    assert (found.size, dict(found.constants)) == ((3, 2), {0: 30.0, 7: 0.3, 200: 3000.0})
    places = np.array([[0, 0], [0.49, 0.0], [1.6, 0.4], [0.6, 0.6], [-5.0, -5.0], [9.0, 9.0], [1.0, 99.0]])
    assert found.at(places).tolist() == [30.0, 30.0, 0.3, 3000.0, 30.0, 0.3, 3000.0]


def test_labels_of_sixteen_bits_stay_whole(tmp_path: Path) -> None:
    write_image(np.array([[300, 65535]], dtype=np.uint16), tmp_path / "m.png")
    (tmp_path / "m.toml").write_text("[stiffness]\n300 = 1\n65535 = 0.001\n")
    assert read_stiffness(tmp_path / "m.png").at(np.array([[0.0, 0], [1, 0]])).tolist() == [1.0, 0.001]


def test_faces_are_found_by_their_middle_from_the_lower_left(materials: Path) -> None:
    """A pixel spans a third of the width and half of the height; the first row of the picture is the upper half."""
    at = {(0.1, 0.9): 30.0, (0.5, 0.25): 3000.0, (0.9, 0.6): 0.3, (0.2, 0.1): 30.0}
    corners = np.array([[-0.03, -0.03], [0.06, -0.03], [-0.03, 0.06]])
    texture = np.concatenate([np.array(middle) + corners for middle in at])
    vertices = np.column_stack([texture, 0 * texture[:, 0]])
    mesh = Mesh(vertices, np.arange(12).reshape(-1, 3), texture)
    assert face_stiffness(mesh, read_stiffness(materials)).tolist() == list(at.values())


def test_a_mesh_that_cannot_be_looked_up_is_refused(materials: Path) -> None:
    vertices, faces = np.eye(3), np.array([[0, 1, 2]])
    found = read_stiffness(materials)
    with pytest.raises(InputError, match="`mesh` must have texture coordinates to find its materials by, got none"):
        face_stiffness(Mesh(vertices, faces), found)
    with pytest.raises(InputError, match=r"`texture` must lie in \[0, 1\], got 0 to 210"):
        face_stiffness(Mesh(vertices, faces, np.array([[0.0, 0], [210, 0], [0, 297]]) * 210 / 297), found)


def test_places_that_are_no_numbers_and_arrays_that_are_no_labels_are_refused(materials: Path) -> None:
    with pytest.raises(InputError, match="`pixels` must be finite"):
        read_stiffness(materials).at(np.array([[np.nan, 0.0]]))
    with pytest.raises(InputError, match="`labels` must be a non-empty"):
        StiffnessMap(np.zeros((2, 2)), {0: 1.0})


WRONG_TABLES = {
    "missing": (None, r"`.*m\.toml` must be a file, got nothing there"),
    "no TOML": ("[stiffness", "must be valid TOML"),
    "another table": ("[stiff]\n0 = 1\n", r"must hold one table \[stiffness\], got \['stiff'\]"),
    "a table more": (TABLE + "[more]\n", r"must hold one table \[stiffness\]"),
    "no table": ("stiffness = 3\n", r"must hold one table \[stiffness\]"),
    "labels missing": ("[stiffness]\n0 = 1\n", "have a constant for every label .*, got none for 7, 200"),
    "a ratio in words": (TABLE.replace("30", '"1:10"'), r"m\.toml: 0` must be in .* \[kg/s\^2\], got '1:10'"),
    "zero": (TABLE.replace("0.3", "0.0"), r"m\.toml: 7` must be in"),
    "negative": (TABLE.replace("0.3", "-1"), r"m\.toml: 7` must be in"),
    "infinite": (TABLE.replace("0.3", "inf"), r"m\.toml: 7` must be in"),
    "NaN": (TABLE.replace("0.3", "nan"), r"m\.toml: 7` must be in"),
    "true": (TABLE.replace("0.3", "true"), r"m\.toml: 7` must be in .*got True"),
    "a name for a label": (TABLE + "vellum = 1\n", r"'vellum'` must be a label in \[0, 65535\]"),
    "a label too large": (TABLE + "65536 = 1\n", "must be a label"),
    "a label twice": (TABLE + "07 = 1\n", "'07'` must be a label"),
}  # fmt: skip
WRONG_PICTURES = {
    "RGB": (png(2, 8, bytes(12)), "8-bit RGB"),
    "a palette": (png(3, 8, bytes(4), (b"PLTE", bytes(3))), "8-bit palette"),
    "grey with alpha": (png(4, 8, b"\0\xff" * 4), "8-bit grey with alpha"),
    "four bits": (png(0, 4, b"\x01\x23"), "4-bit grey"),
    "one bit": (png(0, 1, b"\xa0"), "1-bit grey"),
}


@pytest.mark.parametrize("case", list(WRONG_TABLES))
def test_a_wrong_table_is_refused(materials: Path, case: str) -> None:
    text, message = WRONG_TABLES[case]
    table = materials.with_suffix(".toml")
    table.unlink()
    if text is not None:
        table.write_text(text)
    with pytest.raises(InputError, match=message):
        read_stiffness(materials)


@pytest.mark.parametrize("case", list(WRONG_PICTURES))
def test_a_picture_that_is_no_plain_grey_is_refused_by_name(materials: Path, case: str) -> None:
    data, kind = WRONG_PICTURES[case]
    materials.write_bytes(data)
    with pytest.raises(InputError, match=f"must be 8-bit or 16-bit grey, a label a pixel, got {kind}"):
        read_stiffness(materials)


def test_other_formats_are_refused(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "m.tif"), LABELS)
    with pytest.raises(InputError, match=r"must end in \.png, got \.tif"):
        read_stiffness(tmp_path / "m.tif")


@pytest.mark.parametrize(("labels", "depth"), [([[0, 7], [255, 7]], np.uint8), ([[0, 7], [256, 65535]], np.uint16)])
def test_a_written_map_is_read_as_it_was(tmp_path: Path, labels: list[list[int]], depth: type) -> None:
    made = StiffnessMap(
        np.array(labels, np.uint16), {n: 1 / (n + 3) for n in (0, 7, 255, 256, 65535) if n <= np.max(labels)}
    )
    write_stiffness(made, tmp_path / "m.png", {7: 'vellum, "old"\n[x]'})
    found = read_stiffness(tmp_path / "m.png")
    assert dict(found.constants) == dict(made.constants)
    assert found.labels.dtype == depth
    assert np.array_equal(found.labels, made.labels)
    assert '7 = 0.1  # vellum, "old"[x]\n' in (tmp_path / "m.toml").read_text()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["m.png", "m.toml"]


def test_a_map_that_cannot_be_written_leaves_nothing(tmp_path: Path) -> None:
    made = StiffnessMap(LABELS, {0: 1.0, 7: 2.0, 200: 3.0})
    with pytest.raises(InputError, match=r"m\.tif` must end in \.png"):
        write_stiffness(made, tmp_path / "m.tif")
    with pytest.raises(InputError, match=r"`labels` must be in \[0, 65535\], got 65536"):
        write_stiffness(StiffnessMap(LABELS, {**made.constants, 65536: 1.0}), tmp_path / "m.png")
    (tmp_path / "m.toml").mkdir()
    with pytest.raises(InputError, match=r"m\.toml` must be a file name, got a folder"):
        write_stiffness(made, tmp_path / "m.png")
    assert [path.name for path in tmp_path.iterdir()] == ["m.toml"]

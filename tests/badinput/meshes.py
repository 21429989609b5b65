"""Meshes that are damaged, lie about themselves, or are no sheet that could be flattened."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from deskew import io
from tests.badinput.case import Break, Case, edited, written
from tests.badinput.images import cut, sparse
from tests.badinput.samples import mesh

OBJ, PLY = "deskew flatten a.obj -o out/f.ply", "deskew flatten a.ply -o out/f.ply"
SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
HEAD = "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
FACES = "element face {}\nproperty list uchar int vertex_indices\nend_header\n"
TRIANGLE = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"


def obj(what: str, text: str | bytes, *words: str) -> Case:
    """An OBJ that cannot be flattened."""
    return Case(what, OBJ, ("a.obj" if words and words[0].startswith("`a.obj") else "", *words), written("a.obj", text))


def ply(what: str, text: str | bytes, *words: str) -> Case:
    """A PLY that cannot be flattened."""
    return Case(what, PLY, ("`a.ply`", *words), written("a.ply", text))


def surface(what: str, made: tuple[list[tuple[float, ...]], list[tuple[int, ...]]], *words: str, code: int = 2) -> Case:
    """A sound file of a surface that is no sheet."""
    vertices, faces = made
    text = "".join(f"v {' '.join(map(str, v))}\n" for v in vertices)
    text += "".join(f"f {' '.join(str(i + 1) for i in f)}\n" for f in faces)
    return Case(what, OBJ, words, written("a.obj", text), code)


def changed(name: str, **parts: object) -> Break:
    """Return what writes the bent page with other `vertices`, `faces` or `texture`, as numpy makes of them."""

    def write(here: Path) -> None:
        made = {"vertices": mesh().vertices, "faces": mesh().faces, "texture": mesh().texture, **parts}
        io.write_mesh(io.Mesh(**made), here / name)  # type: ignore[arg-type]

    return write


BINARY = HEAD.format("binary_little_endian", 3) + FACES.format(1)
_XYZ = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
TETRAHEDRON = ([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)])


def _handle() -> tuple[list[tuple[float, ...]], list[tuple[int, ...]]]:
    """A torus of 4 x 4 quads, one of which is missing."""
    angles = np.arange(4) * np.pi / 2
    vertices = [((3 + np.cos(b)) * np.cos(a), (3 + np.cos(b)) * np.sin(a), np.sin(b)) for a in angles for b in angles]
    quads = [
        (4 * i + j, 4 * ((i + 1) % 4) + j, 4 * ((i + 1) % 4) + (j + 1) % 4, 4 * i + (j + 1) % 4)
        for i in range(4)
        for j in range(4)
    ]
    return vertices, quads[1:]


CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]

FILES = (
    obj("an empty OBJ", "", "`a.obj`", "have faces", "none"),
    obj("an OBJ of points alone", SQUARE, "`a.obj`", "have faces"),
    obj("an OBJ of a binary's bytes", bytes(range(256)) * 40, "`a.obj`"),
    obj("an OBJ of NUL bytes", bytes(5000), "`a.obj`", "have faces"),
    obj("an OBJ in UTF-16", SQUARE.encode("utf-16"), "`a.obj`"),
    obj("an OBJ with NaN", SQUARE.replace("1 1 0", "nan 1 0") + "f 1 2 3\n", "`a.obj`", "be finite", "NaN"),
    obj("an OBJ with infinity", SQUARE.replace("1 1 0", "-inf 1 0") + "f 1 2 3\n", "`a.obj`", "be finite"),
    obj("an OBJ with 1e999", SQUARE.replace("1 1 0", "1e999 1 0") + "f 1 2 3\n", "`a.obj`", "be finite"),
    obj("an OBJ with 1e30 mm", SQUARE.replace("1 1 0", "1e30 1 0") + "f 1 2 3\n", "`a.obj`", "1e+09 mm"),
    obj("an OBJ that names a vertex beyond its last", SQUARE + "f 1 2 9\n", "`a.obj`", "[1, 4]", "9"),
    obj("an OBJ that counts from zero", SQUARE + "f 0 1 2\n", "`a.obj`", "[1, 4]", "0"),
    obj("an OBJ that names vertex -5 of 4", SQUARE + "f -5 1 2\n", "`a.obj`", "[1, 4]", "-5"),
    obj("an OBJ index of 400 digits", SQUARE + f"f {'9' * 400} 1 2\n", "`a.obj`", "[1, 4]"),
    obj("an OBJ index of 10000 digits", SQUARE + f"f {'9' * 10000} 1 2\n", "`a.obj`"),
    obj("an OBJ face of two corners", SQUARE + "f 1 2\n", "`a.obj`", "3 or more"),
    obj("an OBJ with a seam", SQUARE + "vt 0 0\nvt 1 1\nf 1/1 2/1 3/1 4/1\nf 1/2 2/1 3/1\n", "`a.obj`", "no seam"),
    obj("an OBJ textured in part", SQUARE + "vt 0 0\nf 1/1 2/1 3\n", "`a.obj`", "texture coordinate"),
    obj("an OBJ with a texture coordinate NaN", SQUARE + "vt nan 0\nf 1/1 2/1 3/1 4/1\n", "`a.obj`", "be finite"),
    ply("an empty PLY", "", "begin with the word ply"),
    ply("a PLY that is an OBJ", SQUARE + "f 1 2 3\n", "begin with the word ply"),
    ply("a PLY cut in its header", HEAD.format("ascii", 3), "whole PLY header"),
    ply("a PLY cut in its data", BINARY.encode() + _XYZ[:20], "a.ply"),
    ply("a PLY of a billion vertices", BINARY.replace("vertex 3", "vertex 1000000000"), "a.ply"),
    ply("a PLY of 10^30 vertices", HEAD.format("ascii", 10**30) + FACES.format(1) + TRIANGLE, "a.ply"),
    ply("a PLY of 10^30 faces", HEAD.format("ascii", 3) + FACES.format(10**30) + TRIANGLE, "a.ply"),
    ply("a PLY of a billion faces", BINARY.replace("face 1", "face 1000000000").encode() + _XYZ, "a.ply"),
    ply("a PLY of minus one vertex", HEAD.format("ascii", -1) + FACES.format(1) + TRIANGLE, "a.ply"),
    ply("a PLY in an unknown format", HEAD.format("binary_middle_endian", 3) + FACES.format(1), "a.ply"),
    ply("a PLY of an unknown type", HEAD.format("ascii", 3).replace("float x", "quad x") + FACES.format(1), "a.ply"),
    ply("a PLY without z", HEAD.format("ascii", 3).replace("float z", "float w") + FACES.format(1), "x, y and z"),
    ply("a PLY with NaN", HEAD.format("ascii", 3) + FACES.format(1) + TRIANGLE.replace("1 0 0", "nan 0 0"), "finite"),
    ply(
        "a PLY that names vertex 7 of 3",
        HEAD.format("ascii", 3) + FACES.format(1) + TRIANGLE.replace("1 2\n", "1 7\n"),
        "[0, 2]",
        "7",
    ),
    ply("a PLY face of 255 corners that are not there", BINARY.encode() + _XYZ + b"\xff" + bytes(12), "a.ply"),
    ply(
        "a PLY that names a texture file outside",
        HEAD.format("ascii", 3).replace("1.0\n", "1.0\ncomment TextureFile ../../../etc/passwd\n") + FACES.format(0),
        "have faces",
    ),
    Case("a sparse PLY of 200 MB", PLY, ("`a.ply`",), sparse("a.ply", BINARY.encode(), 200_000_000)),
    Case("a sparse OBJ of 400 MB", OBJ, ("`a.obj`",), sparse("a.obj", b"v 0 0 0\n", 400_000_000)),
    Case("a sparse OBJ of 600 MB", OBJ, ("`a.obj`", "536870912 bytes"), sparse("a.obj", b"v 0 0 0\n", 600_000_000)),
    Case(
        "an STL",
        "deskew flatten a.stl -o out/f.ply",
        ("`a.stl`", ".obj or .ply"),
        written("a.stl", "solid x\nendsolid x\n"),
    ),
    Case("a mesh that is not there", OBJ, ("`a.obj`", "be a file", "nothing there")),
)

SHEETS = (
    surface("a closed surface", TETRAHEDRON, "border"),
    surface("three faces at one edge", ([*CORNERS, (0, 0, 1)], [(0, 1, 2), (0, 1, 3), (0, 1, 4)]), "edge"),
    surface("two faces that touch at a corner", ([*CORNERS, (2, 2, 0)], [(0, 1, 2), (0, 3, 4)]), ""),
    surface("two sheets", ([*CORNERS, (9, 9, 0), (10, 9, 0), (9, 10, 0)], [(0, 1, 2), (0, 2, 3), (4, 5, 6)]), "piece"),
    surface("every vertex in one place", ([(1, 1, 1)] * 4, [(0, 1, 2), (0, 2, 3)]), ""),
    surface(
        "a Moebius strip",
        (
            [(np.cos(a), np.sin(a), z) for a in np.arange(6) * np.pi / 3 for z in (0, 1)],
            [f for i in range(5) for f in ((2 * i, 2 * i + 2, 2 * i + 1), (2 * i + 1, 2 * i + 2, 2 * i + 3))]
            + [(10, 1, 11), (11, 1, 0)],
        ),
        "",
    ),
    surface("faces of two corners each", (CORNERS, [(0, 1, 1), (0, 2, 2)]), "have area", "corners given twice only"),
    surface("a surface with a handle", _handle(), "handle"),
)

SCORES = (
    Case(
        "a truth without texture",
        "deskew score bent.ply --truth a.obj",
        ("`a.obj`", "texture coordinates"),
        written("a.obj", SQUARE + "f 1 2 3\n"),
    ),
    Case(
        "a flattening of other vertices",
        "deskew score a.obj --truth bent.obj",
        ("`a.obj`", "30 vertices", "4"),
        written("a.obj", SQUARE + "f 1 2 3\n"),
    ),
    Case(
        "a flattening of other faces",
        "deskew score a.ply --truth bent.obj",
        ("`a.ply`", "faces"),
        changed("a.ply", faces=mesh().faces[:-1]),
    ),
    Case(
        "a flattening wound the other way",
        "deskew score a.ply --truth bent.obj",
        ("`a.ply`", "wound alike"),
        changed("a.ply", faces=mesh().faces[:, ::-1].copy()),
    ),
    Case(
        "a mirrored flattening",
        "deskew score a.obj --truth bent.obj",
        ("mirror",),
        changed(
            "a.obj",
            vertices=np.column_stack(
                [-np.asarray(mesh().texture)[:, 0], np.asarray(mesh().texture)[:, 1], np.zeros(30)]
            ),
            texture=None,
        ),
        code=3,
    ),
    Case(
        "a flattening in one place",
        "deskew score a.obj --truth bent.obj",
        (),
        changed("a.obj", vertices=np.zeros((30, 3)), texture=None),
    ),
    Case(
        "a truth in one place", "deskew score bent.ply --truth a.obj", (), changed("a.obj", texture=np.zeros((30, 2)))
    ),
    Case(
        "a flattening in an unknown format",
        "deskew score c.json --truth bent.obj",
        ("`c.json`", "end in one of", ".json"),
    ),
    Case(
        "a stiffness map for a mesh without texture",
        "deskew flatten a.obj -o out/f.ply --stiffness materials.png",
        ("`a.obj`", "texture coordinates"),
        changed("a.obj", texture=None),
    ),
    Case(
        "a stiffness map for texture in mm",
        "deskew flatten bent.obj -o out/f.ply --stiffness materials.png",
        ("`texture`", "[0, 1]", "40"),
    ),
)


def _axis(here: Path, name: str, values: object) -> None:
    from deskew.io.images import encoded

    (here / "segment" / name).write_bytes(encoded(np.asarray(values, np.float32), ".tif"))


SEGMENT = "deskew flatten segment -o out/f.ply --voxel 0.01"
SEGMENTS = (
    Case("a segment without its voxels' size", "deskew flatten segment -o out/f.ply", ("`--voxel`", "none")),
    Case(
        "a segment of voxels of NaN mm",
        "deskew flatten segment -o out/f.ply --voxel nan",
        ("`voxel`", "(0, 10]", "nan"),
    ),
    Case(
        "a segment without z", SEGMENT, ("`segment/z.tif`", "be a file"), lambda here: (here / "segment/z.tif").unlink()
    ),
    Case(
        "a segment of two sizes",
        SEGMENT,
        ("`segment/y.tif`", "6x5 px", "6x4 px"),
        lambda here: _axis(here, "y.tif", np.zeros((4, 6))),
    ),
    Case(
        "a segment with NaN",
        SEGMENT,
        ("`segment/x.tif`", "finite", "30 pixels"),
        lambda here: _axis(here, "x.tif", np.full((5, 6), np.nan)),
    ),
    Case(
        "a segment that is one hole",
        SEGMENT,
        ("`segment`", "quad"),
        lambda here: _axis(here, "x.tif", np.full((5, 6), -1.0)),
    ),
    Case(
        "a segment of one row",
        SEGMENT,
        ("2 x 2",),
        lambda here: [_axis(here, f"{a}.tif", np.zeros((1, 6))) for a in "xyz"],
    ),
    Case(
        "a segment of whole numbers",
        SEGMENT,
        ("`segment/x.tif`", "float32", "uint16"),
        lambda here: io.write_image(np.zeros((5, 6), np.uint16), here / "segment/x.tif"),
    ),
    Case("a segment cut in its plane", SEGMENT, ("`segment/x.tif`",), cut("segment/x.tif", 60)),
    Case(
        "a segment of another format",
        SEGMENT,
        ("meta.json: format", "tifxyz", "zarr"),
        edited("segment/meta.json", "tifxyz", "zarr"),
    ),
    Case(
        "a segment whose JSON is a list",
        SEGMENT,
        ("`segment/meta.json`", "JSON object"),
        written("segment/meta.json", "[1, 2]"),
    ),
    Case("an empty segment", "deskew flatten out -o out/f.ply --voxel 1", ("`out/x.tif`", "be a file")),
)

CASES: tuple[Case, ...] = FILES + SHEETS + SCORES + SEGMENTS

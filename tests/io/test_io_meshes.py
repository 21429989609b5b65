from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from deskew.errors import InputError, StepError
from deskew.io import Mesh, grid_faces, read_mesh, sheet_mesh, write_mesh
from deskew.types import Sheet

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


@pytest.fixture
def shuffled() -> Mesh:
    """Vertices that no face uses, faces in no order, textures that do not follow the vertices."""
    rng = np.random.default_rng(9)
    vertices, texture = rng.normal(size=(40, 3)), rng.normal(size=(40, 2))
    faces = np.array([rng.permutation(36)[:3] for _ in range(25)])
    return Mesh(vertices, faces, texture)


def obj(mesh: Mesh, order: np.ndarray) -> str:
    """Write with the texture lines in another order than the vertices, every vertex named by some face."""
    assert mesh.texture is not None
    place = np.argsort(order)
    lines = ["# a comment", "mtllib ../../etc/passwd", "o page"]
    lines += ["v " + " ".join(map(repr, row.tolist())) for row in mesh.vertices]
    lines += ["vt " + " ".join(map(repr, row.tolist())) for row in mesh.texture[order]]
    lines += ["vn 0 0 1", "usemtl paper", "s off"]
    lines += ["f " + " ".join(f"{v + 1}/{place[v] + 1}/1" for v in face) for face in mesh.faces]
    return "\n".join(lines)


def test_obj_vertices_and_their_textures_keep_the_files_order(tmp_path: Path, shuffled: Mesh) -> None:
    every = np.concatenate([shuffled.faces, np.arange(39).reshape(-1, 3), [[37, 38, 39]]])
    mesh = Mesh(shuffled.vertices, every, shuffled.texture)
    (tmp_path / "a.obj").write_text(obj(mesh, np.random.default_rng(1).permutation(40)))
    found = read_mesh(tmp_path / "a.obj")
    assert found.vertices.tobytes() == mesh.vertices.tobytes()
    assert np.array_equal(found.faces, mesh.faces)
    assert found.texture is not None
    assert found.texture.tobytes() == mesh.texture.tobytes()  # type: ignore[union-attr]


def test_vertices_that_no_face_uses_stay(tmp_path: Path, shuffled: Mesh) -> None:
    bare = Mesh(shuffled.vertices, shuffled.faces)
    lines = ["v " + " ".join(map(repr, row.tolist())) for row in bare.vertices]
    lines += ["f " + " ".join(str(v + 1) for v in face) for face in bare.faces]
    (tmp_path / "a.obj").write_text("\n".join(lines))
    write_mesh(bare, tmp_path / "a.ply")
    for name in ("a.obj", "a.ply"):
        found = read_mesh(tmp_path / name)
        assert np.array_equal(found.faces, bare.faces)
        assert np.allclose(found.vertices, bare.vertices, rtol=1e-6, atol=0)
        assert found.texture is None


def test_a_ply_keeps_order_and_textures(tmp_path: Path, shuffled: Mesh) -> None:
    write_mesh(shuffled, tmp_path / "a.ply")
    found = read_mesh(tmp_path / "a.ply")
    assert np.array_equal(found.vertices, shuffled.vertices.astype(np.float32))
    assert np.array_equal(found.faces, shuffled.faces)
    assert found.texture is not None
    used = np.unique(shuffled.faces)
    wanted = shuffled.texture.astype(np.float32)  # type: ignore[union-attr]
    assert np.array_equal(found.texture[used], wanted[used])


@pytest.mark.parametrize("with_texture", [True, False])
def test_an_obj_reads_back_bit_for_bit_in_the_same_order(tmp_path: Path, shuffled: Mesh, with_texture: bool) -> None:
    """Also the vertices that no face uses, which trimesh would drop, and two in one place, which it would merge."""
    vertices = shuffled.vertices.copy()
    vertices[7] = vertices[3]
    mesh = Mesh(vertices / 3.0, shuffled.faces, shuffled.texture if with_texture else None)
    write_mesh(mesh, tmp_path / "a.obj")
    found = read_mesh(tmp_path / "a.obj")
    assert found.vertices.tobytes() == mesh.vertices.tobytes()
    assert np.array_equal(found.faces, mesh.faces)
    assert (found.texture is None) == (mesh.texture is None)
    if mesh.texture is not None and found.texture is not None:
        assert found.texture.tobytes() == mesh.texture.tobytes()


def test_another_program_reads_the_obj_that_is_written(tmp_path: Path, shuffled: Mesh) -> None:
    import trimesh

    write_mesh(Mesh(shuffled.vertices, shuffled.faces), tmp_path / "a.obj")
    seen = trimesh.load(tmp_path / "a.obj", process=False, maintain_order=True, force="mesh")
    triangles = shuffled.vertices[shuffled.faces]
    assert np.allclose(np.asarray(seen.vertices)[np.asarray(seen.faces)], triangles, rtol=0, atol=1e-12)


def test_nothing_is_left_of_an_obj_that_cannot_be_written(
    tmp_path: Path, shuffled: Mesh, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*args: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(StepError, match=r"Writing `.*a\.obj` failed: No space left on device"):
        write_mesh(shuffled, tmp_path / "a.obj")
    assert list(tmp_path.iterdir()) == []


def test_negative_indices_and_polygons_are_read(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(SQUARE + "f -4 -3 -2 -1\n")
    assert read_mesh(tmp_path / "a.obj").faces.tolist() == [[0, 1, 2], [0, 2, 3]]


def test_a_byte_order_mark_costs_no_vertex(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_bytes(b"\xef\xbb\xbf" + (SQUARE + "f 1 2 3\n").encode())
    assert len(read_mesh(tmp_path / "a.obj").vertices) == 4


def test_what_else_a_ply_holds_is_passed_over(tmp_path: Path) -> None:
    more = "property float quality\nproperty uchar red\n"
    face = "element face 1\nproperty list uchar int vertex_indices\nproperty uchar flags\n"
    edge = "element edge 1\nproperty int a\nproperty int b\nend_header\n"
    data = "0 0 0 .5 1\n1 0 0 .5 1\n1 1 0 .5 1\n4 0 1 2 3 7\n0 1\n".replace("4 0", "0 1 0 .5 1\n4 0")
    (tmp_path / "a.ply").write_text(PLY.replace("vertex 3", "vertex 4") + more + face + edge + data)
    found = read_mesh(tmp_path / "a.ply")
    assert (len(found.vertices), found.faces.tolist()) == (4, [[0, 1, 2], [2, 3, 0]])


@pytest.mark.parametrize("shape", [(2, 2), (3, 5), (45, 45)])
def test_a_grids_triangles_cover_it_once_facing_the_camera(shape: tuple[int, int]) -> None:
    n_rows, n_columns = shape
    x, y = np.meshgrid(np.arange(n_columns), -np.arange(n_rows))
    grid = np.stack([x, y, 0 * x], axis=-1).astype(float)  # columns along +X, rows along -Y, as a page lies
    mesh = sheet_mesh(Sheet(grid), grid[..., :2])
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    assert np.array_equal(normals, np.tile([0.0, 0.0, 1.0], (2 * (n_rows - 1) * (n_columns - 1), 1)))
    edges = np.sort(np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]]), axis=1)
    n_edges = len(np.unique(edges, axis=0))
    assert len(mesh.vertices) - n_edges + len(mesh.faces) == 1  # Euler's characteristic of a disc


def test_a_grid_of_one_row_is_refused() -> None:
    with pytest.raises(InputError, match="`grid` must have at least 2 x 2 vertices, got 1 x 5"):
        grid_faces(1, 5)


WRONG_OBJ = {
    "empty": ("", "`mesh` must have faces, got none"),
    "no faces": (SQUARE, "`mesh` must have faces, got none"),
    "binary": ("\udcff\udcfe", "must be a valid mesh"),
    "two coordinates": ("v 1 2\nf 1 1 1", "`a line `v`` must hold 3 numbers"),
    "words for numbers": ("v a b c\nf 1 1 1", "must be a valid mesh, got .*could not convert"),
    "NaN": (SQUARE.replace("1 1 0", "nan 1 0") + "f 1 2 3", "`vertices` must be finite"),
    "infinite": (SQUARE.replace("1 1 0", "1e999 1 0") + "f 1 2 3", "`vertices` must be finite"),
    "index beyond": (SQUARE + "f 1 2 9", r"`index` must be in \[1, 4\], got 9"),
    "index zero": (SQUARE + "f 0 1 2", r"`index` must be in \[1, 4\], got 0"),
    "index before": (SQUARE + "f -5 1 2", r"`index` must be in \[1, 4\], got -5"),
    "index a fraction": (SQUARE + "f 1.5 2 3", "must be a valid mesh"),
    "face of two": (SQUARE + "f 1 2", "must name 3 or more vertices"),
    "texture of one number": (SQUARE + "vt 1\nf 1/1 2/1 3/1", "must hold 2 numbers"),
    "texture beyond": (SQUARE + "vt 1 1\nf 1/1 2/2 3/1", r"`index` must be in \[1, 1\], got 2"),
    "texture NaN": (SQUARE + "vt nan 1\nf 1/1 2/1 3/1 4/1", "`texture` must be finite"),
    "texture seam": (SQUARE + "vt 0 0\nvt 1 1\nf 1/1 2/1 3/1 4/1\nf 1/2 2/1 3/1", "`vertex 1` must have one texture"),
    "texture for some": (SQUARE + "vt 0 0\nf 1/1 2/1 3/1", "`every vertex` must have a texture coordinate, got 3"),
}
PLY = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
FACE = "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
WRONG_PLY = {
    "empty": "",
    "cut in its header": PLY,
    "cut in its data": PLY + FACE + "0 0 0\n1 0",
    "index beyond": PLY + FACE + "0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n",
    "index negative": PLY + FACE + "0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n",
    "NaN": PLY + FACE + "0 0 0\nnan 0 0\n0 1 0\n3 0 1 2\n",
    "no faces": PLY + "end_header\n0 0 0\n1 0 0\n0 1 0\n",
    "fewer faces than promised": PLY + FACE.replace("face 1", "face 5") + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    "fewer vertices than promised": PLY.replace("vertex 3", "vertex 9") + FACE + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    "colours only": PLY.replace("float x", "uchar red")
    .replace("float y", "uchar green")
    .replace("float z", "uchar blue")
    + FACE
    + "1 2 3\n1 2 3\n1 2 3\n3 0 1 2\n",
    "beyond all measure": PLY + FACE + "0 0 0\n1e30 0 0\n0 1 0\n3 0 1 2\n",
    "a billion vertices": PLY.replace("vertex 3", "vertex 1000000000").replace("ascii", "binary_little_endian") + FACE,
}


@pytest.mark.parametrize("case", list(WRONG_OBJ))
def test_a_wrong_obj_is_refused(tmp_path: Path, case: str) -> None:
    text, message = WRONG_OBJ[case]
    (tmp_path / "a.obj").write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(InputError, match=rf"a\.obj`.*{message}"):
        read_mesh(tmp_path / "a.obj")


@pytest.mark.parametrize("case", list(WRONG_PLY))
def test_a_wrong_ply_is_refused(tmp_path: Path, case: str) -> None:
    (tmp_path / "a.ply").write_text(WRONG_PLY[case])
    with pytest.raises(InputError, match=r"a\.ply`.* must "):
        read_mesh(tmp_path / "a.ply")


def test_other_formats_are_refused(tmp_path: Path, shuffled: Mesh) -> None:
    with pytest.raises(InputError, match=r"must end in \.obj or \.ply, got \.stl"):
        read_mesh(tmp_path / "a.stl")
    with pytest.raises(InputError, match=r"must end in \.obj or \.ply, got \.stl"):
        write_mesh(shuffled, tmp_path / "a.stl")
    assert list(tmp_path.iterdir()) == []


def strict_ply(data: bytes) -> tuple[list[str], np.ndarray, np.ndarray]:
    """Read a PLY by the format's own description (Turk, 1994) as MeshLab and Blender want it, and nothing else."""
    head, _, body = data.partition(b"end_header\n")
    lines = head.decode().splitlines()
    assert lines[:2] == ["ply", "format binary_little_endian 1.0"]
    comments = [line.removeprefix("comment ") for line in lines if line.startswith("comment ")]
    declared = [line for line in lines[2:] if not line.startswith("comment ")]
    assert declared[0].startswith("element vertex ")
    assert declared[1:6] == [f"property float {name}" for name in "xyzst"]
    assert declared[6].startswith("element face ")
    assert declared[7:] == ["property list uchar int vertex_indices"]
    n, m = int(declared[0].split()[2]), int(declared[6].split()[2])
    vertices = np.frombuffer(body, "<f4", 5 * n).reshape(n, 5)
    faces = np.frombuffer(body, np.dtype([("n", "u1"), ("v", "<i4", 3)]), m, 20 * n)
    assert len(body) == 20 * n + 13 * m
    assert (faces["n"] == 3).all()
    return comments, vertices, faces["v"]


def test_a_ply_is_what_viewers_read_and_names_its_picture(tmp_path: Path, shuffled: Mesh) -> None:
    write_mesh(shuffled, tmp_path / "a.ply", "a-white.png")
    comments, vertices, faces = strict_ply((tmp_path / "a.ply").read_bytes())
    assert "TextureFile a-white.png" in comments
    assert shuffled.texture is not None
    assert np.array_equal(vertices, np.hstack([shuffled.vertices, shuffled.texture]).astype(np.float32))
    assert np.array_equal(faces, shuffled.faces)
    found = read_mesh(tmp_path / "a.ply")
    assert np.array_equal(found.faces, shuffled.faces)


def test_an_obj_names_its_picture_in_a_material(tmp_path: Path, shuffled: Mesh) -> None:
    write_mesh(shuffled, tmp_path / "a.obj", "a-white.png")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.mtl", "a.obj"]
    head = (tmp_path / "a.obj").read_text().splitlines()[:2]
    assert head == ["mtllib a.mtl", "usemtl page"]
    material = dict(line.split(" ", 1) for line in (tmp_path / "a.mtl").read_text().splitlines())
    assert material["newmtl"] == "page"
    assert material["map_Kd"] == "a-white.png"
    assert read_mesh(tmp_path / "a.obj").vertices.tobytes() == shuffled.vertices.tobytes()


@pytest.mark.parametrize("suffix", [".obj", ".ply"])
def test_a_name_that_would_break_the_header_is_refused(tmp_path: Path, shuffled: Mesh, suffix: str) -> None:
    with pytest.raises(InputError, match="be of printable characters"):
        write_mesh(shuffled, tmp_path / f"a{suffix}", "a\nelement vertex 0.png")
    assert list(tmp_path.iterdir()) == []

"""Triangle meshes, OBJ and PLY, with their vertices in the file's own order.

PLY goes through trimesh; OBJ does not, since trimesh would order its vertices anew (see `deskew.io.obj`).
"""

from __future__ import annotations

import io
import re
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from deskew.errors import InputError, require
from deskew.io import obj
from deskew.io.files import read_bytes, shown, write_bytes
from deskew.io.obj import Faces
from deskew.types import Floats, Sheet
from deskew.types.arrays import require_places

MESH_SUFFIXES = (".obj", ".ply")


@dataclass(frozen=True, slots=True)
class Mesh:
    """A triangle mesh.

    Attributes
    ----------
    vertices : (V, 3) array
        Positions [mm].
    faces : (F, 3) int array
        Triangles.
    texture : (V, 2) array or None
        Texture coordinates of each vertex, in whatever unit the file means.
    """

    vertices: Floats
    faces: Faces
    texture: Floats | None = None

    def __post_init__(self) -> None:
        sheet = Sheet(self.vertices, self.faces)  # its checks are these: shape, finite, indices in range
        object.__setattr__(self, "vertices", sheet.vertices)
        if self.texture is not None:
            wanted = (len(self.vertices), 2)
            require(self.texture.shape == wanted, "texture", f"have shape {wanted}", self.texture.shape)
            require_places("texture", self.texture)

    @property
    def sheet(self) -> Sheet:
        """The surface alone, to be flattened."""
        return Sheet(self.vertices, self.faces)


def grid_faces(n_rows: int, n_columns: int) -> Faces:
    """Two triangles a quad of a grid stored row by row, all wound alike.

    Returns
    -------
    (2 (n_rows - 1) (n_columns - 1), 3) int array
        Vertex ``row * n_columns + column``.
    """
    require(min(n_rows, n_columns) >= 2, "grid", "have at least 2 x 2 vertices", f"{n_rows} x {n_columns}")
    at = np.arange(n_rows * n_columns, dtype=np.int64).reshape(n_rows, n_columns)
    a, b, c, d = at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]
    # Rows run towards -Y and columns towards +X, so this winding turns a flat page's front to +Z, the camera.
    return np.stack([np.stack([a, d, b], -1), np.stack([b, d, c], -1)], axis=2).reshape(-1, 3)


def sheet_mesh(sheet: Sheet, texture: Floats | None = None) -> Mesh:
    """Return a sheet as triangles, a grid's vertices row by row; quads that are cut have none.

    Parameters
    ----------
    sheet : Sheet
        Grid or triangles.
    texture : (..., 2) array, optional
        Texture coordinates in the layout of the sheet's vertices.
    """
    faces = grid_faces(*sheet.vertices.shape[:2]) if sheet.faces is None else sheet.faces.astype(np.int64)
    if sheet.cut is not None:
        faces = faces.reshape(-1, 2, 3)[~sheet.cut.ravel()].reshape(-1, 3)
    flat = None if texture is None else np.asarray(texture, dtype=np.float64).reshape(-1, 2)
    return Mesh(sheet.vertices.reshape(-1, 3), faces, flat)


def _obj(data: bytes) -> Mesh:
    # Line by line: all of them at once would take many times the memory of the file.
    with io.TextIOWrapper(io.BytesIO(data), encoding="utf-8-sig") as text:
        return Mesh(*obj.parsed(iter(lambda: text.readline(obj.MAX_LINE + 1), "")))


def _ply(data: bytes) -> Mesh:
    import trimesh  # here, since it takes longer to import than most commands that need no mesh take to run

    require(data.startswith(b"ply"), "mesh", "begin with the word ply", shown(data[:8]))
    header = data.partition(b"end_header")[0]
    require(len(header) < len(data), "mesh", "have a whole PLY header", "no end_header")
    known = re.search(rb"^format\s+(ascii|binary_little_endian|binary_big_endian)\s", header, re.MULTILINE)
    require(known is not None, "format", "be ascii, binary_little_endian or binary_big_endian", "another or none")
    properties = set(re.findall(rb"^property\s+\w+\s+(\w+)\s*$", header, re.MULTILINE))
    require(properties >= {b"x", b"y", b"z"}, "vertices", "have the properties x, y and z", "others")
    # fix_texture would split vertices at seams; no resolver is given, so that no file named inside is opened.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of numbers beyond all measure, which are refused below in one line
        loaded: Any = trimesh.load(
            io.BytesIO(data), file_type="ply", process=False, fix_texture=False, skip_materials=True, force="mesh"
        )
    uv = getattr(loaded.visual, "uv", None)
    texture = None if uv is None else np.array(uv, dtype=np.float64)
    vertices, faces = np.array(loaded.vertices), np.array(loaded.faces, dtype=np.int64).reshape(-1, 3)
    n_vertices, n_faces = (_promised(header, kind) for kind in ("vertex", "face"))
    require(n_faces > 0, "mesh", "have faces", "none")
    # trimesh takes what it finds of a file that was cut short.
    require(len(vertices) == n_vertices, "vertices", f"be {n_vertices}, as the header says", len(vertices))
    require(len(faces) >= n_faces, "faces", f"be {n_faces} or more, as the header says", len(faces))
    return Mesh(vertices, faces, texture)


def _promised(header: bytes, kind: str) -> int:
    """Read from a PLY's header how many elements of a kind there are."""
    found = re.search(rf"^element\s+{kind}\s+(\d+)\s*$".encode(), header, re.MULTILINE)
    return int(found[1]) if found else 0


def read_mesh(path: Path) -> Mesh:
    """Read a triangle mesh; faces of more corners are cut into triangles.

    Parameters
    ----------
    path : Path
        OBJ or PLY [mm].

    Returns
    -------
    Mesh
        Every vertex of the file, in its order. From a PLY, vertices that no face uses have the texture coordinate 0, 0.

    Raises
    ------
    InputError
        If the file is damaged, holds no faces, a coordinate that is not finite, or a texture seam.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    require(suffix in MESH_SUFFIXES, str(path), f"end in {' or '.join(MESH_SUFFIXES)}", suffix or "no suffix")
    data = read_bytes(path)
    try:
        return _obj(data) if suffix == ".obj" else _ply(data)
    except InputError as error:
        raise InputError(f"`{path}`: {error}") from error
    except Exception as error:  # a damaged file surfaces in trimesh as any of a dozen types, none of them its own
        raise InputError(f"`{path}` must be a valid mesh, got {shown(str(error))}.") from error


def _ply_bytes(mesh: Mesh, picture: str | None) -> bytes:
    import trimesh

    solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    if mesh.texture is not None:
        # MeshLab passes over them if they are doubles.
        solid.vertex_attributes["s"], solid.vertex_attributes["t"] = mesh.texture.T.astype(np.float32)
    data = bytes(solid.export(file_type="ply", vertex_normal=False))
    if picture is None:
        return data
    magic, form, rest = data.split(b"\n", 2)
    return b"\n".join([magic, form, f"comment TextureFile {picture}".encode(), rest])


def write_mesh(mesh: Mesh, path: Path, picture: str | None = None) -> None:
    """Write a mesh, vertices in their order, whole or not at all.

    Parameters
    ----------
    mesh : Mesh
        Vertices that no face uses stay.
    path : Path
        A PLY is binary: positions and texture coordinates are float32, good to 0.0001 mm at a metre; the latter become
        the vertex properties ``s`` and ``t`` that MeshLab and Blender read. An OBJ is text that reads back bit for bit.
    picture : str, optional
        Name of the texture's picture beside it: a PLY names it in a comment, as MeshLab wants it, an OBJ in a material
        file of its own name, ``.mtl``, which is written too.

    Raises
    ------
    InputError
        If the suffix is another.
    StepError
        If the file system refuses.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    require(suffix in MESH_SUFFIXES, str(path), f"end in {' or '.join(MESH_SUFFIXES)}", suffix or "no suffix")
    plain = picture is None or (picture.isprintable() and path.name.isprintable())
    require(plain, shown(path.name), "be of printable characters, as the mesh names its picture", "others")
    if suffix == ".ply":
        write_bytes(_ply_bytes(mesh, picture), path)
        return
    material = None if picture is None else path.with_suffix(".mtl")
    if material is not None:
        write_bytes(obj.material(str(picture)).encode(), material)
    library = None if material is None else material.name
    write_bytes(obj.formatted(mesh.vertices, mesh.faces, mesh.texture, library).encode(), path)

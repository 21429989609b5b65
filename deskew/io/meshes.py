"""Triangle meshes, OBJ and PLY, with their vertices in the file's own order.

PLY goes through trimesh. OBJ is read here: trimesh splits vertices at texture seams, drops those that no face uses and
orders the rest anew, and a score against a mesh by another program stands or falls with that order.
"""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from deskew.errors import InputError, require
from deskew.io.files import read_bytes, shown, write_bytes
from deskew.types import Floats, Sheet

Faces = npt.NDArray[np.int64]


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
            require(bool(np.isfinite(self.texture).all()), "texture", "be finite", "NaN or infinity")

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


def _index(word: str, n: int) -> int:
    index = int(word)
    index = index - 1 if index > 0 else n + index  # OBJ counts from 1, or backwards from the end
    require(0 <= index < n, "index", f"be in [1, {n}]", word)
    return index


def _obj(data: bytes) -> Mesh:
    vertices: list[list[float]] = []
    textures: list[list[float]] = []
    faces: list[tuple[int, int, int]] = []
    texture_of: dict[int, int] = {}
    for line in data.decode("utf-8").splitlines():
        keyword, *words = line.split() or [""]
        if keyword == "v":
            require(len(words) >= 3, "a line `v`", "hold 3 numbers", shown(line))
            vertices.append([float(word) for word in words[:3]])
        elif keyword == "vt":
            require(len(words) >= 2, "a line `vt`", "hold 2 numbers", shown(line))
            textures.append([float(word) for word in words[:2]])
        elif keyword == "f":
            corners = [word.split("/") for word in words]
            require(len(corners) >= 3, "a line `f`", "name 3 or more vertices", shown(line))
            at = [_index(corner[0], len(vertices)) for corner in corners]
            faces += [(at[0], at[i], at[i + 1]) for i in range(1, len(at) - 1)]
            for vertex, corner in zip(at, corners, strict=True):
                if len(corner) > 1 and corner[1]:
                    used = texture_of.setdefault(vertex, _index(corner[1], len(textures)))
                    same = textures[used] == textures[_index(corner[1], len(textures))]
                    require(same, f"vertex {vertex + 1}", "have one texture coordinate (no seam)", "two")
    require(len(faces) > 0, "mesh", "have faces", "none")
    texture = None
    if texture_of:
        require(len(texture_of) == len(vertices), "every vertex", "have a texture coordinate", f"{len(texture_of)}")
        texture = np.array([textures[texture_of[i]] for i in range(len(vertices))])
    return Mesh(np.array(vertices), np.array(faces, dtype=np.int64), texture)


def _ply(data: bytes) -> Mesh:
    import trimesh  # here, since it takes longer to import than most commands that need no mesh take to run

    # fix_texture would split vertices at seams; no resolver is given, so that no file named inside is opened.
    loaded: Any = trimesh.load(
        io.BytesIO(data), file_type="ply", process=False, fix_texture=False, skip_materials=True, force="mesh"
    )
    uv = getattr(loaded.visual, "uv", None)
    texture = None if uv is None else np.array(uv, dtype=np.float64)
    return Mesh(np.array(loaded.vertices), np.array(loaded.faces, dtype=np.int64), texture)


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
    require(suffix in (".obj", ".ply"), str(path), "end in .obj or .ply", suffix or "no suffix")
    data = read_bytes(path)
    try:
        return _obj(data) if suffix == ".obj" else _ply(data)
    except InputError as error:
        raise InputError(f"`{path}`: {error}") from error
    except Exception as error:  # a damaged file surfaces in trimesh as any of a dozen types, none of them its own
        raise InputError(f"`{path}` must be a valid mesh, got {shown(str(error))}.") from error


def write_mesh(mesh: Mesh, path: Path) -> None:
    """Write a mesh as binary PLY, whole or not at all; positions are float32, good to 0.0001 mm at a metre.

    Texture coordinates become the vertex properties ``s`` and ``t`` that MeshLab and Blender read.

    Raises
    ------
    InputError
        If the suffix is not ``.ply``.
    StepError
        If the file system refuses.
    """
    import trimesh

    path = Path(path)
    require(path.suffix.lower() == ".ply", str(path), "end in .ply", path.suffix or "no suffix")
    solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    if mesh.texture is not None:
        solid.vertex_attributes["s"], solid.vertex_attributes["t"] = mesh.texture.T
    write_bytes(bytes(solid.export(file_type="ply", vertex_normal=False)), path)

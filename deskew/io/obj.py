"""OBJ text: vertices, one texture coordinate a vertex, and triangles, in the file's own order, exact to the last bit.

trimesh splits vertices at texture seams, drops those that no face uses and orders the rest anew, and a score against a
mesh by another program stands or falls with that order. So OBJ is read and written here.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from deskew.errors import require
from deskew.io.files import shown
from deskew.types import Array, Floats

Faces = npt.NDArray[np.int64]

MAX_LINE = 1 << 20
"""Longest line that is read: a face of a hundred thousand corners."""

_NONE = -1  # no texture coordinate yet


def _index(word: str, n: int) -> int:
    require(len(word) <= 20, "index", f"be in [1, {n}]", shown(word))  # before it is made a number
    index = int(word)
    index = index - 1 if index > 0 else n + index  # OBJ counts from 1, or backwards from the end
    require(0 <= index < n, "index", f"be in [1, {n}]", word)
    return index


def parsed(lines: Iterable[str]) -> tuple[Floats, Faces, Floats | None]:
    """Read the lines of an OBJ; faces of more corners are cut into triangles.

    Returns
    -------
    vertices : (V, 3) array
        Every vertex of the text, in its order.
    faces : (F, 3) int array
        Indices from 0.
    texture : (V, 2) array or None
        Texture coordinate of each vertex, None if no face names one.

    Raises
    ------
    InputError
        If a line is damaged, there are no faces, or a vertex has two texture coordinates or alone has none.
    ValueError
        If a word is no number.
    """
    # Packed numbers: a hundred million bytes of text would be gigabytes as lists.
    vertices, textures, faces = array("d"), array("d"), array("q")
    texture_of = array("q")
    for line in lines:
        require(len(line) <= MAX_LINE, "a line", f"have at most {MAX_LINE} characters", "more")
        keyword, *words = line.split() or [""]
        if keyword == "v":
            require(len(words) >= 3, "a line `v`", "hold 3 numbers", shown(line.rstrip()))
            vertices.extend(map(float, words[:3]))
            texture_of.append(_NONE)
        elif keyword == "vt":
            require(len(words) >= 2, "a line `vt`", "hold 2 numbers", shown(line.rstrip()))
            textures.extend(map(float, words[:2]))
        elif keyword == "f":
            corners = [word.split("/") for word in words]
            require(len(corners) >= 3, "a line `f`", "name 3 or more vertices", shown(line.rstrip()))
            at = [_index(corner[0], len(texture_of)) for corner in corners]
            for i in range(1, len(at) - 1):
                faces.extend((at[0], at[i], at[i + 1]))
            for vertex, corner in zip(at, corners, strict=True):
                if len(corner) > 1 and corner[1]:
                    _name_texture(texture_of, vertex, _index(corner[1], len(textures) // 2), textures)
    require(len(faces) > 0, "mesh", "have faces", "none")
    places, flat = np.array(vertices).reshape(-1, 3), np.array(textures).reshape(-1, 2)
    return places, np.array(faces, dtype=np.int64).reshape(-1, 3), _texture(flat, np.array(texture_of))


def _name_texture(texture_of: array[int], vertex: int, named: int, textures: array[float]) -> None:
    """Give a vertex its texture coordinate; it may have the same one twice, and no other."""
    used = texture_of[vertex]
    if used == _NONE:
        texture_of[vertex] = used = named
    same = used == named or textures[2 * used : 2 * used + 2] == textures[2 * named : 2 * named + 2]
    require(same, f"vertex {vertex + 1}", "have one texture coordinate (no seam)", "two")


def _texture(textures: Floats, texture_of: npt.NDArray[np.int64]) -> Floats | None:
    """One coordinate a vertex; where the two lists run side by side, also of those that no face uses."""
    named = texture_of != _NONE
    if not named.any():
        return None
    n_vertices, used = len(texture_of), np.flatnonzero(named)
    if len(textures) == n_vertices and np.array_equal(texture_of[used], used):
        return textures
    require(bool(named.all()), "every vertex", "have a texture coordinate", f"{int(named.sum())}")
    return textures[texture_of]


def _lines(keyword: str, rows: Array) -> Iterable[str]:
    # repr is the shortest text that reads back as the very same number.
    return (f"{keyword} {' '.join(map(repr, row))}\n" for row in rows.tolist())


MATERIAL = "page"


def material(picture: str) -> str:
    """Write the text of a material file: a matt surface that shows a picture."""
    return f"newmtl {MATERIAL}\nKa 0 0 0\nKd 1 1 1\nKs 0 0 0\nillum 1\nmap_Kd {picture}\n"


def formatted(vertices: Floats, faces: Array, texture: Floats | None, library: str | None = None) -> str:
    """Write OBJ text that :func:`parsed` reads back bit for bit.

    Parameters
    ----------
    vertices : (V, 3) array
        Positions.
    faces : (F, 3) int array
        Indices from 0.
    texture : (V, 2) array or None
        Texture coordinate of each vertex.
    library : str, optional
        Name of the file that holds :func:`material`.
    """
    lines = [] if library is None else [f"mtllib {library}\n", f"usemtl {MATERIAL}\n"]
    lines += _lines("v", np.asarray(vertices, dtype=np.float64))
    if texture is not None:
        lines += _lines("vt", np.asarray(texture, dtype=np.float64))
    corner = "{0}" if texture is None else "{0}/{0}"
    words = [corner.format(i + 1) for i in range(len(vertices))]
    lines += (f"f {words[a]} {words[b]} {words[c]}\n" for a, b, c in np.asarray(faces).tolist())
    return "".join(lines)

"""Stiffness maps: which material lies where, a picture of labels, and how stiff each is, a table beside it.

`materials.png` holds a label a pixel, in the frame of the texture that it belongs to: the raw white image of a scan, or
the picture that a mesh's texture coordinates point into. `materials.toml` beside it holds the constants [kg/s^2]:

    [stiffness]
    0 = 30.0
    255 = 0.3
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from deskew.errors import InputError, require, require_positive
from deskew.io.files import read_head, read_toml, replacing, shown
from deskew.io.images import encoded, read_image
from deskew.io.meshes import Mesh
from deskew.types import Array, Floats

MAX_STIFFNESS = 1e9
"""Largest spring constant that is taken for one [kg/s^2]; the paper's sheets have 30."""

_COLOURS = {0: "grey", 2: "RGB", 3: "palette", 4: "grey with alpha", 6: "RGB with alpha"}


@dataclass(frozen=True, slots=True)
class StiffnessMap:
    """Spring constants by material.

    Attributes
    ----------
    labels : (height, width) array of unsigned integers
        Material of each pixel.
    constants : mapping of label to float
        Spring constant k_s of each material [kg/s^2]; materials that lie nowhere may be there too.
    """

    labels: Array
    constants: Mapping[int, float]

    def __post_init__(self) -> None:
        whole = self.labels.ndim == 2 and self.labels.size > 0 and self.labels.dtype.kind == "u"
        require(whole, "labels", "be a non-empty (height, width) array of unsigned integers", self.labels.shape)
        for label, constant in self.constants.items():
            require_positive(f"stiffness.{label}", constant, MAX_STIFFNESS, "kg/s^2")
        unknown = sorted({int(label) for label in np.unique(self.labels)} - set(self.constants))
        named = ", ".join(map(str, unknown[:8])) + (", ..." if len(unknown) > 8 else "")
        require(not unknown, "stiffness", "have a constant for every label of the map", f"none for {named}")

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) [px]."""
        return (self.labels.shape[1], self.labels.shape[0])

    def at(self, pixels: Floats) -> Floats:
        """Spring constant at the nearest pixel; beyond the border, that of the border.

        Parameters
        ----------
        pixels : (N, 2) array
            Places (x, y); (0, 0) is the centre of the first pixel.

        Returns
        -------
        (N,) array
            k_s [kg/s^2].
        """
        require(bool(np.isfinite(pixels).all()), "pixels", "be finite", "NaN or infinity")
        x, y = (np.clip(np.rint(pixels[:, i]), 0, self.size[i] - 1).astype(np.int64) for i in (0, 1))
        known, which = np.unique(self.labels[y, x], return_inverse=True)
        return np.array([self.constants[int(label)] for label in known], dtype=np.float64)[which]


def _labels(path: Path) -> npt.NDArray[Any]:
    # The decoder would spread 1, 2 or 4 bits over 0..255 and turn a palette into colours: not the file's labels.
    labels = read_image(path)
    depth, colour = read_head(path, 26)[24:26]
    kind = f"{depth}-bit {_COLOURS.get(colour, 'colour')}"
    require(colour == 0 and depth in (8, 16), str(path), "be 8-bit or 16-bit grey, a label a pixel", kind)
    return labels


def _constants(path: Path) -> dict[int, float]:
    tables = read_toml(path)
    table = tables.get("stiffness")
    only = isinstance(table, dict) and set(tables) == {"stiffness"}
    require(only, str(path), "hold one table [stiffness]", shown(sorted(tables)))
    constants = {}
    for key, value in dict(table or {}).items():
        # Short before it is a number: Python refuses to make one of thousands of digits.
        plain = len(key) <= 5 and key.isascii() and key.isdigit() and str(int(key)) == key and int(key) < 1 << 16
        require(plain, f"{path}: {shown(key)}", "be a label in [0, 65535]", shown(key))
        require_positive(f"{path}: {key}", value, MAX_STIFFNESS, "kg/s^2")
        constants[int(key)] = float(value)
    return constants


def read_stiffness(path: Path) -> StiffnessMap:
    """Read a stiffness map: a PNG of labels, and the TOML table of the same name beside it.

    Parameters
    ----------
    path : Path
        The PNG, 8-bit or 16-bit grey.

    Raises
    ------
    InputError
        If either is missing or damaged, the picture is no plain grey one, or a label has no constant.
    """
    path = Path(path)
    require(path.suffix.lower() == ".png", str(path), "end in .png", path.suffix or "no suffix")
    labels, constants = _labels(path), _constants(path.with_suffix(".toml"))
    try:
        return StiffnessMap(labels, constants)
    except InputError as error:
        raise InputError(f"`{path.with_suffix('.toml')}`: {error}") from error


def write_stiffness(materials: StiffnessMap, path: Path, names: Mapping[int, str] | None = None) -> None:
    """Write a stiffness map as :func:`read_stiffness` reads it: the PNG, and the TOML table of the same name beside it.

    Both are whole before either takes its name.

    Parameters
    ----------
    materials : StiffnessMap
        Labels up to 255 make an 8-bit picture, larger ones a 16-bit one.
    path : Path
        The PNG.
    names : mapping of label to str, optional
        What the materials are called, kept as comments beside their constants.

    Raises
    ------
    InputError
        If `path` does not end in .png, or a label is beyond 65535.
    StepError
        If the file system refuses.
    """
    path = Path(path)
    require(path.suffix.lower() == ".png", str(path), "end in .png", path.suffix or "no suffix")
    most = max([int(materials.labels.max()), *materials.constants])
    require(most < 1 << 16, "labels", "be in [0, 65535]", most)
    labels = materials.labels.astype(np.uint8 if most < 1 << 8 else np.uint16)
    lines = ["[stiffness]"]
    for label, constant in sorted(materials.constants.items()):
        name = "".join(c for c in (names or {}).get(label, "") if c.isprintable())
        lines.append(f"{label} = {float(constant)!r}" + (f"  # {name}" if name else ""))
    table = path.with_suffix(".toml")
    with replacing(path) as picture, replacing(table) as text:
        picture.write_bytes(encoded(labels, ".png"))
        text.write_text("\n".join([*lines, ""]), encoding="utf-8")


def face_stiffness(mesh: Mesh, materials: StiffnessMap) -> Floats:
    """Sample a stiffness map at the middle of each face of a mesh, by its texture coordinates.

    Parameters
    ----------
    mesh : Mesh
        With texture coordinates in [0, 1], their origin the picture's lower left corner.
    materials : StiffnessMap
        In the frame of the mesh's texture.

    Returns
    -------
    (F,) array
        k_s [kg/s^2].

    Raises
    ------
    InputError
        If the mesh has no texture coordinates, or some outside [0, 1].
    """
    require(mesh.texture is not None, "mesh", "have texture coordinates to find its materials by", "none")
    corners = np.asarray(mesh.texture)[mesh.faces]
    low, high = float(corners.min()), float(corners.max())
    require(low >= -1e-6 and high <= 1 + 1e-6, "texture", "lie in [0, 1]", f"{low:.6g} to {high:.6g}")
    s, t = corners.mean(axis=1).T
    width, height = materials.size
    # A pixel's centre lies half a pixel inside, and rows run downwards.
    return materials.at(np.column_stack([s * width - 0.5, (1.0 - t) * height - 0.5]))

"""A page as a surface: scanned, flattened, restored (sections 3 and 3.5)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from numbers import Real
from typing import Any

import numpy as np
import numpy.typing as npt

from deskew.errors import require
from deskew.types.arrays import Array, Floats, require_numbers, require_places
from deskew.types.depth import DepthMap, ProjectorCheck
from deskew.types.devices import Pinhole

STIFFNESS_RANGE = 1e-9, 1e12
"""Smallest and largest spring constant [kg/s^2]: beyond them arithmetic overflows, long after anything is physical."""


@dataclass(frozen=True, slots=True)
class Sheet:
    """A surface to be flattened.

    Attributes
    ----------
    vertices : (R, C, 3) grid or (V, 3) array
        Positions in the world [mm]; a grid's rows run along the page's v, its columns along u.
    faces : (F, 3) int array or None
        Triangles; None for a grid.
    stiffness : (R - 1, C - 1) or (F,) array or None
        Spring constant k_s of each quad of a grid, or of each face [kg/s^2]; None for the method's own uniform value.
    cut : (R - 1, C - 1) bool array or None
        Quads of a grid across which the surface breaks off: nothing joins their sides. None for a sheet in one piece.
    surface : ((R - 1) n + 1, (C - 1) n + 1, 3) array or None
        The surface that a grid was taken from, sampled n >= 2 times as finely along the grid's own rows and columns
        [mm]: every n-th of its vertices is one of the grid's. None where only the grid is known.
    crease_width : float
        Width over which `surface` rounds what is sharp, in its own steps, in [0, 10]; 0 for samples without error.
    """

    vertices: Floats
    faces: npt.NDArray[np.integer[Any]] | None = None
    stiffness: Floats | None = None
    cut: npt.NDArray[np.bool_] | None = None
    surface: Floats | None = None
    crease_width: float = 0.0

    def __post_init__(self) -> None:
        require_numbers("vertices", self.vertices, "fiu")
        if self.faces is not None:
            require_numbers("faces", self.faces, "iu")
        vertices = np.ascontiguousarray(self.vertices, dtype=np.float64)
        object.__setattr__(self, "vertices", vertices)
        if self.faces is None:
            shape = vertices.shape
            grid = vertices.ndim == 3 and shape[2] == 3 and min(shape[:2]) >= 2
            require(grid, "vertices", "have shape (R, C, 3) with R, C >= 2 when `faces` is None", shape)
        else:
            require(vertices.ndim == 2 and vertices.shape[1] == 3, "vertices", "have shape (V, 3)", vertices.shape)
            require(self.faces.ndim == 2 and self.faces.shape[1] == 3, "faces", "have shape (F, 3)", self.faces.shape)
            n = len(vertices)
            require(n > 0, "vertices", "be 1 or more", n)
            require(len(self.faces) > 0, "faces", "be 1 or more", 0)
            low, high = int(self.faces.min()), int(self.faces.max())
            require(low >= 0 and high < n, "faces", f"have indices in [0, {n - 1}]", low if low < 0 else high)
        require_places("vertices", vertices)
        self._check_stiffness()
        if self.cut is not None:
            shape = (vertices.shape[0] - 1, vertices.shape[1] - 1)
            array = isinstance(self.cut, np.ndarray)
            got = f"{self.cut.dtype} of shape {self.cut.shape}" if array else type(self.cut).__name__
            sound = array and self.faces is None and self.cut.shape == shape and self.cut.dtype == np.bool_
            require(sound, "cut", f"be bool of shape {shape}, one value a quad of a grid", got)
            require(not self.cut.all(), "cut", "leave a quad whole", "every quad cut")
        self._check_surface()

    @property
    def refinement(self) -> int:
        """How many steps of `surface` lie between two neighbours of the grid; 1 without a surface."""
        return 1 if self.surface is None else (self.surface.shape[0] - 1) // (self.vertices.shape[0] - 1)

    def _check_stiffness(self) -> None:
        if self.stiffness is None:
            return
        require_numbers("stiffness", self.stiffness, "fiu")
        rows, columns = self.vertices.shape[:2]
        shape = (rows - 1, columns - 1) if self.faces is None else (len(self.faces),)
        each = "quad" if self.faces is None else "face"
        require(
            self.stiffness.shape == shape, "stiffness", f"have shape {shape}, one value a {each}", self.stiffness.shape
        )
        least, most = STIFFNESS_RANGE
        low, high = float(self.stiffness.min()), float(self.stiffness.max())  # both NaN if any is
        sound = least <= low and high <= most
        require(sound, "stiffness", f"be in [{least:g}, {most:g}] [kg/s^2]", f"{low:g} to {high:g}")

    def _check_surface(self) -> None:
        width = self.crease_width
        real = isinstance(width, Real) and not isinstance(width, bool) and 0 <= width <= 10
        require(real, "crease_width", "be in [0, 10] steps of the surface", repr(width))
        if self.surface is None:
            return
        require_numbers("surface", self.surface, "fiu")
        object.__setattr__(self, "surface", np.ascontiguousarray(self.surface, dtype=np.float64))
        require(self.faces is None, "surface", "belong to a grid", "a triangle mesh")
        rows, columns = self.vertices.shape[:2]
        n = self.refinement
        nested = n >= 2 and self.surface.shape == ((rows - 1) * n + 1, (columns - 1) * n + 1, 3)
        require(nested, "surface", f"have shape ({rows - 1} n + 1, {columns - 1} n + 1, 3), n >= 2", self.surface.shape)
        require_places("surface", self.surface)
        same = np.abs(self.surface[::n, ::n] - self.vertices).max() <= 1e-6 * max(
            1.0, float(np.abs(self.vertices).max())
        )
        require(bool(same), "surface", f"hold the grid as every {n}-th of its vertices", "other places")


class Status(StrEnum):
    """How a flattening ended."""

    AT_REST = "at_rest"
    LOCKED = "locked"
    FOLDED = "folded"
    DIVERGED = "diverged"


@dataclass(frozen=True, slots=True)
class Flattened:
    """A sheet after flattening.

    Attributes
    ----------
    vertices : array of the sheet's shape
        Final positions in the world [mm]; z = 0 wherever `status` is `AT_REST`.
    status : Status
        How it ended.
    remedy : str
        What to try when `status` is not `AT_REST`; empty otherwise.
    counters : mapping
        `steps`, `steps_rejected`, `force_evaluations`, `contacts`, `folded_quads`, `spring_energy` [uJ], ...
        whatever the method counts.
    surface : array of the shape of the sheet's `surface`, or None
        Final places of the surface inside the grid's quads [mm], where the method follows it there.
    history : mapping of name to (n,) array
        How the run went, where the method has a course in time: `time_s`, energies [uJ], ...
    """

    vertices: Floats
    status: Status
    remedy: str = ""
    counters: Mapping[str, float] = field(default_factory=dict)
    surface: Floats | None = None
    history: Mapping[str, Floats] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Scan:
    """What acquisition hands on: everything a restoration method may see.

    Attributes
    ----------
    images : mapping of light name to (height, width[, 3]) array
        Raw camera images; always holds "white".
    depth : DepthMap
        Depth on the undistorted grid.
    camera : Pinhole
        The raw camera, with its distortion.
    sheet : Sheet
        The page as a grid over its outline.
    outline : (4, 2) array
        The page's corners on the undistorted grid [px], in the grid's order: first row's first and last vertex, last
        row's last and first.
    projector : ProjectorCheck
        What the capture's frames say about the projector; a file does not keep it.
    filled_fraction : float
        Share of the sheet's inner vertices whose depth was not measured but carried over from the surroundings.
    unit : str
        Unit of every length, the calibration's.
    profiles : mapping of light name to bytes
        ICC colour profiles of the images that have one.
    """

    images: Mapping[str, Array]
    depth: DepthMap
    camera: Pinhole
    sheet: Sheet
    outline: Floats
    projector: ProjectorCheck = field(default_factory=ProjectorCheck)
    filled_fraction: float = 0.0
    unit: str = "mm"
    profiles: Mapping[str, bytes] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Restoration:
    """A restored page (section 3.5).

    Attributes
    ----------
    image : (height, width[, 3]) array
        The undistorted pinhole view of the flattened page on Z = 0; 0 outside the page.
    backward_map : (height, width, 2) float32 array
        Raw camera pixel (x, y) that each restored pixel came from, NaN outside the page.
    camera : Pinhole
        The ideal camera that the view is seen through.
    flattened : Flattened or None
        The geometry behind it, where the method tells it.
    """

    image: Array
    backward_map: npt.NDArray[np.float32]
    camera: Pinhole
    flattened: Flattened | None = None


@dataclass(frozen=True, slots=True)
class Dewarped:
    """A page flattened in its picture alone, without knowledge of its shape.

    Attributes
    ----------
    image : (height, width[, 3]) array
        The flat page, at the method's own size: it has no scale.
    backward_map : (height, width, 2) float32 array or None
        Raw camera pixel (x, y) that each pixel came from, NaN where it shows nothing; None if the method has none.
    """

    image: Array
    backward_map: npt.NDArray[np.float32] | None = None

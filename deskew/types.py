"""What passes between the stages: frozen data that checks itself, and no mathematics.

Lengths are millimetres, angles radians. The world's Z = 0 is the bed that the page lies on, Z points up, towards the
camera. Pixel (0, 0) is the centre of the first pixel. Images are (height, width[, 3]); sizes are (width, height).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import IntEnum, StrEnum
from itertools import pairwise
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from deskew.errors import is_whole, require, require_positive, require_whole

Array = npt.NDArray[Any]
Floats = npt.NDArray[np.floating[Any]]
Size = tuple[int, int]
WHITE = "white"  # the light under which every capture is taken


def _require_finite(name: str, values: Array, shape: tuple[int, ...]) -> None:
    require(values.shape == shape, name, f"have shape {shape}", values.shape)
    require(bool(np.isfinite(values).all()), name, "be finite", "NaN or infinity")


def _require_numbers(name: str, values: object, kinds: str) -> None:
    """Require an array of one of numpy's `kinds`: "iu" of whole numbers, "fiu" of real ones."""
    got = values.dtype if isinstance(values, np.ndarray) else type(values).__name__
    good = isinstance(values, np.ndarray) and values.dtype.kind in kinds
    require(good, name, f"be an array of {'whole' if kinds == 'iu' else 'real'} numbers", got)


def _require_size(name: str, size: Size) -> None:
    require(len(size) == 2 and min(size) >= 1, name, "be (width, height) of at least 1 pixel", size)


@dataclass(frozen=True, slots=True)
class Pinhole:
    """A camera, or a projector seen as an inverse camera: a pinhole with Brown's lens distortion (section 2.2).

    Attributes
    ----------
    size : (width, height)
        Pixels.
    K : (3, 3) array
        Intrinsics [px], last row (0, 0, 1).
    distortion : (5,) array
        k1, k2, p1, p2, k3, dimensionless, in OpenCV's order; zeros for an ideal camera.
    R, t : (3, 3) and (3,) arrays
        World to device: ``x = R X + t`` [mm].
    """

    size: Size
    K: Floats
    distortion: Floats
    R: Floats
    t: Floats

    def __post_init__(self) -> None:
        _require_size("size", self.size)
        for name, shape in (("K", (3, 3)), ("distortion", (5,)), ("R", (3, 3)), ("t", (3,))):
            values = np.asarray(getattr(self, name), dtype=np.float64)
            object.__setattr__(self, name, values)
            _require_finite(name, values, shape)
        focal = (float(self.K[0, 0]), float(self.K[1, 1]))
        require(min(focal) > 0, "K", "have positive focal lengths", focal)
        require(bool(np.allclose(self.R @ self.R.T, np.eye(3), atol=1e-6)), "R", "be a rotation", self.R.tolist())
        require(float(np.linalg.det(self.R)) > 0, "R", "be a rotation, not a reflection", "determinant -1")


class PatternKind(StrEnum):
    """How the projector codes its coordinates (section 2.3)."""

    LINE_SWEEP = "line_sweep"
    GRAY_CODE = "gray_code"
    GRAY_PHASE = "gray_phase"
    MULTI_PHASE = "multi_phase"


@dataclass(frozen=True, slots=True)
class Fringe:
    """Sinusoidal frames of one period, shifted step by step.

    Frame n of N lights projector line x by ``(1 + cos(2 pi x / period - 2 pi n / N)) / 2`` of full light.

    Attributes
    ----------
    period_px : float
        Projector pixels.
    n_steps : int
        Frames N, in [4, 256]: three would leave nothing to tell noise and harmonics by.
    """

    period_px: float
    n_steps: int

    def __post_init__(self) -> None:
        require_positive("period_px", self.period_px, 1e6, "px")
        require(self.period_px >= 4, "period_px", "be at least 4 px", self.period_px)
        require_whole("n_steps", self.n_steps, 4, 256)


Fringes = tuple[Fringe, ...]


def n_planes(extent: int) -> int:
    """Gray-code frames for `extent` projector columns or rows: one a bit, each followed by its inverse."""
    return 2 * max(1, (extent - 1).bit_length())


def half_periods(fringe: Fringe, extent: int) -> int:
    """Half periods of a fringe, in whole pixels, that cover `extent` projector columns or rows."""
    return -(-extent // (int(fringe.period_px) // 2))


def n_frames(pattern: PatternKind, extent: int, fringes: Fringes = ()) -> int:
    """Frames that code `extent` projector columns or rows, laid out as :class:`Capture` says."""
    if pattern is PatternKind.LINE_SWEEP:
        return extent
    if pattern is PatternKind.GRAY_CODE:
        return n_planes(extent)
    planes = n_planes(half_periods(fringes[0], extent)) if pattern is PatternKind.GRAY_PHASE else 0
    return planes + sum(fringe.n_steps for fringe in fringes)


def require_fringes(pattern: PatternKind, fringes: Fringes, projector_size: Size) -> None:
    """Raise an InputError unless `fringes` are what the pattern needs to tell every line of the projector."""
    periods = [fringe.period_px for fringe in fringes]
    if pattern is PatternKind.GRAY_PHASE:
        even = len(periods) == 1 and periods[0] % 2 == 0
        require(even, "fringes", f"be one of an even period for a {pattern}", periods)
    elif pattern is PatternKind.MULTI_PHASE:
        falling = len(periods) >= 2 and all(a > b for a, b in pairwise(periods))
        require(falling, "fringes", f"be two or more of falling periods for a {pattern}", periods)
        extent = max(projector_size)
        require(periods[0] >= extent, "fringes", f"begin with a period of at least the projector's {extent}", periods)
    else:
        require(not periods, "fringes", f"be none for a {pattern}", periods)


class Frames(Protocol):
    """A sequence of frames that is read or rendered one at a time and never held whole."""

    def __len__(self) -> int:
        """Return the number of frames."""
        ...

    def __iter__(self) -> Iterator[Array]:
        """Yield each frame, (height, width) or (height, width, 3), in projection order."""
        ...


@dataclass(frozen=True, slots=True)
class Capture:
    """What the camera recorded of one still page or board; a rig and a folder enter by this same door.

    Attributes
    ----------
    white, black : (height, width[, 3]) arrays
        The scene under the fully lit and the dark projector.
    projector_size : (width, height)
        Pixels of the projector.
    pattern : PatternKind
        `LINE_SWEEP`: frame i of `columns` lights projector column i, and likewise `rows`.
        `GRAY_CODE`: `columns` and `rows` hold the bit planes, most significant first, each followed by its inverse.
        `GRAY_PHASE`: the bit planes of the number of the half period ``floor(2 x / period)``, then the fringe's steps.
        `MULTI_PHASE`: the steps of each fringe, one after another.
    columns, rows : Frames
        The two sweeps; both are needed for epipolar culling.
    textures : mapping of light name to image
        Further images through the same optics, at any resolution (section 2.4).
    fringes : tuple of Fringe
        Of the phase patterns, the same for columns and rows: one of an even period for `GRAY_PHASE`; for `MULTI_PHASE`
        two or more, the longest period first and no shorter than the projector's larger side.
    """

    white: Array
    black: Array
    projector_size: Size
    pattern: PatternKind
    columns: Frames
    rows: Frames
    textures: Mapping[str, Array] = field(default_factory=dict)
    fringes: Fringes = ()

    def __post_init__(self) -> None:
        _require_size("projector_size", self.projector_size)
        require_fringes(self.pattern, self.fringes, self.projector_size)
        require(WHITE not in self.textures, "textures", "have names of their own", f"one called {WHITE}")
        for name in ("white", "black"):
            image = getattr(self, name)
            require(isinstance(image, np.ndarray), name, "be an array of grey levels", type(image).__name__)
        picture = self.white.ndim in (2, 3) and self.white.size > 0
        require(picture, "white", "be (height, width[, 3]) of at least 1 pixel", self.white.shape)
        require(
            self.black.shape == self.white.shape, "black", f"have white's shape {self.white.shape}", self.black.shape
        )
        for name, frames, extent in (
            ("columns", self.columns, self.projector_size[0]),
            ("rows", self.rows, self.projector_size[1]),
        ):
            wanted = n_frames(self.pattern, extent, self.fringes)
            require(len(frames) == wanted, name, f"hold {wanted} frames for a {self.pattern} of {extent}", len(frames))

    @property
    def camera_size(self) -> Size:
        """Width and height of the camera's images [px]."""
        return self.white.shape[1], self.white.shape[0]


@dataclass(frozen=True, slots=True)
class Board:
    """The printed checkerboard that both devices are calibrated on (section 2.2).

    Attributes
    ----------
    shape : (nx, ny)
        Inner corners along the board's X and Y; one odd and one even, so that a half turn cannot be mistaken.
    square : float
        Side of a square, in `unit`.
    unit : str
        Unit of length that every result is in.
    """

    shape: tuple[int, int]
    square: float
    unit: str = "mm"

    def __post_init__(self) -> None:
        corners = len(self.shape) == 2 and all(is_whole(n, 3, 1000) for n in self.shape)
        require(corners, "shape", "be (nx, ny) of at least 3 inner corners, at most 1000", self.shape)
        require(bool(np.isfinite(self.square)) and self.square > 0, "square", "be a positive length", self.square)


class Reason(IntEnum):
    """Why a pixel has no depth; `OK` has one."""

    OK = 0
    SHADOW = 1
    SATURATED = 2
    WEAK = 3
    TWO_PEAKS = 4
    EPIPOLAR = 5
    RANGE = 6
    EDGE = 7


def _require_reasons(reason: Array) -> None:
    known = reason.dtype.kind in "iu" and bool(((reason >= 0) & (reason <= max(Reason))).all())
    require(known, "reason", f"hold whole numbers in [0, {int(max(Reason))}]", f"others, of type {reason.dtype}")


@dataclass(frozen=True, slots=True)
class ProjectorCheck:
    """What the frames of a capture say about the projector, and the camera, that made them.

    Attributes
    ----------
    faults : tuple of str
        A plain sentence for each fault found; empty where the frames agree with one another.
    gamma : float or None
        Fringes only: brightness seen grows with the light asked for to this power, 1 for a linear projector and camera.
    stray : float or None
        Share of a frame's light, root mean square, that comes from a frame other than the one its place in the sequence
        says; 0 if camera and projector are in step. None if hardly any pixel was bright enough to tell.
    """

    faults: tuple[str, ...] = ()
    gamma: float | None = None
    stray: float | None = None


@dataclass(frozen=True, slots=True)
class Correspondence:
    """Projector coordinates seen by each raw camera pixel.

    Attributes
    ----------
    column, row : (height, width) arrays
        Projector coordinates [px], NaN where `reason` is not 0.
    reason : (height, width) uint8 array
        `Reason` of each pixel.
    stripe_px : (width, height) or None
        Of a sweep read curve by curve: typical standard deviation of a stripe of the columns across image rows and of
        one of the rows across image columns [camera px]. None if each pixel was read by itself.
    projector : ProjectorCheck
        What the frames say about the projector.
    """

    column: Floats
    row: Floats
    reason: npt.NDArray[np.uint8]
    stripe_px: tuple[float, float] | None = None
    projector: ProjectorCheck = ProjectorCheck()

    def __post_init__(self) -> None:
        shape = self.column.shape
        require(len(shape) == 2, "column", "be (height, width)", shape)
        require(self.row.shape == shape, "row", f"have column's shape {shape}", self.row.shape)
        require(self.reason.shape == shape, "reason", f"have column's shape {shape}", self.reason.shape)
        _require_reasons(self.reason)
        widths = self.stripe_px
        good = widths is None or (len(widths) == 2 and all(np.isfinite(w) and w >= 0 for w in widths))
        require(good, "stripe_px", "be two finite widths of at least 0 [camera px], or None", widths)


@dataclass(frozen=True, slots=True)
class Calibration:
    """Both devices in the world that board pose 00 defines (section 2.2).

    Attributes
    ----------
    camera, projector : Pinhole
        The devices.
    residuals : mapping
        `camera_rms_px`, `projector_rms_px`, `stereo_rms_px`: root mean square of the radial reprojection error; with
        four boards or more `held_out_camera_rms_px`, `held_out_projector_rms_px` and `held_out_length_rms` [`unit`],
        on boards that were left out.
    uncertainty : mapping of parameter name to one standard deviation
        In the parameter's own unit.
    n_poses : int
        Boards used.
    unit : str
        Unit of length of the board's squares; "mm" unless the board states otherwise.
    camera_psf_px : float or None
        Standard deviation of a camera pixel's footprint, lens and pixel area together, as the boards' edges show it
        [px]; None if it is not known.
    convergence : mapping
        `steps` taken until the bundle rested, and the `condition` number of its scaled Jacobian: by so much the
        worst-determined mixture of parameters is known less well than the best.
    """

    camera: Pinhole
    projector: Pinhole
    residuals: Mapping[str, float]
    uncertainty: Mapping[str, float] = field(default_factory=dict)
    n_poses: int = 0
    unit: str = "mm"
    camera_psf_px: float | None = None
    convergence: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        psf = self.camera_psf_px
        good = psf is None or (bool(np.isfinite(psf)) and psf > 0)
        require(good, "camera_psf_px", "be finite and positive [px], or None", psf)


@dataclass(frozen=True, slots=True)
class DepthMap:
    """Depth in the camera's frame on the UNDISTORTED pixel grid (section 2.3).

    Attributes
    ----------
    z : (height, width) array
        Camera z [mm], NaN exactly where `reason` is not 0.
    reason : (height, width) uint8 array
        `Reason` of each pixel.
    camera : Pinhole
        The ideal camera (zero distortion) whose pixels these are.
    """

    z: Floats
    reason: npt.NDArray[np.uint8]
    camera: Pinhole

    def __post_init__(self) -> None:
        width, height = self.camera.size
        require(self.z.shape == (height, width), "z", f"have the camera's shape {(height, width)}", self.z.shape)
        require(self.reason.shape == self.z.shape, "reason", f"have z's shape {self.z.shape}", self.reason.shape)
        _require_reasons(self.reason)
        require(not self.camera.distortion.any(), "camera", "be free of distortion", self.camera.distortion.tolist())
        require(
            bool(np.array_equal(np.isfinite(self.z), self.reason == 0)),
            "z",
            "be finite exactly where reason is 0",
            "a mismatch",
        )


@dataclass(frozen=True, slots=True)
class Sheet:
    """A surface to be flattened.

    Attributes
    ----------
    vertices : (R, C, 3) grid or (V, 3) array
        Positions in the world [mm]; a grid's rows run along the page's v, its columns along u.
    faces : (F, 3) int array or None
        Triangles; None for a grid.
    stiffness : (R - 1, C - 1) array or None
        Spring constant k_s of each quad of a grid [kg/s^2]; None for the method's own uniform value.
    cut : (R - 1, C - 1) bool array or None
        Quads of a grid across which the surface breaks off: nothing joins their sides. None for a sheet in one piece.
    """

    vertices: Floats
    faces: npt.NDArray[np.integer[Any]] | None = None
    stiffness: Floats | None = None
    cut: npt.NDArray[np.bool_] | None = None

    def __post_init__(self) -> None:
        _require_numbers("vertices", self.vertices, "fiu")
        if self.faces is not None:
            _require_numbers("faces", self.faces, "iu")
        if self.stiffness is not None:
            _require_numbers("stiffness", self.stiffness, "fiu")
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
            inside = self.faces.size > 0 and int(self.faces.min()) >= 0 and int(self.faces.max()) < n
            require(inside, "faces", f"be non-empty with indices in [0, {n - 1}]", f"{len(self.faces)} faces")
        require(
            bool(np.isfinite(vertices).all()),
            "vertices",
            "be finite",
            f"{int((~np.isfinite(vertices)).any(-1).sum())} vertices with NaN or infinity",
        )
        if self.stiffness is not None:
            shape = (vertices.shape[0] - 1, vertices.shape[1] - 1)
            require(
                self.faces is None and self.stiffness.shape == shape,
                "stiffness",
                f"have shape {shape}, one value a quad",
                self.stiffness.shape,
            )
            require(
                bool((self.stiffness > 0).all() and np.isfinite(self.stiffness).all()),
                "stiffness",
                "be positive and finite [kg/s^2]",
                f"a minimum of {np.min(self.stiffness)}",
            )
        if self.cut is not None:
            shape = (vertices.shape[0] - 1, vertices.shape[1] - 1)
            sound = self.faces is None and self.cut.shape == shape and self.cut.dtype == np.bool_
            require(sound, "cut", f"be bool of shape {shape}, one value a quad of a grid", self.cut.shape)
            require(not self.cut.all(), "cut", "leave a quad whole", "every quad cut")


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
    """

    vertices: Floats
    status: Status
    remedy: str = ""
    counters: Mapping[str, float] = field(default_factory=dict)


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
    """

    images: Mapping[str, Array]
    depth: DepthMap
    camera: Pinhole
    sheet: Sheet
    outline: Floats
    projector: ProjectorCheck = ProjectorCheck()
    filled_fraction: float = 0.0


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
        The geometry behind it; None for an image-only method.
    """

    image: Array
    backward_map: npt.NDArray[np.float32]
    camera: Pinhole
    flattened: Flattened | None = None

"""Camera and projector, the board that they are calibrated on, and what calibration found (section 2.2)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from deskew.errors import is_whole, require
from deskew.types.arrays import Floats, Size, require_finite, require_size


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
        require_size("size", self.size)
        for name, shape in (("K", (3, 3)), ("distortion", (5,)), ("R", (3, 3)), ("t", (3,))):
            values = np.asarray(getattr(self, name), dtype=np.float64)
            object.__setattr__(self, name, values)
            require_finite(name, values, shape)
        focal = (float(self.K[0, 0]), float(self.K[1, 1]))
        require(min(focal) > 0, "K", "have positive focal lengths", focal)
        # No entry of a rotation is beyond 1, and the product of larger ones might overflow.
        orthonormal = bool((np.abs(self.R) < 2).all()) and np.allclose(self.R @ self.R.T, np.eye(3), atol=1e-6)
        require(orthonormal, "R", "be a rotation", self.R.tolist())
        require(float(np.linalg.det(self.R)) > 0, "R", "be a rotation, not a reflection", "determinant -1")


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
        `steps` taken until the bundle rested; `condition` number of its scaled Jacobian: by so much the
        worst-determined mixture of parameters is known less well than the best; `rejected_share` of the decoded pixels
        that agree with no solution: a whole board among them stands out here.
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

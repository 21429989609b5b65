"""Bundle adjustment of camera, projector, their relation and all board poses (section 2.2).

Two kinds of residual, each divided by its own noise level: a board corner's reprojection into the camera, and, for
each decoded camera pixel, the projector coordinates of the point where its ray meets the board's plane. The pixels'
positions are exact, so no projector coordinate has to be interpolated to a corner.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from deskew.acquisition.leastsquares import levenberg_marquardt
from deskew.errors import StepError
from deskew.projection import project, undistort
from deskew.types import Floats, Pinhole

Ints = npt.NDArray[np.intp]

INTRINSICS = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2")
_POSE = 6
_CAMERA, _PROJECTOR, _STEREO = slice(0, 8), slice(8, 16), slice(16, 22)
_SHARED = 22  # parameters before the poses
_REJECT_SIGMAS = 4.0
_ROUNDS = 4  # the weights settle within them
_SINGULAR = 1e7  # condition from which a parameter is lost in the rounding of J^T J


@dataclass(frozen=True, slots=True)
class Observations:
    """What the bundle explains.

    Attributes
    ----------
    points : (N, 3) array
        Corners in the board's frame.
    corners : (P, N, 2) array
        The same corners in the camera, for each pose [px].
    pixels, projected : (S, 2) arrays
        Camera pixels on the board and their projector coordinates [px], all poses together.
    pose : (S,) int array
        The pose that each belongs to.
    square : (S,) int array
        The board's square that each lies in, numbered over all poses: pixels of one square share the board's
        unevenness there and the decoder's systematic error.
    """

    points: Floats
    corners: Floats
    pixels: Floats
    projected: Floats
    pose: Ints
    square: Ints


@dataclass(frozen=True, slots=True)
class Bundle:
    """A solution.

    Attributes
    ----------
    camera : Pinhole
        At the origin, looking along +Z.
    projector : Pinhole
        In the camera's frame.
    poses : (P, 6) array
        Rotation vector [rad] and translation of each board in the camera's frame.
    """

    camera: Pinhole
    projector: Pinhole
    poses: Floats

    def packed(self) -> Floats:
        """All parameters in one vector: intrinsics of both, stereo relation, poses."""
        stereo = np.concatenate([Rotation.from_matrix(self.projector.R).as_rotvec(), self.projector.t])
        return np.concatenate([_intrinsics(self.camera), _intrinsics(self.projector), stereo, self.poses.ravel()])

    def unpacked(self, parameters: Floats) -> Bundle:
        """Return the solution that `parameters`, laid out as in :meth:`packed`, stands for."""
        camera = _with_intrinsics(self.camera, parameters[_CAMERA])
        projector = _with_intrinsics(self.projector, parameters[_PROJECTOR])
        stereo = parameters[_STEREO]
        projector = replace(projector, R=Rotation.from_rotvec(stereo[:3]).as_matrix(), t=stereo[3:])
        return Bundle(camera, projector, parameters[_SHARED:].reshape(-1, _POSE))


@dataclass(frozen=True, slots=True)
class Refined:
    """A converged bundle.

    Attributes
    ----------
    bundle : Bundle
        The solution.
    corner_residuals : (P, N, 2) array
        Reprojection minus observation [camera px].
    pixel_residuals : (S, 2) array
        Likewise [projector px].
    kept : (S,) bool array
        Pixels that are not outliers.
    jacobian : (2 P N + 2 K, 22 + 6 P) array
        Derivatives of all residuals in units of their noise: corners, then kept pixels, as they are raveled.
    sigmas : (2,) tuple
        Those units: of a corner [camera px] and of a pixel [projector px].
    steps : int
        Of the least squares, until they rested.
    """

    bundle: Bundle
    corner_residuals: Floats
    pixel_residuals: Floats
    kept: npt.NDArray[np.bool_]
    jacobian: Floats
    sigmas: tuple[float, float]
    steps: int

    @property
    def condition(self) -> float:
        """Condition number of the Jacobian with its columns brought to unit length; infinite if it is singular."""
        scale = np.linalg.norm(self.jacobian, axis=0)
        return float(np.linalg.cond(self.jacobian / scale)) if scale.all() else float("inf")

    def deviations(self) -> Floats:
        """One standard deviation of each parameter, (22 + 6 P,).

        Raises
        ------
        StepError
            If the poses leave a parameter undetermined.
        """
        if not self.condition < _SINGULAR:
            raise StepError(
                "calibration: the poses leave a parameter undetermined; add poses tilted by 15 to 30 degrees about "
                "different axes and at different heights."
            )
        scale = np.linalg.norm(self.jacobian, axis=0)
        scaled = self.jacobian / scale
        return np.asarray(np.sqrt(np.diag(np.linalg.inv(scaled.T @ scaled))) / scale)


def _intrinsics(device: Pinhole) -> Floats:
    K = device.K
    return np.concatenate([[K[0, 0], K[1, 1], K[0, 2], K[1, 2]], device.distortion[:4]])


def _with_intrinsics(device: Pinhole, values: Floats) -> Pinhole:
    fx, fy, cx, cy = values[:4]
    K = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    return replace(device, K=K, distortion=np.append(values[4:], 0.0))


def corner_residuals(bundle: Bundle, seen: Observations) -> Floats:
    """Reprojection minus observation of every corner, (P, N, 2) [camera px]."""
    rotations = Rotation.from_rotvec(bundle.poses[:, :3]).as_matrix()
    placed = np.einsum("pij,nj->pni", rotations, seen.points) + bundle.poses[:, None, 3:]
    return project(bundle.camera, placed) - seen.corners


def on_board(bundle: Bundle, pixels: Floats, pose: Ints) -> Floats:
    """Points where the rays of camera pixels meet their board's plane, (S, 3) in the camera's frame."""
    normals = Rotation.from_rotvec(bundle.poses[:, :3]).as_matrix()[:, :, 2]
    offsets = np.einsum("pi,pi->p", normals, bundle.poses[:, 3:])
    rays = np.concatenate([undistort(bundle.camera, pixels), np.ones((len(pixels), 1))], axis=-1)
    return np.asarray(rays * (offsets[pose] / np.einsum("si,si->s", normals[pose], rays))[:, None])


def pixel_residuals(bundle: Bundle, seen: Observations) -> Floats:
    """Projector coordinates predicted minus decoded, (S, 2) [projector px]."""
    return project(bundle.projector, on_board(bundle, seen.pixels, seen.pose)) - seen.projected


def refine(start: Bundle, seen: Observations) -> Refined:
    """Refine to convergence, each kind of residual with the noise that it shows, without outliers.

    Raises
    ------
    StepError
        If the bundle does not converge, or the poses leave a parameter undetermined.
    """
    bundle, steps = start, 0
    for _ in range(_ROUNDS):
        kept, sigmas = _weights(bundle, seen)
        bundle, jacobian, taken = _solve(bundle, _subset(seen, kept), sigmas)
        steps += taken
    corner, pixel = corner_residuals(bundle, seen), pixel_residuals(bundle, seen)
    return Refined(bundle, corner, pixel, kept, jacobian, sigmas, steps)


def _weights(bundle: Bundle, seen: Observations) -> tuple[npt.NDArray[np.bool_], tuple[float, float]]:
    """Return the pixels that are no outliers and the noise of a corner and of a pixel, as a solution shows them."""
    corner, pixel = corner_residuals(bundle, seen), pixel_residuals(bundle, seen)
    spread = _floor(1.4826 * float(np.median(np.abs(pixel))))
    kept = np.abs(pixel).max(axis=-1) < _REJECT_SIGMAS * spread
    noise = shared_noise(pixel[kept], seen.square[kept])
    return kept, (_floor(float(np.sqrt(np.mean(corner**2)))), _floor(noise))


def shared_noise(residuals: Floats, square: Ints) -> float:
    """Noise level that makes pixels count for what they know together, from a one-way analysis of variance.

    The mean of m pixels of a square has the variance ``between + within / m``: weighting each pixel by the mean square
    BETWEEN squares, ``m between + within``, gives the mean just that. Where a square's pixels err independently
    (`between` is 0) this is the plain noise, and where they all err alike they count as one.

    Parameters
    ----------
    residuals : (S, 2) array
        Of the pixels [px].
    square : (S,) int array
        The square of each.

    Returns
    -------
    float
        One standard deviation [px].
    """
    _, member, counts = np.unique(square, return_inverse=True, return_counts=True)
    sums = np.stack([np.bincount(member, residuals[:, axis]) for axis in (0, 1)], axis=-1)
    explained = float((sums**2 / counts[:, None]).sum())
    total = float((residuals**2).sum())
    within = (total - explained) / max(2 * (len(residuals) - len(counts)), 1)
    return float(np.sqrt(max(explained / (2 * len(counts)), within)))


def _floor(sigma_px: float) -> float:
    return max(sigma_px, 1e-3)  # noise-free data must not divide by zero


def _subset(seen: Observations, kept: npt.NDArray[np.bool_]) -> Observations:
    return replace(
        seen,
        pixels=seen.pixels[kept],
        projected=seen.projected[kept],
        pose=seen.pose[kept],
        square=seen.square[kept],
    )


def _solve(start: Bundle, seen: Observations, sigmas: tuple[float, float]) -> tuple[Bundle, Floats, int]:
    """Solve one weighted least-squares problem; returns the solution, its Jacobian and the steps it took."""

    def residuals(parameters: Floats) -> Floats:
        bundle = start.unpacked(parameters)
        corner, pixel = corner_residuals(bundle, seen), pixel_residuals(bundle, seen)
        return np.concatenate([corner.ravel() / sigmas[0], pixel.ravel() / sigmas[1]])

    n_poses, n_points = seen.corners.shape[:2]
    rows = np.concatenate([np.repeat(np.arange(n_poses), 2 * n_points), np.repeat(seen.pose, 2)])

    def jacobian(parameters: Floats) -> Floats:
        return _grouped_jacobian(residuals, parameters, rows, n_poses)

    solution, steps = levenberg_marquardt(residuals, jacobian, start.packed())
    return start.unpacked(solution), jacobian(solution), steps


def _grouped_jacobian(residuals: Callable[[Floats], Floats], parameters: Floats, rows: Ints, n_poses: int) -> Floats:
    """Central differences; one pair of evaluations serves the same parameter of all poses, which share no residual."""
    jacobian = np.zeros((len(rows), len(parameters)))
    step = 1e-6 * np.maximum(np.abs(parameters), 1e-2)
    for column in range(_SHARED + _POSE):
        columns = np.array([column]) if column < _SHARED else column + _POSE * np.arange(n_poses)
        shift = np.zeros_like(parameters)
        shift[columns] = step[columns]
        difference = residuals(parameters + shift) - residuals(parameters - shift)
        if column < _SHARED:
            jacobian[:, column] = difference / (2 * step[column])
        else:
            own = columns[rows]
            jacobian[np.arange(len(rows)), own] = difference / (2 * step[own])
    return jacobian

"""Calibration of camera and projector on a printed board, refined jointly (section 2.2).

The camera sees the board's corners; the projector is calibrated "indirectly via the camera": each decoded camera pixel
inside a white square is a ray that meets the board's plane in a point whose projector coordinates are known. One bundle
adjustment over all boards fits both devices, their relation and the poses, until it rests.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import cv2
import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from deskew.acquisition.bundle import INTRINSICS, Bundle, Observations, Refined, on_board, refine
from deskew.acquisition.corners import find_board
from deskew.acquisition.grey import grey_levels
from deskew.acquisition.holdout import held_out
from deskew.acquisition.psf import camera_psf, edge_blurs
from deskew.errors import StepError, require, require_whole
from deskew.threads import one_thread
from deskew.types import Board, Calibration, Capture, Correspondence, Floats, Pinhole, Size

MIN_POSES = 3
MIN_TILT_DEG = 8.0
_TIGHT = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 500, 1e-12)
# Starts of the projector's principal point, in frame heights: a table projector's lens shift puts it off its frame.
_SHIFTS = (0.5, 1.1, -0.1)
_FEWEST_PIXELS = 100  # that show a pose to the projector
_MARGIN_SQUARES = 0.2  # kept from a square's edge, where ink bends the stripe's peak


@dataclass(frozen=True, slots=True)
class BoardView:
    """One pose of the board as both devices see it.

    Attributes
    ----------
    corners : (ny * nx, 2) array
        Inner corners in the camera [raw px], row by row.
    pixels : (M, 2) array
        Camera pixels inside white squares.
    projected : (M, 2) array
        Their projector coordinates [px].
    camera_size, projector_size : (width, height)
        Of the devices [px].
    edge_blurs : (E,) array
        Blur of the board's edges in the camera [px]; empty if none could be measured.
    """

    corners: Floats
    pixels: Floats
    projected: Floats
    camera_size: Size
    projector_size: Size
    edge_blurs: Floats = field(default_factory=lambda: np.empty(0))


def board_points(board: Board) -> Floats:
    """Inner corners in the board's frame, (ny * nx, 3): origin in their middle, X right, Y up, Z towards the viewer."""
    nx, ny = board.shape
    x, y = np.meshgrid(np.arange(nx) - (nx - 1) / 2, (ny - 1) / 2 - np.arange(ny))
    return np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3) * board.square


def view_board(board: Board, capture: Capture, correspondence: Correspondence, n_pixels_max: int = 600) -> BoardView:
    """Find the board in a capture and pick decoded pixels inside its white squares.

    Parameters
    ----------
    board : Board
        Its shape and squares.
    capture : Capture
        White and black frames are used.
    correspondence : Correspondence
        The same capture, decoded.
    n_pixels_max : int
        Pixels kept, spread evenly over those that qualify; at least 100.

    Raises
    ------
    InputError
        If the correspondence is of another size than the capture.
    StepError
        If the board is not found or hardly any pixel inside it is decoded.
    """
    require_whole("n_pixels_max", n_pixels_max, _FEWEST_PIXELS, 1_000_000_000)
    white = grey_levels(capture.white, "white")
    lit = white.astype(np.float64) - grey_levels(capture.black, "black")
    got = correspondence.column.shape
    require(got == lit.shape, "correspondence", f"have the capture's shape {lit.shape}", got)
    corners = find_board(lit, board.shape)
    chosen = np.isfinite(correspondence.column) & np.isfinite(correspondence.row) & _inside_white(board, corners, lit)
    y, x = np.nonzero(chosen)
    if len(x) < _FEWEST_PIXELS:
        raise StepError(
            f"board observation: only {len(x)} decoded pixels inside the board's white squares, at least "
            f"{_FEWEST_PIXELS} are needed; check that the projector covers the board and is not saturated."
        )
    kept = np.unique(np.linspace(0, len(x) - 1, min(n_pixels_max, len(x))).astype(int))
    x, y = x[kept], y[kept]
    projected = np.stack([correspondence.column[y, x], correspondence.row[y, x]], axis=-1).astype(np.float64)
    pixels = np.stack([x, y], axis=-1).astype(np.float64)
    clipped = white >= np.iinfo(white.dtype).max if white.dtype.kind == "u" else np.zeros(white.shape, dtype=bool)
    blurs = edge_blurs(lit, corners, ~clipped)
    return BoardView(corners.reshape(-1, 2), pixels, projected, capture.camera_size, capture.projector_size, blurs)


def _in_squares(board: Board, corners: Floats, pixels: Floats) -> Floats:
    """Places of camera pixels (..., 2) on the board, counted in squares from its first inner corner, (..., 2)."""
    nx, ny = board.shape
    indices = np.stack(np.meshgrid(np.arange(nx), np.arange(ny)), axis=-1).reshape(-1, 2).astype(np.float64)
    homography, _ = cv2.findHomography(corners.reshape(-1, 2), indices)
    return np.asarray(cv2.perspectiveTransform(pixels.reshape(-1, 1, 2), homography)).reshape(pixels.shape)


def _squares(board: Board, views: Sequence[BoardView]) -> npt.NDArray[np.intp]:
    """Count the squares over all views, and return the one that each pixel lies in, (S,)."""
    nx, ny = board.shape
    numbers = []
    for i, view in enumerate(views):
        place = np.floor(_in_squares(board, view.corners, view.pixels)).astype(np.intp)
        numbers.append((i * ny + place[:, 1]) * nx + place[:, 0])
    return np.concatenate(numbers)


def _inside_white(board: Board, corners: Floats, lit: Floats) -> npt.NDArray[np.bool_]:
    """Mask of the camera pixels well inside the white squares between the inner corners, (height, width)."""
    nx, ny = board.shape
    height, width = lit.shape
    pixels = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).astype(np.float64)
    place = _in_squares(board, corners, pixels)
    square = np.floor(place)
    inner = np.abs(place - square - 0.5).max(axis=-1) < 0.5 - _MARGIN_SQUARES
    inner &= (place > 0).all(axis=-1) & (place[..., 0] < nx - 1) & (place[..., 1] < ny - 1)
    odd = square.sum(axis=-1) % 2 == 1
    if not ((inner & odd).any() and (inner & ~odd).any()):
        return np.zeros(lit.shape, dtype=bool)  # squares too small to hold a pixel
    white_is_odd = lit[inner & odd].mean() > lit[inner & ~odd].mean()
    return np.asarray(inner & (odd == white_is_odd))


@one_thread()  # OpenCV adds its boards up as its threads end, and where a fit rests follows
def calibrate(board: Board, views: Sequence[BoardView]) -> Calibration:
    """Calibrate both devices from at least three poses; the first one defines the world, its Z = 0 being the bed.

    Parameters
    ----------
    board : Board
        The printed board.
    views : sequence of BoardView
        One a pose.

    Returns
    -------
    Calibration
        Devices and one standard deviation of each parameter. The residuals are radial: `camera_rms_px` of the camera
        calibrated alone on its corners, `projector_rms_px` of the projector alone on decoded pixels (each board's pose
        free), `stereo_rms_px` of the joint solution, pooled over both devices; from four poses on the figures of
        :func:`deskew.acquisition.holdout.held_out`, on boards left out.

    Raises
    ------
    InputError
        If the views are not all of the same devices, or one does not hold the board's corners.
    StepError
        If there are too few poses, or the poses do not determine the devices.
    """
    if len(views) < MIN_POSES:
        raise StepError(
            f"calibration: {len(views)} poses are too few, at least {MIN_POSES} with different tilts are needed; "
            "8 are better."
        )
    sizes = {(view.camera_size, view.projector_size) for view in views}
    require(len(sizes) == 1, "views", "be of one camera and one projector size", sorted(sizes))
    ((camera_size, projector_size),) = sizes
    points = board_points(board)
    for i, view in enumerate(views):
        shape, wanted = np.shape(view.corners), (len(points), 2)
        require(shape == wanted, f"views[{i}].corners", f"have shape {wanted}, one row a corner", shape)
    seen = Observations(
        points=points,
        corners=np.stack([view.corners for view in views]),
        pixels=np.concatenate([view.pixels for view in views]),
        projected=np.concatenate([view.projected for view in views]),
        pose=np.repeat(np.arange(len(views)), [len(view.pixels) for view in views]),
        square=_squares(board, views),
    )
    camera_rms, camera, poses = _camera_alone(seen, camera_size)
    _require_different_tilts(poses)
    projector_rms, projector = _projector_alone(seen, camera, poses, projector_size)
    solved = refine(Bundle(camera, projector, poses), seen)
    residuals = {"camera_rms_px": camera_rms, "projector_rms_px": projector_rms}
    # Both devices count alike, however many pixels were decoded.
    both = (_radial_rms(solved.corner_residuals), _radial_rms(solved.pixel_residuals[solved.kept]))
    residuals |= {"stereo_rms_px": float(np.sqrt(np.mean(np.square(both)))), **held_out(solved, seen)}
    psf = camera_psf(np.concatenate([view.edge_blurs for view in views]))
    return replace(_calibration(solved, board, residuals), camera_psf_px=psf)


def _camera_alone(seen: Observations, size: Size) -> tuple[float, Pinhole, Floats]:
    """Return the RMS, the camera at the origin and the (P, 6) board poses: OpenCV's calibration run to convergence."""
    n_poses = len(seen.corners)
    objects = [seen.points.astype(np.float32)] * n_poses
    fitted = _fit(objects, [corners.astype(np.float32) for corners in seen.corners], size, None)
    if fitted is None:
        raise StepError("calibration: the camera could not be fitted; add poses with different tilts.")
    rms, K, distortion, rvecs, tvecs = fitted
    camera = Pinhole(size, K, _brown(distortion), np.eye(3), np.zeros(3))
    poses = np.concatenate([np.reshape(rvecs, (n_poses, 3)), np.reshape(tvecs, (n_poses, 3))], axis=1)
    return rms, camera, poses


def _fit(
    objects: list[Floats], images: list[Floats], size: Size, guess: Floats | None
) -> tuple[float, Floats, Floats, Floats, Floats] | None:
    """Run OpenCV's calibration to convergence: RMS, K, distortion, poses; None where it finds no camera at all."""
    flags = cv2.CALIB_FIX_K3 | (0 if guess is None else cv2.CALIB_USE_INTRINSIC_GUESS)
    start = None if guess is None else np.zeros(5)
    try:
        rms, K, *rest = cv2.calibrateCamera(objects, images, size, guess, start, flags=flags, criteria=_TIGHT)
    except cv2.error:
        return None
    found = np.isfinite(rms) and bool(np.isfinite(K).all()) and min(K[0, 0], K[1, 1]) > 0
    distortion, rvecs, tvecs = (np.asarray(values, dtype=np.float64) for values in rest)
    return (float(rms), K, distortion, rvecs, tvecs) if found else None


def _require_different_tilts(poses: Floats) -> None:
    """Parallel boards leave the focal length undetermined, however many they are."""
    normals = Rotation.from_rotvec(poses[:, :3]).as_matrix()[:, :, 2]
    widest = float(np.degrees(np.arccos(np.clip((normals @ normals.T).min(), -1.0, 1.0))))
    if widest < MIN_TILT_DEG:
        raise StepError(
            f"calibration: the boards' tilts differ by {widest:.1f} degrees at most, at least {MIN_TILT_DEG:.0f} are "
            "needed; add poses tilted by 15 to 30 degrees about different axes and at different heights."
        )


def _projector_alone(seen: Observations, camera: Pinhole, poses: Floats, size: Size) -> tuple[float, Pinhole]:
    """Return the RMS and the projector in the camera's frame, the best of several principal points to start from."""
    n_poses = len(poses)
    rotations = Rotation.from_rotvec(poses[:, :3])
    in_camera = on_board(Bundle(camera, camera, poses), seen.pixels, seen.pose)
    in_board = rotations[seen.pose].apply(in_camera - poses[seen.pose, 3:], inverse=True)
    in_board[:, 2] = 0.0
    members = [seen.pose == pose for pose in range(n_poses)]
    objects = [in_board[m].astype(np.float32) for m in members]
    width, height = size
    # OpenCV wants the principal point inside the frame: give it a frame of three heights, with ours in the middle.
    images = [(seen.projected[m] + (0, height)).astype(np.float32) for m in members]
    best: tuple[float, Pinhole] | None = None
    for shift in _SHIFTS:
        guess = np.array([[2.0 * width, 0, width / 2], [0, 2.0 * width, (1 + shift) * height], [0, 0, 1]])
        fitted = _fit(objects, images, (width, 3 * height), guess)
        if fitted is None:
            continue
        rms, K, distortion, rvecs, tvecs = fitted
        K[1, 2] -= height
        # The board's pose in the projector after its pose in the camera, averaged over the boards.
        relative = Rotation.from_rotvec(np.reshape(rvecs, (n_poses, 3))) * rotations.inv()
        rotation = relative.mean()
        translation = np.mean(np.reshape(tvecs, (n_poses, 3)) - rotation.apply(poses[:, 3:]), axis=0)
        if best is None or rms < best[0]:
            best = rms, Pinhole(size, K, _brown(distortion), rotation.as_matrix(), translation)
    if best is None:
        raise StepError(
            "calibration: the projector could not be fitted from any start; add poses with different tilts."
        )
    return best


def _brown(distortion: Floats) -> Floats:
    return np.asarray(distortion, dtype=np.float64).ravel()[:5]


def _calibration(solved: Refined, board: Board, residuals: dict[str, float]) -> Calibration:
    """Move the world to board pose 00 and state residuals, uncertainties and how the bundle came to rest."""
    bundle = solved.bundle
    R = Rotation.from_rotvec(bundle.poses[0, :3]).as_matrix()
    t = bundle.poses[0, 3:]
    camera = replace(bundle.camera, R=R, t=t)
    projector = replace(bundle.projector, R=bundle.projector.R @ R, t=bundle.projector.R @ t + bundle.projector.t)
    names = [f"{device}_{name}" for device in ("camera", "projector") for name in INTRINSICS]
    names += [f"stereo_{name}" for name in ("rx", "ry", "rz", "tx", "ty", "tz")]
    uncertainty = dict(zip(names, map(float, solved.deviations()), strict=False))
    rejected = 1.0 - float(solved.kept.mean())
    convergence = {"steps": float(solved.steps), "condition": solved.condition, "rejected_share": rejected}
    return Calibration(
        camera, projector, residuals, uncertainty, len(bundle.poses), board.unit, convergence=convergence
    )


def _radial_rms(residuals: Floats) -> float:
    return float(np.sqrt(np.mean((residuals**2).sum(axis=-1))))

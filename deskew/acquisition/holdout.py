"""Figures on a board that the calibration has not seen: leave one out, for every board in turn (section 2.2).

The residuals of a fit flatter it. Here each board is taken out, what it taught is taken back by one Gauss-Newton step
(exact to first order, and the boards' influence is small), and the board is then judged as any page would be: its pose
from its corners, its shape from decoded pixels.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from deskew.acquisition.bundle import Bundle, Observations, Refined, corner_residuals, on_board, pixel_residuals
from deskew.acquisition.matches import Matches
from deskew.acquisition.triangulation import solve_depth
from deskew.projection import undistort
from deskew.types import Floats

FEWEST_POSES = 4  # one to leave out, and three that determine the devices
_FEWEST_PIXELS = 20  # of a board, from which its size is triangulated


def held_out(solved: Refined, seen: Observations) -> dict[str, float]:
    """Judge every board by the devices that the others determine.

    Parameters
    ----------
    solved : Refined
        The bundle over all boards, at rest.
    seen : Observations
        What it explains.

    Returns
    -------
    dict
        `held_out_camera_rms_px`: radial residual of the left-out board's corners, its six pose parameters fitted to
        them. `held_out_projector_rms_px`: of its decoded pixels, with that pose. `held_out_length_rms`: error of the
        board's diagonal as triangulated, in the board's unit. Each over all boards, the last two without those whose
        pixels are nearly all outliers; empty with fewer than four.
    """
    n_poses = len(seen.corners)
    if n_poses < FEWEST_POSES:
        return {}
    squares: dict[str, list[Floats]] = {"camera_rms_px": [], "projector_rms_px": [], "length_rms": []}
    diagonal = float(np.linalg.norm(seen.points[-1] - seen.points[0]))
    for pose in range(n_poses):
        board = _only(seen, pose, solved.kept)
        bundle = _posed(_without(solved, seen, pose), board)
        squares["camera_rms_px"].append((corner_residuals(bundle, board) ** 2).sum(axis=-1).ravel())
        if len(board.pixels) < _FEWEST_PIXELS:
            continue
        squares["projector_rms_px"].append((pixel_residuals(bundle, board) ** 2).sum(axis=-1))
        squares["length_rms"].append(np.array([(diagonal * (_scale(bundle, board) - 1.0)) ** 2]))
    pooled = {name: np.concatenate(values) for name, values in squares.items() if values}
    return {f"held_out_{name}": float(np.sqrt(values.mean())) for name, values in pooled.items()}


def _without(solved: Refined, seen: Observations, pose: int) -> Bundle:
    """Take back what one board taught: a Gauss-Newton step of the problem that lacks its residuals."""
    n_poses, n_points = seen.corners.shape[:2]
    kept = solved.kept
    of = np.concatenate([np.repeat(np.arange(n_poses), 2 * n_points), np.repeat(seen.pose[kept], 2)])
    corner, pixel = solved.corner_residuals / solved.sigmas[0], solved.pixel_residuals[kept] / solved.sigmas[1]
    residual = np.concatenate([corner.ravel(), pixel.ravel()])[of != pose]
    jacobian = solved.jacobian[of != pose]
    scale = np.linalg.norm(jacobian, axis=0)
    scale[scale == 0] = 1.0  # the left-out pose's own parameters stay where they are
    jacobian = jacobian / scale
    step = np.linalg.lstsq(jacobian.T @ jacobian, jacobian.T @ residual, rcond=None)[0]
    return solved.bundle.unpacked(solved.bundle.packed() - step / scale)


def _only(seen: Observations, pose: int, kept: np.ndarray) -> Observations:
    """Return one board's observations, without outliers."""
    own = (seen.pose == pose) & kept
    return replace(
        seen,
        corners=seen.corners[pose : pose + 1],
        pixels=seen.pixels[own],
        projected=seen.projected[own],
        pose=np.zeros(int(own.sum()), dtype=np.intp),
        square=seen.square[own],
    )


def _posed(bundle: Bundle, board: Observations) -> Bundle:
    """Fit the pose of a single board to its corners alone."""
    camera = bundle.camera
    corners = board.corners[0].reshape(-1, 1, 2)
    _, rotation, translation = cv2.solvePnP(board.points, corners, camera.K, camera.distortion)
    rotation, translation = cv2.solvePnPRefineLM(
        board.points, corners, camera.K, camera.distortion, rotation, translation
    )
    return replace(bundle, poses=np.concatenate([rotation.ravel(), translation.ravel()])[None])


def _scale(bundle: Bundle, board: Observations) -> float:
    """Size of a board as triangulated, over its size as printed: the factor of a similarity between the two."""
    printed = on_board(bundle, board.pixels, board.pose)
    projector = bundle.projector
    directions = undistort(bundle.camera, board.pixels)
    focal = np.array([projector.K[0, 0], projector.K[1, 1]])
    everywhere = np.ones(len(directions), dtype=bool)
    matches = Matches(everywhere, directions, undistort(projector, board.projected), projector.R, projector.t, focal)
    z = solve_depth(matches)
    triangulated = z[:, None] * np.concatenate([directions, np.ones((len(z), 1))], axis=-1)
    printed, triangulated = printed - printed.mean(axis=0), triangulated - triangulated.mean(axis=0)
    # Umeyama's scale, the two being turned against each other hardly at all.
    stretch = np.linalg.svd(triangulated.T @ printed, compute_uv=False)
    return float(stretch.sum() / (printed**2).sum())

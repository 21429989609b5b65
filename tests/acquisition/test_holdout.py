"""Figures on a left-out board: one Gauss-Newton step does what a calibration without the board does."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from deskew.acquisition.bundle import Bundle, Observations, on_board, refine
from deskew.acquisition.calibration import board_points
from deskew.acquisition.holdout import _without, held_out
from deskew.projection import project
from deskew.types import Board, Pinhole

BOARD = Board((9, 6), 20.0)
CAMERA = Pinhole(
    (640, 480), np.array([[1700.0, 0, 322], [0, 1705, 236], [0, 0, 1]]), np.array([-0.12, 0.1, 1e-3, -5e-4, 0]),
    np.eye(3), np.zeros(3),
)  # fmt: skip
PROJECTOR = Pinhole(
    (1024, 768), np.array([[2600.0, 0, 520], [0, 2610, 840], [0, 0, 1]]), np.array([-0.05, 0.02, -5e-4, 1e-3, 0]),
    Rotation.from_euler("yx", [-23, 6], degrees=True).as_matrix(), np.array([320.0, 60.0, 30.0]),
)  # fmt: skip
TILTS = [(0, 0), (25, 0), (-25, 5), (0, 28), (5, -28), (20, 20), (-20, 20)]


def observed(corner_noise_px, pixel_noise_px, n_pixels=150):
    """Boards seen with noise: the true bundle and its observations."""
    rng = np.random.default_rng(1)
    face_up = Rotation.from_euler("x", 180, degrees=True)
    poses = np.array([
        [*(Rotation.from_euler("xy", tilt, degrees=True) * face_up).as_rotvec(), 8 * i - 30, 20 - 4 * i, 790 - 5 * i]
        for i, tilt in enumerate(TILTS)
    ])  # fmt: skip
    truth, points = Bundle(CAMERA, PROJECTOR, poses), board_points(BOARD)
    corners = np.stack([project(CAMERA, Rotation.from_rotvec(p[:3]).apply(points) + p[3:]) for p in poses])
    pixels = np.concatenate([rng.uniform(c.min(0), c.max(0), (n_pixels, 2)) for c in corners])
    pose = np.repeat(np.arange(len(poses)), n_pixels)
    projected = project(PROJECTOR, on_board(truth, pixels, pose))
    corners += corner_noise_px * rng.standard_normal(corners.shape)
    projected += pixel_noise_px * rng.standard_normal(projected.shape)
    return truth, Observations(points, corners, pixels, projected, pose, square=np.arange(len(pixels)))


def without(seen, pose):
    own = seen.pose == pose
    others = np.delete(np.arange(len(seen.corners)), pose)
    renumbered = np.searchsorted(others, seen.pose[~own])
    return others, Observations(
        seen.points, seen.corners[others], seen.pixels[~own], seen.projected[~own], renumbered, seen.square[~own]
    )


def test_a_step_without_a_board_is_the_bundle_of_the_others():
    truth, seen = observed(0.03, 0.05)
    solved = refine(truth, seen)
    for pose in (0, 4):
        others, rest = without(seen, pose)
        again = refine(Bundle(truth.camera, truth.projector, truth.poses[others]), rest)
        step, full, all_ = (b.packed()[:22] for b in (_without(solved, seen, pose), again.bundle, solved.bundle))
        deviation = solved.deviations()[:22]
        assert np.abs((full - all_) / deviation).max() > 0.3  # the board did teach something
        assert np.abs((full - step) / deviation).max() < 0.12


def test_exact_boards_have_no_error_and_noisy_ones_a_little_more_than_their_noise():
    truth, seen = observed(0.0, 0.0)
    assert max(held_out(refine(truth, seen), seen).values()) < 1e-3
    truth, seen = observed(0.03, 0.05)
    figures = held_out(refine(truth, seen), seen)
    assert 0.92 < figures["held_out_camera_rms_px"] / (0.03 * np.sqrt(2)) < 1.12  # a pose of its own takes 3 %
    # The pose that the corners give it has an error of its own.
    assert 1.0 < figures["held_out_projector_rms_px"] / (0.05 * np.sqrt(2)) < 1.3
    assert 0.001 < figures["held_out_length_rms"] < 0.1


def test_a_board_of_another_size_is_seen_by_its_length_alone():
    """One board printed 1 % large: its own fit hides that, the left-out length does not."""
    truth, seen = observed(0.01, 0.01)
    seen.corners[3] = project(
        CAMERA, Rotation.from_rotvec(truth.poses[3, :3]).apply(1.01 * seen.points) + truth.poses[3, 3:]
    )
    diagonal = np.linalg.norm(seen.points[-1] - seen.points[0])
    alone = held_out(refine(truth, seen), seen)["held_out_length_rms"]
    assert 0.7 < alone / (0.01 * diagonal / np.sqrt(len(TILTS))) < 1.5


def test_three_boards_leave_none_out():
    truth, seen = observed(0.03, 0.05)
    first = seen.pose < 3
    few = Observations(
        seen.points, seen.corners[:3], seen.pixels[first], seen.projected[first], seen.pose[first], seen.square[first]
    )
    assert held_out(refine(Bundle(truth.camera, truth.projector, truth.poses[:3]), few), few) == {}


def test_less_tilted_boards_leave_a_worse_condition_and_a_less_certain_focal_length():
    truth, seen = observed(0.03, 0.05)
    flat = [0, 1, 2]  # tilted about one axis only
    members = np.isin(seen.pose, flat)
    few = Observations(
        seen.points, seen.corners[flat], seen.pixels[members], seen.projected[members], seen.pose[members],
        seen.square[members],
    )  # fmt: skip
    all_, some = refine(truth, seen), refine(replace(truth, poses=truth.poses[flat]), few)
    assert 1.2 < some.condition / all_.condition < 100
    assert 1.5 < some.deviations()[0] / all_.deviations()[0] < 20
    assert 0.2 < all_.deviations()[0] < 2.0

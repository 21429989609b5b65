from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from deskew.acquisition.bundle import Bundle, on_board, shared_noise
from deskew.acquisition.calibration import BoardView, _in_squares, board_points, calibrate, view_board
from deskew.errors import InputError, StepError
from deskew.projection import centre, project
from deskew.types import Board, Capture, Correspondence, PatternKind, Pinhole

BOARD = Board((9, 6), 20.0)
CAMERA = Pinhole(
    (640, 480), np.array([[1700.0, 0, 322], [0, 1705, 236], [0, 0, 1]]), np.array([-0.12, 0.1, 1e-3, -5e-4, 0]),
    np.eye(3), np.zeros(3),
)  # fmt: skip
# A table projector: its principal point lies below its frame.
PROJECTOR = Pinhole(
    (1024, 768), np.array([[2600.0, 0, 520], [0, 2610, 840], [0, 0, 1]]), np.array([-0.05, 0.02, -5e-4, 1e-3, 0]),
    Rotation.from_euler("yx", [-23, 6], degrees=True).as_matrix(), np.array([320.0, 60.0, 30.0]),
)  # fmt: skip


def _poses():
    face_up = Rotation.from_euler("x", 180, degrees=True)
    tilts = [(0, 0), (20, 0), (-20, 5), (0, 22), (5, -22), (15, 15), (-15, 15), (15, -18), (-10, -12)]
    heights = [0, 40, 10, 30, 20, 50, 60, 25, 35]
    rotations = [Rotation.from_euler("xy", tilt, degrees=True) * face_up for tilt in tilts]
    return np.array(
        [
            [*r.as_rotvec(), 8 * i - 30, 20 - 4 * i, 800 - h]
            for i, (r, h) in enumerate(zip(rotations, heights, strict=True))
        ]
    )


def _views(camera_noise=0.0, projector_noise=0.0, n_pixels=300, n_poses=9, seed=0):
    rng = np.random.default_rng(seed)
    poses = _poses()[:n_poses]
    truth = Bundle(CAMERA, PROJECTOR, poses)
    points = board_points(BOARD)
    views = []
    for i, pose in enumerate(poses):
        placed = Rotation.from_rotvec(pose[:3]).apply(points) + pose[3:]
        corners = project(CAMERA, placed)
        low, high = corners.min(0), corners.max(0)
        pixels = np.rint(rng.uniform(low, high, (n_pixels, 2)))
        projected = project(PROJECTOR, on_board(truth, pixels, np.full(n_pixels, i)))
        views.append(BoardView(
            corners + camera_noise * rng.standard_normal(corners.shape), pixels,
            projected + projector_noise * rng.standard_normal(pixels.shape), CAMERA.size, PROJECTOR.size,
        ))  # fmt: skip
    return views


def _parameters(device):
    return np.array([device.K[0, 0], device.K[1, 1], device.K[0, 2], device.K[1, 2], *device.distortion[:4]])


def test_exact_observations_give_the_exact_devices():
    calibration = calibrate(BOARD, _views())
    for got, true in ((calibration.camera, CAMERA), (calibration.projector, PROJECTOR)):
        assert np.allclose(_parameters(got), _parameters(true), atol=2e-3)
    baseline = np.linalg.norm(centre(calibration.projector) - centre(calibration.camera))
    assert baseline == pytest.approx(np.linalg.norm(PROJECTOR.t), abs=1e-3)
    assert all(0 <= value < 1e-3 for value in calibration.residuals.values())


def test_world_is_the_first_board():
    calibration = calibrate(BOARD, _views())
    pixels = project(calibration.camera, board_points(BOARD))
    assert np.allclose(pixels, _views()[0].corners, atol=1e-3)
    assert centre(calibration.camera)[2] > 700  # Z points up, towards the camera


def test_errors_agree_with_the_stated_uncertainty():
    """Over both devices' parameters the error in units of its stated deviation is about 1."""
    scores = []
    for seed in range(4):
        calibration = calibrate(BOARD, _views(0.03, 0.05, seed=seed))
        names = [*calibration.uncertainty][:16]
        error = np.concatenate([_parameters(calibration.camera) - _parameters(CAMERA),
                                _parameters(calibration.projector) - _parameters(PROJECTOR)])  # fmt: skip
        scores.append(error / [calibration.uncertainty[name] for name in names])
    assert 0.75 < np.sqrt(np.mean(np.square(scores))) < 1.3


def test_errors_that_squares_share_count_as_one_each():
    """Where every square is 0.2 px off by itself, four times the pixels tell nothing more, and are not trusted to."""
    stated = {}
    for n_pixels in (300, 1200):
        rng = np.random.default_rng(3)
        views = _views(0.03, 0.02, n_pixels=n_pixels)
        for i, view in enumerate(views):
            place = np.floor(_in_squares(BOARD, view.corners, view.pixels)).astype(int)
            own = 0.2 * rng.standard_normal((BOARD.shape[1] + 1, BOARD.shape[0] + 1, 2))
            views[i] = replace(view, projected=view.projected + own[place[:, 1], place[:, 0]])
        stated[n_pixels] = calibrate(BOARD, views).uncertainty["projector_fx"]
    independent = calibrate(BOARD, _views(0.03, 0.2)).uncertainty["projector_fx"]
    assert stated[1200] == pytest.approx(stated[300], rel=0.25)
    assert 1.8 < stated[300] / independent < 3.2  # about the root of 300 pixels over 40 squares


@pytest.mark.parametrize(("between", "within"), [(0.0, 0.3), (0.5, 0.3), (0.5, 0.0)])
def test_shared_noise_weighs_a_square_s_mean_by_its_variance(between, within):
    rng = np.random.default_rng(0)
    square = np.repeat(np.arange(4000), 12)
    residuals = between * rng.standard_normal((4000, 2))[square] + within * rng.standard_normal((len(square), 2))
    assert shared_noise(residuals, square) ** 2 == pytest.approx(12 * between**2 + within**2, rel=0.05)


def test_residuals_state_the_noise():
    calibration = calibrate(BOARD, _views(0.03, 0.05))
    assert calibration.residuals["camera_rms_px"] == pytest.approx(0.03 * np.sqrt(2), rel=0.1)
    assert calibration.residuals["projector_rms_px"] == pytest.approx(0.05 * np.sqrt(2), rel=0.1)
    assert calibration.residuals["stereo_rms_px"] == pytest.approx(np.sqrt(0.03**2 + 0.05**2), rel=0.1)


@pytest.mark.parametrize(("edges", "expected"), [(0, None), (1, None), (40, 0.8)])
def test_the_camera_s_spread_is_the_median_over_all_boards_edges(edges, expected):
    views = [replace(view, edge_blurs=np.full(edges, 0.6 + 0.05 * i)) for i, view in enumerate(_views())]
    assert calibrate(BOARD, views).camera_psf_px == (expected and pytest.approx(expected))


def test_wild_pixels_are_rejected():
    views = _views(0.03, 0.05)
    wild = views[2].projected.copy()
    wild[::20] += 30.0
    views[2] = replace(views[2], projected=wild)
    calibration = calibrate(BOARD, views)
    assert np.abs(_parameters(calibration.projector)[2:4] - (520, 840)).max() < 6.0
    assert calibration.residuals["stereo_rms_px"] < 0.07


def test_too_few_poses_are_refused_with_what_to_add():
    with pytest.raises(StepError, match="2 poses are too few, at least 3"):
        calibrate(BOARD, _views(n_poses=2))


def test_parallel_boards_are_refused_with_what_to_add():
    with pytest.raises(StepError, match=r"tilts differ by .* add poses tilted by 15 to 30 degrees"):
        calibrate(BOARD, [_views(n_poses=1)[0]] * 5)


def test_views_of_two_cameras_are_refused():
    views = _views()
    views[3] = replace(views[3], camera_size=(800, 600))
    with pytest.raises(InputError, match="`views` must be of one camera"):
        calibrate(BOARD, views)


def test_views_without_the_boards_corners_are_refused():
    views = _views()
    views[1] = replace(views[1], corners=views[1].corners[:-1])
    with pytest.raises(InputError, match=r"`views\[1\]\.corners` must have shape"):
        calibrate(BOARD, views)


@pytest.mark.parametrize("square", [1e300, 1e-300])
def test_a_fit_that_opencv_refuses_is_a_failed_step(square):
    with np.errstate(over="ignore"), pytest.raises(StepError, match="calibration: the camera could not be fitted"):
        calibrate(replace(BOARD, square=square), _views())


@pytest.mark.parametrize("shape", [(5.5, 4), (2, 3), (5,), (1001, 4)])
def test_a_board_counts_its_corners_in_whole_numbers(shape):
    with pytest.raises(InputError, match=r"`shape` must be \(nx, ny\)"):
        Board(shape, 25.0)


@pytest.mark.parametrize("n_pixels_max", [99, -1, 100.5])
def test_a_board_view_keeps_enough_pixels_of_its_own_capture(n_pixels_max):
    image, nothing = np.full((48, 64), 9, np.uint8), np.full((48, 64), np.nan)
    capture = Capture(image, image, (2, 2), PatternKind.GRAY_CODE, [image] * 2, [image] * 2)
    seen = Correspondence(nothing, nothing, np.full((48, 64), 3, np.uint8))
    with pytest.raises(InputError, match="`n_pixels_max` must be a whole number"):
        view_board(BOARD, capture, seen, n_pixels_max)
    smaller = Correspondence(nothing[1:], nothing[1:], seen.reason[1:])
    with pytest.raises(InputError, match=r"`correspondence` must have the capture's shape \(48, 64\), got \(47, 64\)"):
        view_board(BOARD, capture, smaller)


@pytest.mark.parametrize("shift_px", [2.0, 5.0, 30.0])
def test_a_board_whose_pixels_are_all_wrong_is_outvoted_and_told(shift_px):
    views = _views(0.03, 0.05)
    views[3] = replace(views[3], projected=views[3].projected + shift_px)
    calibration = calibrate(BOARD, views)
    assert np.abs(_parameters(calibration.projector)[2:4] - (520, 840)).max() < 6.0
    assert calibration.residuals["stereo_rms_px"] < 0.07
    assert calibration.convergence["rejected_share"] == pytest.approx(1 / 9, abs=0.01)
    assert calibration.residuals["held_out_projector_rms_px"] < 0.1
    assert 0 < calibration.residuals["held_out_length_rms"] < 0.1


def test_the_same_boards_give_the_same_bytes_on_any_number_of_threads():
    views, before = _views(0.3, 0.1, 100, 3), cv2.getNumThreads()
    found = set()
    try:
        for n in (1, 4, 4, 4, 4, 4):
            cv2.setNumThreads(n)
            devices = calibrate(BOARD, views)
            found.add(devices.camera.K.tobytes() + devices.projector.K.tobytes())
    finally:
        cv2.setNumThreads(before)
    assert len(found) == 1

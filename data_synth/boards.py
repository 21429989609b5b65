"""The printed calibration board and the poses that it is photographed in (section 2.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from data_synth.pages import board_page
from data_synth.render import photograph
from data_synth.rig import Rig
from data_synth.sheets import posed
from deskew.errors import require
from deskew.types import Board, Capture, Floats, PatternKind

BOARD = Board(shape=(11, 8), square=18.0)
"""The board: 12 x 9 squares of 18 mm inside a white margin; small enough to be tilted in view from all sides."""

MARGIN_MM = 7.0

# Height of the board's lowest point above the bed [mm], tilt [deg], azimuth of its rise [deg], turn in its own plane
# [deg], and shift [mm]. Tilts of 30 to 36 degrees to all sides, each shifted to where both devices just see all of the
# board: the steeper the boards, the better the focal lengths are known (twice as well as at 13 to 22 degrees).
_POSES = (
    (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    (1.0, 32.0, 8.0, -4.0, -48.0, 10.0),
    (1.0, 30.0, 188.0, 5.0, 40.0, 0.0),
    (1.0, 36.0, 95.0, 3.0, 18.0, 18.0),
    (1.0, 36.0, 275.0, -5.0, -6.0, -16.0),
    (40.0, 4.0, 135.0, -3.0, -20.0, 10.0),
    (1.0, 34.0, 50.0, 6.0, 10.0, 8.0),
    (1.0, 32.0, 225.0, 2.0, 16.0, -14.0),
    (1.0, 34.0, 315.0, -6.0, 12.0, -6.0),
    (1.0, 32.0, 140.0, 4.0, 0.0, 4.0),
    (15.0, 20.0, 75.0, -5.0, 12.0, -14.0),
    (20.0, 18.0, 260.0, 7.0, -14.0, 12.0),
)


@dataclass(frozen=True, slots=True)
class BoardPose:
    """Where the board is: ``X = R x + t`` with x on the board, origin in the middle of its corner grid, x right, y up.

    Attributes
    ----------
    R, t : (3, 3) and (3,) arrays
        Board to world [mm].
    """

    R: Floats
    t: Floats


def board_poses(n: int = 9) -> tuple[BoardPose, ...]:
    """Poses of the board over the depth of field; pose 0 lies on the bed and IS the world's frame.

    Parameters
    ----------
    n : int
        Poses wanted, 3 to 12.
    """
    require(3 <= n <= len(_POSES), "n", f"be in [3, {len(_POSES)}]", n)
    return tuple(_pose(*numbers) for numbers in _POSES[:n])


def _pose(lowest: float, tilt_deg: float, azimuth_deg: float, turn_deg: float, x: float, y: float) -> BoardPose:
    """Tilt the turned board up in a direction and set its lowest corner at a height."""
    tilt, azimuth, turn = np.radians([tilt_deg, azimuth_deg, turn_deg])
    # Rodrigues about the horizontal axis that lies across the direction of the rise.
    axis = np.array([np.sin(azimuth), -np.cos(azimuth), 0.0])
    W = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    spin = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    R = (np.eye(3) + np.sin(tilt) * W + (1 - np.cos(tilt)) * (W @ W)) @ spin
    width, height = board_page(BOARD, MARGIN_MM).page_size_mm
    corners = np.array([[sx * width / 2, sy * height / 2, 0] for sx in (-1, 1) for sy in (-1, 1)])
    return BoardPose(R, np.array([x, y, lowest - (corners @ R.T)[:, 2].min()]))


def render_board(
    rig: Rig,
    pose: BoardPose,
    seed: int | np.random.Generator,
    board: Board = BOARD,
    pattern: PatternKind = PatternKind.LINE_SWEEP,
) -> Capture:
    """Photograph the board in a pose: white, black and lazy coded frames.

    Parameters
    ----------
    rig : Rig
        The bench.
    pose : BoardPose
        From :func:`board_poses`.
    seed : int or numpy Generator
        Of the sensor's noise.
    board : Board
        Corners and squares [mm].
    pattern : PatternKind
        What the projector shows.
    """
    page = board_page(board, MARGIN_MM)
    return photograph(rig, posed(page.page_size_mm, pose.R, pose.t), page, seed, pattern)

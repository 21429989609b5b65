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
# [deg], and shift [mm]: heights and tilts span the working volume, azimuths all directions.
_POSES = (
    (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    (1.0, 16.0, 8.0, -4.0, -22.0, 14.0),
    (1.0, 16.0, 188.0, 5.0, 22.0, -4.0),
    (1.0, 22.0, 95.0, 3.0, 24.0, 14.0),
    (1.0, 21.0, 275.0, -5.0, -13.0, -10.0),
    (28.0, 9.0, 45.0, 6.0, 10.0, -6.0),
    (60.0, 3.0, 135.0, -3.0, -14.0, 7.0),
    (2.0, 13.0, 225.0, 2.0, -18.0, 14.0),
    (2.0, 13.0, 315.0, -6.0, 18.0, -4.0),
    (36.0, 9.0, 200.0, 4.0, -8.0, 6.0),
    (15.0, 12.0, 60.0, -5.0, 12.0, -6.0),
    (22.0, 11.0, 160.0, 7.0, 0.0, 0.0),
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

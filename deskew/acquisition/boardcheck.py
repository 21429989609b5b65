"""A board scanned through a calibration that has not seen it: a plane, and lengths that are known (section 2.5).

The paper's figure, the deviation from a plane, is blind to a wrong scale; lengths between the board's corners see it.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from deskew import projection
from deskew.acquisition.accuracy import PlaneDeviation, length_errors, plane_deviation
from deskew.acquisition.calibration import board_points
from deskew.errors import StepError
from deskew.types import Board, DepthMap, Floats, Pinhole

_RADIUS_SQUARES = 0.4  # around a corner, in squares as seen
_FEWEST_CORNERS = 4  # a plane through three has no deviation
_RIM_SQUARES = 0.9  # from the outermost corners towards the board's border


@dataclass(frozen=True, slots=True)
class BoardAccuracy:
    """How a scanned board differs from what was printed; lengths are in the calibration's unit.

    Attributes
    ----------
    plane : PlaneDeviation
        Of the corners from their best-fit plane.
    length_rms_mm : float
        Root mean square error of the lengths between corners.
    coverage : float
        Share of the board's pixels that have depth, its black squares included.
    """

    plane: PlaneDeviation
    length_rms_mm: float
    coverage: float


def board_accuracy(
    board: Board,
    corners: Floats,
    camera: Pinhole,
    depth: DepthMap,
    min_length: float | None = None,
    radius_px: int | None = None,
) -> BoardAccuracy:
    """Measure a scanned board at its corners.

    Parameters
    ----------
    board : Board
        What was printed.
    corners : (ny * nx, 2) array
        Inner corners in the camera [raw px], as :class:`BoardView` has them.
    camera : Pinhole
        The raw camera.
    depth : DepthMap
        The board, unfiltered.
    min_length : float, optional
        Shortest length that counts, in the board's unit; half the diagonal of its corners if not given.
    radius_px : int, optional
        Half-width of the neighbourhood that a corner's depth is taken from; 0.4 squares as the camera sees them if not
        given.

    Raises
    ------
    StepError
        If hardly any corner has depth around it.
    """
    seen = corners_in_view(camera, depth.camera, corners)
    if radius_px is None:
        grid = seen.reshape(board.shape[1], board.shape[0], 2)
        sides = np.linalg.norm(np.diff(grid, axis=1), axis=-1), np.linalg.norm(np.diff(grid, axis=0), axis=-1)
        radius_px = max(1, round(_RADIUS_SQUARES * min(float(np.median(side)) for side in sides)))
    points, exact = scanned_points(depth, seen, radius_px), board_points(board)
    known = np.isfinite(points).all(axis=1)
    if known.sum() < _FEWEST_CORNERS:
        raise StepError(
            f"board accuracy: {int(known.sum())} of {len(points)} corners have depth around them, at least "
            f"{_FEWEST_CORNERS} are needed; is the board lit, and do --heights and --jump let its depth pass?"
        )
    if min_length is None:
        min_length = float(np.linalg.norm(exact[-1] - exact[0])) / 2
    errors = length_errors(points, exact, min_length)
    return BoardAccuracy(
        plane_deviation(points[known]), float(np.sqrt((errors**2).mean())), _covered(depth, board_border(board, seen))
    )


def corners_in_view(camera: Pinhole, view: Pinhole, corners: Floats) -> Floats:
    """Raw camera pixels (N, 2) as the undistorted view shows them [px]."""
    return np.asarray(projection.undistort(camera, corners) @ view.K[:2, :2].T + view.K[:2, 2])


def board_border(board: Board, corners: Floats) -> Floats:
    """Return the outer corners (4, 2) [px] of the board's outermost squares, a homography beyond the inner corners.

    Parameters
    ----------
    board : Board
        Its shape counts.
    corners : (ny * nx, 2) array
        Inner corners in an undistorted view [px].
    """
    nx, ny = board.shape
    grid = np.stack(np.meshgrid(np.arange(nx), np.arange(ny)), axis=-1).reshape(-1, 2).astype(np.float64)
    homography, _ = cv2.findHomography(grid, corners)
    low, right, bottom = -_RIM_SQUARES, nx - 1 + _RIM_SQUARES, ny - 1 + _RIM_SQUARES
    rim = np.array([(low, low), (right, low), (right, bottom), (low, bottom)])
    return np.asarray(cv2.perspectiveTransform(rim.reshape(-1, 1, 2), homography)).reshape(4, 2)


def _covered(depth: DepthMap, border: Floats) -> float:
    board = cv2.fillConvexPoly(np.zeros(depth.z.shape, np.uint8), np.rint(border).astype(np.int32), (1,))
    return float(np.isfinite(depth.z[board > 0]).mean())


def scanned_points(depth: DepthMap, pixels: Floats, radius_px: int) -> Floats:
    """Return world points at sub-pixel places of a depth map.

    Depth beside an ink edge is biased one way on one side and the other way on the other. A plane through the
    neighbourhood cancels that; in inverse depth a plane is linear in the pixel.

    Parameters
    ----------
    depth : DepthMap
        On the undistorted grid.
    pixels : (N, 2) array
        Places (x, y) on the same grid [px]; NaN allowed.
    radius_px : int
        Half-width of the square neighbourhood; the surface must be flat in it.

    Returns
    -------
    (N, 3) array
        World points, in the calibration's unit; NaN where less than a quarter of the neighbourhood has a depth:
        around a corner of a checkerboard, ink may leave half of it dark.
    """
    height, width = depth.z.shape
    offsets = np.arange(-radius_px, radius_px + 1)
    inverse = np.full(len(pixels), np.nan)
    for i, (x, y) in enumerate(pixels):
        if not np.isfinite([x, y]).all():
            continue
        columns, rows = np.meshgrid(round(x) + offsets, round(y) + offsets)
        inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
        columns, rows = columns[inside], rows[inside]
        known = np.isfinite(depth.z[rows, columns])
        if 4 * known.sum() < len(offsets) ** 2:
            continue
        design = np.stack([np.ones(len(columns)), columns - x, rows - y], axis=-1)[known]
        inverse[i] = _plane_at_origin(design, 1.0 / depth.z[rows, columns][known])
    return np.asarray(projection.centre(depth.camera) + projection.rays(depth.camera, pixels) / inverse[:, None])


def _plane_at_origin(design: Floats, values: Floats, n_reweightings: int = 4) -> float:
    """Fit ``values = design @ (c, a, b)`` and return c; residuals beyond a few medians hardly count."""
    weight = np.ones(len(values))
    solution: Floats = np.zeros(3)
    for _ in range(n_reweightings + 1):
        solution = np.linalg.lstsq(design * weight[:, None], values * weight, rcond=None)[0]
        residual = np.abs(design @ solution - values)
        weight = 1.0 / (1.0 + residual / (2.0 * np.median(residual) + 1e-300))
    return float(solution[0])

"""Pictures that were flattened by themselves, at any size, brought to where the control shows the page."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import cv2
import numpy as np

from deskew import acquisition, metrics, projection, restoration
from deskew.errors import StepError
from deskew.metrics import Alignment
from deskew.types import Array, Floats, Pinhole, Size
from experiments.studies.views import reflectance

# Sides of the picture that the board is looked for in, of the control's: OpenCV's detector loses now and then a board
# that fills its picture, and finds the same one a little larger or smaller.
_SIDES = (1.0, 0.875, 0.75, 0.625)


@dataclass(frozen=True, slots=True)
class Placed:
    """A picture in the control's frame.

    Attributes
    ----------
    image : (height, width[, 3]) array
        Resampled once, by an affine map; 0 beyond the picture.
    to_view, to_own : Alignment
        From the picture's own pixels to the view's, and back.
    """

    image: Array
    to_view: Alignment
    to_own: Alignment

    @classmethod
    def onto(cls, view: Pinhole, image: Array, own: Floats, wanted: Floats) -> Placed:
        """Lay a picture so that some of its pixels come to lie on pixels of a view, by least squares.

        Parameters
        ----------
        view : Pinhole
            The control's.
        image : (h, w[, 3]) array
            The picture.
        own, wanted : (N, 2) arrays
            Its pixels, and where the view shows the same; NaN where it is not known.

        Raises
        ------
        StepError
            If the picture shows a mirrored page.
        """
        known = np.isfinite(own).all(axis=1) & np.isfinite(wanted).all(axis=1)
        metrics.require_not_mirrored(own[known], wanted[known], "Dewarped picture")
        to_view = metrics.fit_affine(own[known], wanted[known])
        inverse = np.linalg.inv(to_view.matrix)
        to_own = Alignment(inverse, -inverse @ to_view.offset)
        places = to_own.apply(projection.pixel_grid(view.size))
        limit = np.array([image.shape[1], image.shape[0]]) - 0.5
        places[~((places >= -0.5) & (places <= limit)).all(axis=-1)] = np.nan
        step_px = float(np.sqrt(np.linalg.det(inverse)))
        return cls(restoration.read_at(image, places, step_px), to_view, to_own)


def board_corners(image: Array, squares: tuple[int, int], view_size: Size) -> Floats:
    """Find a checkerboard's inner corners in a picture that nothing is known of.

    Parameters
    ----------
    image : (height, width[, 3]) array
        The picture, at any size, whichever way up.
    squares : (nx, ny)
        Of the print, whose top left square is ink.
    view_size : (width, height)
        Of the control [px]; the picture is looked at in about that size.

    Returns
    -------
    ((nx - 1) (ny - 1), 2) array
        Pixels, row by row from the print's top left. A board of an odd number of columns looks the same in a mirror:
        that a picture is mirrored from left to right does not show.

    Raises
    ------
    StepError
        If no whole board is found.
    """
    for side in _SIDES:
        scale = side * max(view_size) / max(image.shape[:2])
        how = cv2.INTER_AREA if scale < 1.0 else cv2.INTER_CUBIC
        levels = reflectance(cv2.resize(image, None, fx=scale, fy=scale, interpolation=how))
        with suppress(StepError):
            grid = acquisition.find_board(levels, (squares[0] - 1, squares[1] - 1))
            return _named(grid, levels, scale)
    corners = f"{squares[0] - 1} x {squares[1] - 1} inner corners"
    raise StepError(f"Dewarped picture: no whole board of {corners} is found in it; look at the picture.")


def _named(grid: Floats, levels: Floats, scale: float) -> Floats:
    """Order a board's corners from the print's top left, by its colours, and give their places before the scaling."""
    middles = (grid[:-1, :-1] + grid[1:, 1:] + grid[1:, :-1] + grid[:-1, 1:]) / 4
    grey = restoration.read_at(levels, middles, 1.0)
    even = np.add.outer(np.arange(grey.shape[0]), np.arange(grey.shape[1])) % 2 == 0
    if grey[even].mean() > grey[~even].mean():
        grid = grid[::-1, ::-1]
    # A change of resolution is about the corner at (-1/2, -1/2).
    return np.asarray((grid.reshape(-1, 2) + 0.5) / scale - 0.5)

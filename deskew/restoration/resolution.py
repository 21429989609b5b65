"""How finely a restored view shows the flat page: the dots per inch that a picture's file states."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from deskew import projection
from deskew.errors import StepError
from deskew.types import Floats, Pinhole

_STEPS = 32  # the page is asked at about this many places down and across


def pixels_per_unit(camera: Pinhole, page: npt.NDArray[np.bool_]) -> tuple[float, float]:
    """Return the pixels a unit of length on the bed that a view has along its rows and along its columns.

    A camera that leans shows the near side larger: the figures are those of the affine map that fits the page best.

    Parameters
    ----------
    camera : Pinhole
        The ideal camera that the restored view is seen through.
    page : (height, width) bool array
        Where the view shows the page.

    Returns
    -------
    x, y : float
        Pixels a unit [1 / mm, where the calibration is in mm].

    Raises
    ------
    StepError
        If the page shows at fewer than three places that are not on one line.
    """
    rows, columns = np.nonzero(page)
    if len(rows) == 0:
        raise StepError("The resolution cannot be told: the view does not show the page; move it back into view.")
    kept = slice(None, None, max(1, len(rows) // _STEPS**2))
    pixels = np.stack([columns[kept], rows[kept]], axis=-1).astype(np.float64)
    places: Floats = projection.onto_bed(camera, pixels)
    design = np.column_stack([places, np.ones(len(places))])
    fitted, _, rank, _ = np.linalg.lstsq(design - [*places.mean(axis=0), 0.0], pixels, rcond=None)
    if rank < 3:
        raise StepError("The resolution cannot be told: the view shows hardly any of the page; use a larger --scale.")
    x, y = np.linalg.norm(fitted[:2], axis=0)
    return float(x), float(y)

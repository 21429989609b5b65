"""How finely a restored view shows the flat page: the dots per inch that a picture's file states."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from deskew import projection
from deskew.errors import StepError
from deskew.types import Floats, Pinhole, Scan

_PER_INCH = {"mm": 25.4, "cm": 2.54, "m": 0.0254, "in": 1.0}
_STEPS = 32  # the page is asked at about this many places down and across


def dots_per_inch(scan: Scan, camera: Pinhole, backward_map: npt.NDArray[np.float32]) -> tuple[float, float] | None:
    """Return a restored view's dots per inch along its rows and columns.

    Parameters
    ----------
    scan : Scan
        Its unit of length counts.
    camera : Pinhole
        The ideal camera that the view is seen through.
    backward_map : (height, width, 2) array
        NaN where the view does not show the page.

    Returns
    -------
    x, y : float, or None
        None where the unit is not mm, cm, m or in.
    """
    if scan.unit not in _PER_INCH:
        return None
    x, y = pixels_per_unit(camera, np.isfinite(backward_map[..., 0]))
    return x * _PER_INCH[scan.unit], y * _PER_INCH[scan.unit]


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

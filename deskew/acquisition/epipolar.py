"""Epipolar culling: a decoded projector point must lie on the epipolar line of its camera pixel (section 2.3).

It needs both sweeps: with one, the ray always meets the projector's plane. Errors along the line survive it; the other
gates of the depth map are for those.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from deskew.acquisition.matches import Matches, match
from deskew.errors import require
from deskew.types import Calibration, Correspondence, Floats, Reason

TOLERANCE_PX = 2.0


def line_distance(matches: Matches) -> Floats:
    """Signed distance of each decoded point from its epipolar line, (N,) [undistorted projector px].

    The line of camera direction x is ``E x`` with ``E = [t]_x R``; dividing by the focal lengths turns its normal into
    projector pixels.
    """
    directions = np.concatenate([matches.camera, np.ones((len(matches.camera), 1))], axis=1)
    lines = np.cross(matches.t, directions @ matches.R.T)
    normals = lines[:, :2] / matches.focal_px
    offset = (lines[:, :2] * matches.projector).sum(1) + lines[:, 2]
    with np.errstate(divide="ignore", invalid="ignore"):  # devices in one place have no lines: no distance is small
        return np.asarray(offset / np.hypot(*normals.T))


def epipolar_distance(calibration: Calibration, correspondence: Correspondence) -> Floats:
    """Signed distance of each pixel's decoded point from its epipolar line.

    Lens distortion is taken out of both devices first.

    Returns
    -------
    (height, width) array
        Undistorted projector pixels, NaN where nothing was decoded.
    """
    matches = match(calibration, correspondence)
    distance = np.full(matches.mask.shape, np.nan)
    distance[matches.mask] = line_distance(matches)
    return distance


def cull_epipolar(
    calibration: Calibration, correspondence: Correspondence, tolerance_px: float = TOLERANCE_PX
) -> Correspondence:
    """Mark pixels whose decoded point is off its epipolar line with `Reason.EPIPOLAR`.

    Parameters
    ----------
    calibration : Calibration
        Both devices.
    correspondence : Correspondence
        Decoded points at the raw camera pixels.
    tolerance_px : float
        Largest distance kept [undistorted projector px], > 0. Decoding and calibration noise stay under 0.3; at
        the border of black ink on white paper the peaks are pulled by up to 1.5.

    Returns
    -------
    Correspondence
        The same with the culled pixels' coordinates NaN.
    """
    require(tolerance_px > 0, "tolerance_px", "be positive [projector px]", tolerance_px)
    # `not <=`: a point that could not be undistorted is culled too.
    off = (correspondence.reason == Reason.OK) & ~(
        np.abs(epipolar_distance(calibration, correspondence)) <= tolerance_px
    )
    return replace(
        correspondence,
        column=np.where(off, np.nan, correspondence.column),
        row=np.where(off, np.nan, correspondence.row),
        reason=np.where(off, np.uint8(Reason.EPIPOLAR), correspondence.reason),
    )

"""Triangulation: the depth at which a camera ray passes closest to the decoded projector point (section 2.3)."""

from __future__ import annotations

import numpy as np

from deskew.acquisition.matches import Matches, match
from deskew.types import Calibration, Correspondence, Floats


# Devices in one place have no epipolar lines: their depths come out as NaN, which is a result and no warning.
@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def solve_depth(matches: Matches) -> Floats:
    """Camera z of each match, (N,) [mm]; NaN where the rays meet behind a device or not at all.

    The point at depth z of camera direction x projects to ``(z a + b)`` with ``a = R x``, ``b = t``. Least squares in
    projector pixels has a closed form, since these projections run along the epipolar line: move the decoded point onto
    the line at a right angle, then solve both coordinates' linear equations in z, which now agree. The camera pixel is
    exact: it is where the depth is wanted.
    """
    directions = np.concatenate([matches.camera, np.ones((len(matches.camera), 1))], axis=1)
    a = directions @ matches.R.T
    b = matches.t
    lines = np.cross(b, a)
    normals = lines[:, :2] / matches.focal_px
    off = ((lines[:, :2] * matches.projector).sum(1) + lines[:, 2]) / (normals**2).sum(1)
    on_line = matches.projector - off[:, None] * normals / matches.focal_px
    # z (a_i - p_i a_3) = p_i b_3 - b_i for i = 1, 2, weighted in pixels.
    slope = (a[:, :2] - on_line * a[:, 2:]) * matches.focal_px
    value = (on_line * b[2] - b[:2]) * matches.focal_px
    strength = (slope**2).sum(1)
    z = np.divide((slope * value).sum(1), strength, out=np.full(len(a), np.nan), where=strength > 0)
    z[~((z > 0) & (z * a[:, 2] + b[2] > 0))] = np.nan
    return np.asarray(z)


def triangulate(calibration: Calibration, correspondence: Correspondence) -> Floats:
    """Depth in the camera's frame at every raw pixel.

    Parameters
    ----------
    calibration : Calibration
        Both devices; lens distortion is taken out of both.
    correspondence : Correspondence
        Decoded points at the raw camera pixels.

    Returns
    -------
    (height, width) array
        Camera z [mm], NaN where nothing was decoded or the rays do not meet in front of both devices.
    """
    matches = match(calibration, correspondence)
    z = np.full(matches.mask.shape, np.nan)
    z[matches.mask] = solve_depth(matches)
    return z

"""The depth map against the true surface, in the world and on the same pixels."""

from __future__ import annotations

import numpy as np

from deskew import projection
from deskew.errors import StepError, require
from deskew.types import DepthMap, Floats


def depth_error(depth: DepthMap, true_points: Floats, prefix: str = "depth_raw") -> dict[str, float]:
    """Deviation of the measured from the true surface along the line of sight, and how much of the page was measured.

    Both are compared as points of the world, whose frame the first board defines. Camera z by itself is no length that
    a page has: a focal length that is off by a 10,000th moves the camera's own centre by as much, away from the page
    or towards it, and leaves every point of the world where it was.

    Parameters
    ----------
    depth : DepthMap
        On the undistorted grid, with its camera in the world.
    true_points : (H, W, 3) array
        True world points [mm] seen at the same pixels; NaN off the page, which leaves a pixel out of every figure.
    prefix : str
        "depth_raw" before any filter, "depth" after it.

    Returns
    -------
    dict
        `{prefix}_{rms,p95,max}_mm` of the absolute deviation, `{prefix}_bias_mm`, its signed mean (positive: measured
        too far from the camera), and `depth_coverage`, the share of the page's pixels with depth: without it a figure
        can be bought by leaving the difficult pixels out.

    Raises
    ------
    StepError
        If no pixel of the page has depth.
    """
    wanted = (*depth.z.shape, 3)
    require(true_points.shape == wanted, "true_points", f"have shape {wanted}", true_points.shape)
    page = np.isfinite(true_points).all(axis=-1)
    require(bool(page.any()), "true_points", "be finite somewhere: on the page", "all NaN")
    both = page & np.isfinite(depth.z)
    if not both.any():
        raise StepError(
            f"Depth error: none of the page's {int(page.sum())} pixels has depth; check exposure and decoding gates."
        )
    rays = projection.rays(depth.camera, projection.pixel_grid(depth.camera.size)[both])
    measured = projection.centre(depth.camera) + depth.z[both][:, None] * rays
    along = ((measured - true_points[both]) * rays).sum(axis=-1) / np.linalg.norm(rays, axis=-1)
    deviation = np.abs(along)
    return {
        f"{prefix}_rms_mm": float(np.sqrt((deviation**2).mean())),
        f"{prefix}_p95_mm": float(np.percentile(deviation, 95)),
        f"{prefix}_max_mm": float(deviation.max()),
        f"{prefix}_bias_mm": float(along.mean()),
        "depth_coverage": float(both.sum() / page.sum()),
    }

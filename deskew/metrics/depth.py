"""The depth map against true depth, on the same pixels."""

from __future__ import annotations

import numpy as np

from deskew.errors import StepError, require
from deskew.types import DepthMap, Floats


def depth_error(depth: DepthMap, true_z: Floats, prefix: str = "depth_raw") -> dict[str, float]:
    """Deviation of measured from true camera depth, and how much of the page was measured.

    Parameters
    ----------
    depth : DepthMap
        On the undistorted grid.
    true_z : (H, W) array
        True camera z [mm] at the same pixels; NaN off the page, which leaves a pixel out of every figure.
    prefix : str
        "depth_raw" before any filter, "depth" after it.

    Returns
    -------
    dict
        `{prefix}_{rms,p95,max}_mm` of the absolute deviation and `depth_coverage`, the share of the page's pixels with
        depth: without it a figure can be bought by leaving the difficult pixels out.

    Raises
    ------
    StepError
        If no pixel of the page has depth.
    """
    require(true_z.shape == depth.z.shape, "true_z", f"have the depth map's shape {depth.z.shape}", true_z.shape)
    page = np.isfinite(true_z)
    require(bool(page.any()), "true_z", "be finite somewhere: on the page", "all NaN")
    both = page & np.isfinite(depth.z)
    if not both.any():
        raise StepError(
            f"Depth error: none of the page's {int(page.sum())} pixels has depth; check exposure and decoding gates."
        )
    deviation = np.abs(depth.z[both] - true_z[both])
    return {
        f"{prefix}_rms_mm": float(np.sqrt((deviation**2).mean())),
        f"{prefix}_p95_mm": float(np.percentile(deviation, 95)),
        f"{prefix}_max_mm": float(deviation.max()),
        "depth_coverage": float(both.sum() / page.sum()),
    }

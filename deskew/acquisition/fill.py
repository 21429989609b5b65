"""Depth carried to the page's very edge and over small holes, for the mesh only.

Pixels on the page's rim mix page and desk, so their depth is not trusted; yet the mesh must reach the true outline.
Both gaps are bridged by local planes: the inverse depth of a plane is linear in the pixel, so a plane stays one.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt
from scipy import ndimage

from deskew.acquisition.jumps import depth_jumps
from deskew.acquisition.outline import Outline
from deskew.errors import StepError, require
from deskew.types import DepthMap, Floats

# Width of the rim inside the outline where a camera pixel, spread by the lens, still sees the desk.
RIM_PX = 2.0
# Reach beyond the outline, so that depth can be interpolated on the outline itself.
BEYOND_PX = 3
# Standard deviations of the windows that local planes are fitted in; the smallest with enough depth in it is used.
WINDOWS_PX = (2.0, 4.0, 8.0)
SUPPORT_MIN = 0.04


@dataclass(frozen=True, slots=True)
class FilledDepth:
    """Depth on every pixel of the page and just beyond.

    Attributes
    ----------
    inverse_z : (height, width) array
        1 / camera z [1/mm] on the undistorted grid, NaN away from the page.
    measured : (height, width) bool array
        True where the depth map itself speaks; elsewhere the value is carried over from the surroundings.
    inside : (height, width) bool array
        The page without its rim.
    jump : (height, width) bool array
        Pixels beside a jump of the depth: nothing may be interpolated across them.
    """

    inverse_z: Floats
    measured: npt.NDArray[np.bool_]
    inside: npt.NDArray[np.bool_]
    jump: npt.NDArray[np.bool_]


def fill_depth(depth: DepthMap, outline: Outline, max_hole_px: float) -> FilledDepth:
    """Carry depth over the rim and over holes no point of which is farther than `max_hole_px` from measured depth.

    Parameters
    ----------
    depth : DepthMap
        Measured depth; what lies outside the outline, or on its rim of 2 px, is not used.
    outline : Outline
        The page's boundary on the same grid.
    max_hole_px : float
        Largest distance to measured depth over which a value is carried [px].

    Returns
    -------
    FilledDepth

    Raises
    ------
    StepError
        If the page has no depth at all or a larger hole.
    """
    require(bool(np.isfinite(max_hole_px)) and max_hole_px >= RIM_PX, "max_hole_px", f"be >= {RIM_PX}", max_hole_px)
    page = _polygon_mask(outline.ring, depth.z.shape)
    inside = cv2.distanceTransform(page, cv2.DIST_L2, cv2.DIST_MASK_PRECISE) > RIM_PX
    measured = inside & np.isfinite(depth.z) & (depth.z > 0)
    if not measured.any():
        raise StepError("Page mesh: no pixel inside the outline has depth; check the exposure and the decoding gates.")
    wanted = cv2.dilate(page, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * BEYOND_PX + 1,) * 2)).astype(bool)
    _require_small_holes(measured, page.astype(bool), max_hole_px)
    inverse = np.where(measured, 1.0 / np.where(measured, depth.z, 1.0), np.nan)
    jump = depth_jumps(np.where(measured, depth.z, np.nan), page.astype(bool), float(depth.camera.K[0, 0]))
    # The reach beyond the outline comes on top of the largest hole.
    missing = wanted & ~measured
    torn = missing & _near(jump)
    missing &= ~torn  # no plane belongs to both sides of a jump
    for sigma in (*WINDOWS_PX, 16.0):
        if not missing.any():
            break
        plane = _local_planes(inverse, measured, sigma, missing)
        good = np.isfinite(plane)
        inverse[good] = plane[good]
        missing &= ~good
    missing |= torn
    if missing.any():
        nearest = ndimage.distance_transform_edt(~np.isfinite(inverse), return_distances=False, return_indices=True)
        inverse[missing] = inverse[tuple(nearest[:, missing])]
    return FilledDepth(inverse, measured, inside, jump)


def _near(jump: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Pixels within a middling window of a jump."""
    if not jump.any():
        return jump
    return np.asarray(ndimage.distance_transform_edt(~jump) <= 2 * WINDOWS_PX[1])


def _polygon_mask(ring: Floats, shape: tuple[int, ...]) -> npt.NDArray[np.uint8]:
    """Pixels whose centre lies inside the polygon, to 1/16 pixel."""
    mask = np.zeros(shape, dtype=np.uint8)
    cv2.fillPoly(mask, [np.rint(ring * 16).astype(np.int32).reshape(-1, 1, 2)], 1, shift=4)
    return mask


def _require_small_holes(measured: npt.NDArray[np.bool_], page: npt.NDArray[np.bool_], max_hole_px: float) -> None:
    distance = np.where(page, ndimage.distance_transform_edt(~measured), 0.0)
    worst = float(distance.max())
    if worst > max_hole_px:
        y, x = np.unravel_index(int(distance.argmax()), distance.shape)
        share = float((page & ~measured).sum() / page.sum())
        raise StepError(
            f"Page mesh: pixel ({x}, {y}) on the page lies {worst:.1f} px from the nearest depth, at most "
            f"{max_hole_px:g} px can be bridged ({share:.1%} of the page has no depth); "
            "scan it again with more light, or raise `max_hole_px`."
        )


def _local_planes(
    inverse: Floats, measured: npt.NDArray[np.bool_], sigma: float, asked: npt.NDArray[np.bool_]
) -> Floats:
    """Value of the weighted least-squares plane around the pixels asked for; NaN elsewhere and where depth is scarce.

    Normalised convolution of first order: the moments of the Gaussian window over the measured pixels.
    """
    weight = measured.astype(np.float64)
    middle = float(inverse[measured].mean())
    value = np.where(measured, inverse - middle, 0.0)
    reach = int(np.ceil(3 * sigma))
    t = np.arange(-reach, reach + 1, dtype=np.float64)
    g = np.exp(-0.5 * (t / sigma) ** 2)
    g /= g.sum()
    kernels = (g, g * t, g * t * t)

    def moment(image: Floats, px: int, py: int) -> Floats:
        filtered = cv2.sepFilter2D(image, cv2.CV_64F, kernels[px], kernels[py], borderType=cv2.BORDER_CONSTANT)
        return np.asarray(filtered[at])

    at = asked & (cv2.sepFilter2D(weight, cv2.CV_64F, g, g, borderType=cv2.BORDER_CONSTANT) >= SUPPORT_MIN)
    s0 = moment(weight, 0, 0)
    # A ridge on the slopes keeps them finite where the window holds a single line of pixels.
    ridge = 1e-6 * sigma**2 * s0 + 1e-12
    sx, sy, sxy = moment(weight, 1, 0), moment(weight, 0, 1), moment(weight, 1, 1)
    normal = np.stack(
        [s0 + 1e-12, sx, sy, sx, moment(weight, 2, 0) + ridge, sxy, sy, sxy, moment(weight, 0, 2) + ridge], axis=-1
    )
    right = np.stack([moment(value, 0, 0), moment(value, 1, 0), moment(value, 0, 1)], axis=-1)
    plane = np.full(inverse.shape, np.nan)
    plane[at] = middle + np.linalg.solve(normal.reshape(-1, 3, 3), right[..., None])[:, 0, 0]
    return plane

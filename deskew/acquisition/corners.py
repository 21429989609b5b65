"""Checkerboard corners to sub-pixel accuracy (section 2.2): Kitchen-Rosenfeld's and a saddle point's.

The paper's detector is Kitchen and Rosenfeld's cornerness, "0.1 pixel accuracy". At the X-corner of a checkerboard that
cornerness is 0/0, surrounded by four lobes of alternating sign, so its maximum lies about 2 px off the corner. The
usable reading is the re-centred centroid of its magnitude; the naive one is kept as `kitchen_rosenfeld_peaks`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from scipy import ndimage

from deskew.acquisition.grey import grey_levels
from deskew.errors import StepError, is_whole, require, require_positive, require_whole
from deskew.types import Array, Floats

_LOST = np.full(2, np.nan)
_SMALLEST_IMAGE_PX = 16
# A corner's saddle must stand out of the image's noise by this many standard deviations; on a blank page none does.
SADDLE_SNR = 10.0
LARGEST_WINDOW_PX = 100


class Derivatives(NamedTuple):
    """Gaussian derivatives of an image, each (height, width) [grey levels / px^n]."""

    x: Floats
    y: Floats
    xx: Floats
    xy: Floats
    yy: Floats


def derivatives(image: Array, sigma_px: float) -> Derivatives:
    """Gaussian derivatives of first and second order.

    Parameters
    ----------
    image : (height, width[, 3]) array
        Grey levels.
    sigma_px : float
        Scale, in (0, 100].
    """
    require_positive("sigma_px", sigma_px, LARGEST_WINDOW_PX, "px")
    grey = grey_levels(image).astype(np.float64)
    orders = ((0, 1), (1, 0), (0, 2), (1, 1), (2, 0))  # (along y, along x)
    return Derivatives(*(ndimage.gaussian_filter(grey, sigma_px, order=order, mode="nearest") for order in orders))


def kitchen_rosenfeld(d: Derivatives) -> Floats:
    """Kitchen and Rosenfeld's cornerness: the curvature of the isophote times the gradient's magnitude.

    ``(Ixx Iy^2 - 2 Ixy Ix Iy + Iyy Ix^2) / (Ix^2 + Iy^2)``, 0 where the gradient vanishes.

    References
    ----------
    L. Kitchen and A. Rosenfeld, "Gray-level corner detection", Pattern Recognition Letters 1, 1982: the paper's [10].
    """
    gradient2 = d.x**2 + d.y**2
    numerator = d.xx * d.y**2 - 2 * d.xy * d.x * d.y + d.yy * d.x**2
    return np.divide(numerator, gradient2, out=np.zeros_like(numerator), where=gradient2 > 1e-12 * gradient2.max())


def _saddle_strength(image: Array, d: Derivatives, sigma_px: float) -> Floats:
    """How far each pixel's saddle stands out of the noise, (height, width) in standard deviations; 0 where it has none.

    ``sqrt(Ixy^2 - Ixx Iyy)`` over the noise of Ixy, which is ``noise / sqrt(16 pi sigma^6)`` for white noise. The noise
    is Immerkaer's: the median magnitude of a mask that no plane and no straight edge excites.
    """
    mask = np.array([[1, -2, 1], [-2, 4, -2], [1, -2, 1]]) / 6.0
    response = np.abs(ndimage.convolve(grey_levels(image).astype(np.float64), mask, mode="nearest"))
    noise = max(float(np.median(response)) / 0.6745, 1 / np.sqrt(12))  # no camera is quieter than its rounding
    strength = np.sqrt(np.maximum(d.xy**2 - d.xx * d.yy, 0.0))
    return np.asarray(strength * np.sqrt(16 * np.pi * sigma_px**6) / noise)


def _lose_weak(corners: Floats, strength: Floats) -> None:
    """Set corners to NaN, in place, where `strength` at their pixel is below `SADDLE_SNR`."""
    found = np.isfinite(corners).all(axis=1)
    x, y = np.rint(corners[found]).astype(int).T
    height, width = strength.shape
    weak = strength[np.clip(y, 0, height - 1), np.clip(x, 0, width - 1)] < SADDLE_SNR
    corners[np.flatnonzero(found)[weak]] = np.nan


def _require_seeds(seeds: Floats) -> Floats:
    require(seeds.ndim == 2 and seeds.shape[1] == 2, "seeds", "have shape (N, 2)", seeds.shape)
    return np.asarray(seeds, dtype=np.float64)


def _patch(centre: Floats, radius: int, shape: tuple[int, int]) -> tuple[slice, slice] | None:
    """Return the window of half-width `radius` around the pixel (x, y), or None if it leaves the image."""
    x, y = np.rint(centre).astype(int)
    inside = radius <= x < shape[1] - radius and radius <= y < shape[0] - radius
    return (slice(y - radius, y + radius + 1), slice(x - radius, x + radius + 1)) if inside else None


def kitchen_rosenfeld_peaks(image: Array, seeds: Floats, *, radius_px: int = 10, sigma_px: float = 2.0) -> Floats:
    """Find the NAIVE reading: the strongest cornerness near each seed. About 2 px off at an X-corner.

    Kept to show why the paper's "0.1 pixel accuracy" needs the centroid; parameters as in
    :func:`refine_kitchen_rosenfeld`.
    """
    require_whole("radius_px", radius_px, 1, LARGEST_WINDOW_PX)
    response = np.abs(kitchen_rosenfeld(derivatives(image, sigma_px)))
    found = np.full_like(_require_seeds(seeds), np.nan)
    for i, seed in enumerate(seeds):
        window = _patch(seed, radius_px, response.shape) if np.isfinite(seed).all() else None
        if window is not None:
            y, x = np.unravel_index(int(np.argmax(response[window])), response[window].shape)
            found[i] = x + window[1].start, y + window[0].start
    return found


def refine_kitchen_rosenfeld(
    image: Array, seeds: Floats, *, radius_px: int = 10, sigma_px: float = 2.0, n_iterations: int = 30
) -> Floats:
    """Refine corners to the centroid of Kitchen-Rosenfeld's response without its sign, re-centred until it rests.

    Parameters
    ----------
    image : (height, width[, 3]) array
        Grey levels.
    seeds : (N, 2) array
        Approximate corners (x, y) [px], NaN to skip; must lie within `radius_px` of the corner and hold no other one.
    radius_px : int
        Radius of the window, below half a square.
    sigma_px : float
        Scale of the derivatives.
    n_iterations : int
        Most re-centrings.

    Returns
    -------
    (N, 2) array
        Corners [px], NaN where the window left the image, the centroid ran further than `radius_px` from its seed, or
        no saddle stands out of the noise there.
    """
    require_whole("radius_px", radius_px, 1, LARGEST_WINDOW_PX)
    d = derivatives(image, sigma_px)
    response = np.abs(kitchen_rosenfeld(d))
    refined = np.full_like(_require_seeds(seeds), np.nan)
    offsets = np.arange(-radius_px, radius_px + 1, dtype=np.float64)
    for i, seed in enumerate(seeds):
        corner = np.array(seed, dtype=np.float64)
        for _ in range(n_iterations):
            window = _patch(corner, radius_px, response.shape) if np.isfinite(corner).all() else None
            if window is None:
                corner = _LOST
                break
            x, y = offsets + (window[1].start + radius_px), offsets + (window[0].start + radius_px)
            # A window that fades out smoothly: a hard one would tie the centroid to the pixel grid.
            distance2 = ((x - corner[0]) ** 2)[None, :] + ((y - corner[1]) ** 2)[:, None]
            weight = response[window] * np.clip(1 - distance2 / radius_px**2, 0, None) ** 2
            total = float(weight.sum())
            moved = np.array([weight.sum(0) @ x, weight.sum(1) @ y]) / total if total > 0 else _LOST
            at_rest = float(np.abs(moved - corner).max()) < 1e-4
            corner = moved
            if at_rest:
                break
        if np.isfinite(corner).all() and np.hypot(*(corner - seed)) <= radius_px:
            refined[i] = corner
    _lose_weak(refined, _saddle_strength(image, d, sigma_px))
    return refined


def refine_saddle(
    image: Array, seeds: Floats, *, search_px: float = 4.0, sigma_px: float = 2.0, n_iterations: int = 20
) -> Floats:
    """Refine corners to the saddle point of the smoothed image by Newton's method on its gradient.

    Parameters
    ----------
    image : (height, width[, 3]) array
        Grey levels.
    seeds : (N, 2) array
        Approximate corners (x, y) [px], NaN to skip.
    search_px : float
        The strongest saddle (most negative Hessian determinant) within this distance of the seed starts the iteration.
    sigma_px : float
        Scale of the derivatives.
    n_iterations : int
        Most Newton steps.

    Returns
    -------
    (N, 2) array
        Corners [px], NaN where no saddle within `search_px` + `sigma_px` of the seed stands out of the noise.
    """
    require_positive("search_px", search_px, LARGEST_WINDOW_PX, "px")
    d = derivatives(image, sigma_px)
    strength = _saddle_strength(image, d, sigma_px)
    start = _strongest(strength, _require_seeds(seeds), search_px)
    splines = [ndimage.spline_filter(channel, order=3, mode="nearest") for channel in d]
    corners = start.copy()
    for _ in range(n_iterations):
        at = corners[:, ::-1].T
        gx, gy, hxx, hxy, hyy = (
            ndimage.map_coordinates(spline, at, order=3, mode="nearest", prefilter=False) for spline in splines
        )
        determinant = hxx * hyy - hxy**2
        determinant[determinant >= 0] = np.nan
        step = np.stack([hyy * gx - hxy * gy, hxx * gy - hxy * gx], axis=-1) / determinant[:, None]
        corners = corners - np.clip(step, -1.0, 1.0)  # a longer step has left the region where the model holds
        if not np.nanmax(np.abs(step), initial=0.0) > 1e-6:
            break
    strayed = ~(np.hypot(*(corners - seeds).T) <= search_px + sigma_px)
    corners[strayed] = np.nan
    _lose_weak(corners, strength)
    return corners


def _strongest(strength: Floats, seeds: Floats, search_px: float) -> Floats:
    """Return the pixel of greatest `strength` within `search_px` of each seed, NaN outside the image."""
    radius = int(np.ceil(search_px))
    found = np.full_like(seeds, np.nan)
    offset = np.arange(-radius, radius + 1)
    for i, seed in enumerate(seeds):
        window = _patch(seed, radius, strength.shape) if np.isfinite(seed).all() else None
        if window is None:
            continue
        near = np.hypot(offset[None, :], offset[:, None]) <= search_px
        y, x = np.unravel_index(int(np.argmax(np.where(near, strength[window], -np.inf))), near.shape)
        found[i] = x + window[1].start, y + window[0].start
    return found


def find_board(image: Array, shape: tuple[int, int]) -> Floats:
    """Find a printed checkerboard's inner corners and refine them to saddle points.

    Parameters
    ----------
    image : (height, width[, 3]) array
        The board under even light.
    shape : (nx, ny)
        Inner corners along the board's X and Y.

    Returns
    -------
    (ny, nx, 2) array
        Corners [px]; along a row X grows to the right of the picture, row 0 is the uppermost.

    Raises
    ------
    InputError
        If the shape is not that of a board, or the image too small to hold one.
    StepError
        If the board is not found, or a corner is lost.
    """
    sound = isinstance(shape, Sequence) and len(shape) == 2 and all(is_whole(n, 3, 1000) for n in shape)
    require(sound, "shape", "be (nx, ny) of at least 3 inner corners, at most 1000", shape)
    grey = grey_levels(image).astype(np.float64)
    least = _SMALLEST_IMAGE_PX
    require(min(grey.shape) >= least, "image", f"be at least {least} x {least} pixels to show a board", grey.shape)
    scaled = np.clip(255 * grey / max(float(np.percentile(grey, 99.5)), 1e-9), 0, 255).astype(np.uint8)
    flags = cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY | cv2.CALIB_CB_NORMALIZE_IMAGE
    found, corners = cv2.findChessboardCornersSB(scaled, shape, flags=flags)
    if not found:
        raise StepError(
            f"corner detection: no board of {shape[0]} x {shape[1]} inner corners in the white image; check that the "
            "whole board is in view, evenly lit and sharp, and that the board's shape counts inner corners."
        )
    grid = _upright(np.asarray(corners, dtype=np.float64).reshape(shape[1], shape[0], 2))
    refined = refine_saddle(image, grid.reshape(-1, 2), search_px=2.0)
    if not np.isfinite(refined).all():
        lost = int((~np.isfinite(refined)).any(axis=1).sum())
        raise StepError(f"corner detection: {lost} of {len(refined)} board corners have no saddle; sharpen the image.")
    return refined.reshape(grid.shape)


def _upright(grid: Floats) -> Floats:
    """Turn a detected grid so that X points right and rows go down: detectors return boards by a half turn at will."""
    along, down = grid[:, -1] - grid[:, 0], grid[-1] - grid[0]
    along, down = along.mean(axis=0), down.mean(axis=0)
    if along[0] * down[1] - along[1] * down[0] < 0:
        grid, along = grid[:, ::-1], -along
    return grid if along[0] + down[1] >= 0 else grid[::-1, ::-1]

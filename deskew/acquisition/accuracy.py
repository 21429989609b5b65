"""Accuracy from a plane: best fit and deviation (section 2.5), with held-out lengths beside it.

The plane's figure is blind to scale: a baseline that is 1 % off leaves it unchanged. Known lengths are not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import numpy.typing as npt

from deskew.errors import StepError, require
from deskew.projection import centre, pixel_grid, rays
from deskew.types import DepthMap, Floats, Reason

DISCARDED_SHARE = 0.003
"""Share of the points that VDI/VDE 2634-2 lets a test discard: 3 per mille."""


@dataclass(frozen=True, slots=True)
class PlaneDeviation:
    """Distance of points from their best-fit plane.

    Attributes
    ----------
    mean_abs_mm, rms_mm, max_mm : float
        Mean absolute, root mean square and largest distance [mm]; the paper's figure is the first.
    n : int
        Points.
    """

    mean_abs_mm: float
    rms_mm: float
    max_mm: float
    n: int


def depth_points(depth: DepthMap, mask: npt.NDArray[np.bool_] | None = None) -> Floats:
    """World points of a depth map's pixels in raster order.

    Parameters
    ----------
    depth : DepthMap
        Depth on the undistorted grid.
    mask : (height, width) bool array, optional
        Pixels wanted; those without a depth are left out.

    Returns
    -------
    (N, 3) array
        World points [mm].

    Raises
    ------
    InputError
        The mask has another shape or is empty.
    StepError
        No wanted pixel has a depth.
    """
    wanted = np.asarray(depth.reason == Reason.OK)
    if mask is not None:
        require(mask.shape == depth.z.shape, "mask", f"have the depth map's shape {depth.z.shape}", mask.shape)
        require(bool(mask.any()), "mask", "select at least 1 pixel", "an empty mask")
        wanted = wanted & mask.astype(bool)
    if not wanted.any():
        raise StepError("depth_points found no wanted pixel with a depth: see the depth map's `reason` for the cause.")
    directions = rays(depth.camera, pixel_grid(depth.camera.size)[wanted])
    return np.asarray(centre(depth.camera) + depth.z[wanted][:, None] * directions)


def fit_plane(points: Floats) -> tuple[Floats, float]:
    """Total least-squares plane ``normal . x = offset`` (section 2.5).

    Parameters
    ----------
    points : (N, 3) array
        At least 3 finite points that are not on one line [mm].

    Returns
    -------
    normal : (3,) array
        Unit normal, its largest component positive.
    offset : float
        Distance of the plane from the origin along the normal [mm].
    """
    shape = points.shape
    require(points.ndim == 2 and shape[1] == 3 and shape[0] >= 3, "points", "have shape (N, 3) with N >= 3", shape)
    missing = int((~np.isfinite(points)).any(axis=1).sum())
    require(missing == 0, "points", "be finite", f"{missing} points with NaN or infinity")
    middle = points.mean(axis=0)
    spread, axes = np.linalg.eigh(np.cov((points - middle).T, bias=True))
    require(bool(spread[1] > 1e-12 * max(spread[2], 1e-300)), "points", "span a plane", "points on one line")
    normal = axes[:, 0]
    normal = normal * np.sign(normal[np.argmax(np.abs(normal))])
    return normal, float(normal @ middle)


def plane_deviation(points: Floats) -> PlaneDeviation:
    """Distances of (N, 3) points [mm] from their own best-fit plane (section 2.5)."""
    normal, offset = fit_plane(points)
    distance = np.abs(points @ normal - offset)
    return PlaneDeviation(
        float(distance.mean()), float(np.sqrt((distance**2).mean())), float(distance.max()), len(points)
    )


def retained(residuals: Floats, share: float = DISCARDED_SHARE) -> npt.NDArray[np.bool_]:
    """Mark all but the `share` of residuals (N,) that are largest in size: (N,), the rule of VDI/VDE 2634-2."""
    require(0 <= share < 1, "share", "be in [0, 1)", share)
    n_out = int(share * len(residuals))
    keep = np.ones(len(residuals), np.bool_)
    keep[np.argsort(np.abs(residuals), kind="stable")[len(residuals) - n_out :]] = False
    return keep


def flatness_mm(points: Floats, share: float = DISCARDED_SHARE) -> float:
    """Range of the signed distances from the best-fit plane: the flatness measurement error.

    After VDI/VDE 2634-2: least-squares plane, range of what is left after discarding 0.3 % of the points. The guideline
    leaves open which: here those farthest from a first fit, after which the plane is fitted anew. Its ceramic or metal
    body measured in six positions is here a perfect plane, so none of the figure is the body's own.

    Parameters
    ----------
    points : (N, 3) array
        As in :func:`fit_plane` [mm].
    share : float
        Of the points discarded, in [0, 1).
    """
    normal, offset = fit_plane(points)
    kept = points[retained(points @ normal - offset, share)]
    return float(np.ptp(kept @ fit_plane(kept)[0]))


def average_deviation(planes: Sequence[PlaneDeviation]) -> PlaneDeviation:
    """Average over several planes, each counting once, as section 2.5 does; `max_mm` is the largest of all."""
    require(len(planes) > 0, "planes", "hold at least 1 deviation", "none")
    return PlaneDeviation(
        float(np.mean([plane.mean_abs_mm for plane in planes])),
        float(np.mean([plane.rms_mm for plane in planes])),
        max(plane.max_mm for plane in planes),
        sum(plane.n for plane in planes),
    )


def length_errors(measured: Floats, known: Floats, min_length: float = 0.0) -> Floats:
    """Measured - known distance of every pair of points whose known distance is at least `min_length`.

    Parameters
    ----------
    measured, known : (N, 3) or (N, 2) arrays
        The same N >= 2 points as scanned and as they are, each in any frame, in one unit. Points with NaN are left out.
    min_length : float
        Shortest length that counts, in the same unit.

    Returns
    -------
    (P,) array
        Errors, P >= 1.
    """
    require(measured.ndim == 2 and len(measured) == len(known), "measured", f"hold {len(known)} points", measured.shape)
    found = np.isfinite(measured).all(axis=1) & np.isfinite(known).all(axis=1)
    pairs = np.array(list(combinations(np.flatnonzero(found), 2)), dtype=np.intp).reshape(-1, 2)
    first, second = pairs.T
    lengths = np.linalg.norm(known[first] - known[second], axis=1)
    errors = np.linalg.norm(measured[first] - measured[second], axis=1) - lengths
    chosen = errors[lengths >= min_length]
    if len(chosen) == 0:
        raise StepError(
            f"length_errors found no pair of known points at least {min_length} apart among {int(found.sum())} found "
            "points: lower `min_length` or add points."
        )
    return np.asarray(chosen)

"""The depth map: culled, triangulated, gated, and resampled to the undistorted grid, with a reason for every hole.

Epipolar culling leaves the errors along the epipolar line, so a working volume and a comparison with the neighbours
follow it (section 2.3).
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
import numpy.typing as npt

from deskew.acquisition.epipolar import TOLERANCE_PX, line_distance
from deskew.acquisition.matches import Matches, match
from deskew.acquisition.triangulation import solve_depth
from deskew.errors import StepError, require
from deskew.projection import distort, ideal, pixel_grid
from deskew.types import Array, Calibration, Correspondence, DepthMap, Floats, Pinhole, Reason

_RADIUS = 2  # the neighbours of a pixel: 5 x 5
_FEWEST = 3  # neighbours in support of an isolated pixel
_ROUND_OFF = 1e-6  # a bilinear weight below it is an exact hit on the other pixels


@dataclass(frozen=True, slots=True)
class DepthSettings:
    """What is believed of a triangulated pixel.

    Attributes
    ----------
    epipolar_tolerance_px : float
        Largest distance from the epipolar line [undistorted projector px], > 0.
    z_min_mm, z_max_mm : float
        Working volume: heights above the bed, in the calibration's unit.
    neighbour_mm : float
        A neighbour within this depth supports a pixel, > 0.
    support : float
        Share of the decoded neighbours in a 5 x 5 window that must support a pixel, in [0, 1). A third is what the
        corner of a page has that rises over the desk; a median would ask for half and cut such corners off.
    jump_mm : float
        Raw pixels that differ by more are not interpolated between, > 0.
    """

    epipolar_tolerance_px: float = TOLERANCE_PX
    z_min_mm: float = -10.0
    z_max_mm: float = 150.0
    neighbour_mm: float = 1.0
    support: float = 0.3
    jump_mm: float = 3.0

    def __post_init__(self) -> None:
        for name in ("epipolar_tolerance_px", "neighbour_mm", "jump_mm"):
            require(getattr(self, name) > 0, name, "be positive", getattr(self, name))
        require(0 <= self.support < 1, "support", "be in [0, 1)", self.support)
        require(self.z_min_mm < self.z_max_mm, "z_min_mm", f"be below z_max_mm = {self.z_max_mm}", self.z_min_mm)


@numba.njit(cache=True)
def _supported(z: Floats, tolerance: float, share: float) -> npt.NDArray[np.bool_]:
    """Whether enough of a pixel's decoded neighbours lie at its depth, (height, width); False at NaN."""
    height, width = z.shape
    out = np.zeros((height, width), np.bool_)
    for y in range(height):
        y0, y1 = max(0, y - _RADIUS), min(height, y + _RADIUS + 1)
        for x in range(width):
            here = z[y, x]
            if np.isnan(here):
                continue
            known, close = -1, -1  # the pixel itself does not count
            for window in z[y0:y1, max(0, x - _RADIUS) : min(width, x + _RADIUS + 1)]:
                for value in window:
                    known += not np.isnan(value)
                    close += abs(value - here) <= tolerance
            out[y, x] = close >= max(_FEWEST, share * known)
    return out


@numba.njit(cache=True)
def _interpolate(corners: Floats, why: Array, fx: float, fy: float, jump: float, edge: int) -> tuple[float, int]:
    """Interpolate depth inside a cell of four raw pixels, (4,) in the order 00, 10, 01, 11; return it with its reason.

    1/z is interpolated, in which a plane is linear. If one pixel is missing, the triangle of the other three still
    serves the places inside it. A missing result has the reason of the missing pixel that weighs most.
    """
    total, used, missing, heaviest = 0.0, 0.0, 0, -1
    low, high, weight_lost = np.inf, -np.inf, 0.0
    for k in range(4):
        weight = (fx if k & 1 else 1.0 - fx) * (fy if k >> 1 else 1.0 - fy)
        if abs(weight) < _ROUND_OFF:
            continue
        if why[k] != 0:
            missing += 1
            if abs(weight) > weight_lost:
                weight_lost, heaviest = abs(weight), k
            continue
        total, used = total + weight / corners[k], used + weight
        low, high = min(low, corners[k]), max(high, corners[k])
    if missing > 0:
        across = abs(fx - (1 - (heaviest & 1))) + abs(fy - (1 - (heaviest >> 1)))  # from the pixel opposite
        if missing > 1 or why[3 - heaviest] + why[heaviest ^ 1] + why[heaviest ^ 2] != 0 or across > 1.0:
            return np.nan, int(why[heaviest])
        plane = 1.0 / corners[heaviest ^ 1] + 1.0 / corners[heaviest ^ 2] - 1.0 / corners[3 - heaviest]
        total, used = total + weight_lost * plane, used + weight_lost
    if high - low > jump:
        return np.nan, edge
    return used / total, 0


@numba.njit(cache=True)
def _resample(z: Floats, reason: Array, at: Floats, jump: float, edge: int, out: Floats, out_reason: Array) -> None:
    """Interpolate depth at raw pixels `at` (..., 2), without crossing a jump, into `out` and `out_reason`."""
    height, width = z.shape
    rows, columns = out.shape
    corners, why = np.empty(4), np.empty(4, np.uint8)
    for i in range(rows):
        for j in range(columns):
            x, y = at[i, j, 0], at[i, j, 1]
            if not (-0.5 <= x <= width - 0.5 and -0.5 <= y <= height - 0.5):
                out[i, j], out_reason[i, j] = np.nan, edge  # the raw image ends before the grid does
                continue
            # Within half a pixel of the border the last cell is extended rather than the outer pixels lost.
            x0 = min(max(int(np.floor(x)), 0), width - 2)
            y0 = min(max(int(np.floor(y)), 0), height - 2)
            for k in range(4):
                corners[k], why[k] = z[y0 + (k >> 1), x0 + (k & 1)], reason[y0 + (k >> 1), x0 + (k & 1)]
            out[i, j], out_reason[i, j] = _interpolate(corners, why, x - x0, y - y0, jump, edge)


def _gated_depth(
    calibration: Calibration, matches: Matches, reason: npt.NDArray[np.uint8], settings: DepthSettings
) -> tuple[Floats, npt.NDArray[np.uint8]]:
    """Depth at the raw pixels and the reasons after culling, working volume and neighbours, (height, width) both."""
    camera = calibration.camera
    depth = solve_depth(matches)
    off = ~(np.abs(line_distance(matches)) <= settings.epipolar_tolerance_px)
    rays = np.concatenate([matches.camera, np.ones((len(depth), 1))], axis=1)
    world_z = (rays @ camera.R[:, 2]) * depth - camera.R[:, 2] @ camera.t
    outside = ~((world_z >= settings.z_min_mm) & (world_z <= settings.z_max_mm))
    verdict = np.where(off, np.uint8(Reason.EPIPOLAR), np.where(outside, np.uint8(Reason.RANGE), np.uint8(Reason.OK)))
    out_reason = reason.copy()
    out_reason[matches.mask] = verdict
    z = np.full(reason.shape, np.nan)
    z[matches.mask] = np.where(verdict == Reason.OK, depth, np.nan)
    lonely = (out_reason == Reason.OK) & ~_supported(z, settings.neighbour_mm, settings.support)
    z[lonely] = np.nan
    out_reason[lonely] = Reason.EDGE
    return z, out_reason


def _to_undistorted(
    camera: Pinhole, z: Floats, reason: npt.NDArray[np.uint8], jump_mm: float
) -> tuple[Floats, npt.NDArray[np.uint8]]:
    """Resample raw depth to the grid of the ideal camera; camera z is the same along a ray, so only places move."""
    width, height = camera.size
    require(min(camera.size) >= 2, "camera", "be at least 2 x 2 pixels", camera.size)
    normalised = (pixel_grid((width, height)) - camera.K[:2, 2]) / np.array([camera.K[0, 0], camera.K[1, 1]])
    normalised[..., 0] -= camera.K[0, 1] / camera.K[0, 0] * normalised[..., 1]  # skew, as in K
    out = np.full((height, width), np.nan)
    out_reason = np.zeros((height, width), np.uint8)
    _resample(z, reason, distort(camera, normalised), jump_mm, int(Reason.EDGE), out, out_reason)
    return out, out_reason


def depth_map(
    calibration: Calibration, correspondence: Correspondence, settings: DepthSettings | None = None
) -> DepthMap:
    """Cull, triangulate, gate and resample.

    Parameters
    ----------
    calibration : Calibration
        Both devices.
    correspondence : Correspondence
        Decoded points at the raw camera pixels.
    settings : DepthSettings, optional
        The gates.

    Returns
    -------
    DepthMap
        Camera z on the grid of ``projection.ideal(calibration.camera)``. A missing pixel carries the reason of the raw
        pixel that weighs most among the missing ones it needs; EDGE where it would bridge a depth jump, or where the
        raw image ends.

    Raises
    ------
    InputError
        The correspondence is not of the calibrated camera's size.
    StepError
        No pixel is left.
    """
    settings = settings or DepthSettings()
    matches = match(calibration, correspondence)
    raw, reason = _gated_depth(calibration, matches, correspondence.reason, settings)
    z, out_reason = _to_undistorted(calibration.camera, raw, reason, settings.jump_mm)
    if not np.isfinite(z).any():
        counts = {Reason(v).name: int(n) for v, n in zip(*np.unique(reason, return_counts=True), strict=True)}
        raise StepError(
            f"depth_map has no pixel left ({counts}): check that the calibration belongs to this capture and that the "
            f"page lies between {settings.z_min_mm} and {settings.z_max_mm} {calibration.unit} above the bed."
        )
    return DepthMap(z, out_reason, ideal(calibration.camera))

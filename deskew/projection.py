"""The pinhole camera with Brown's distortion: world to pixel and back (sections 2.2 and 3.5).

Below the stages, since acquisition and restoration both look through the camera. The rig has its own projection.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numba import njit

from deskew.types import Floats, Pinhole

# Of Brown's fixed point, which reaches machine precision long before for any lens that is worth calibrating.
_MAX_ITERATIONS = 40
_PRECISION = 1e-15


def _lens(device: Pinhole) -> Floats:
    """Return fx, fy, cx, cy, k1, k2, p1, p2, k3; skew is left out, as OpenCV does."""
    K = device.K
    return np.concatenate([[K[0, 0], K[1, 1], K[0, 2], K[1, 2]], device.distortion])


@njit(cache=True)
def _projected(points: Floats, R: Floats, t: Floats, lens: Floats) -> Floats:
    """Raw pixels (N, 2) of world points (N, 3); on the device's plane z = 0 they are as on z = 1, not infinite."""
    fx, fy, cx, cy, k1, k2, p1, p2, k3 = lens
    pixels = np.empty((len(points), 2))
    for i in range(len(points)):
        X, Y, Z = points[i, 0], points[i, 1], points[i, 2]
        z = R[2, 0] * X + R[2, 1] * Y + R[2, 2] * Z + t[2]
        scale = 1.0 / z if z != 0.0 else 1.0
        x = (R[0, 0] * X + R[0, 1] * Y + R[0, 2] * Z + t[0]) * scale
        y = (R[1, 0] * X + R[1, 1] * Y + R[1, 2] * Z + t[1]) * scale
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        pixels[i, 0] = fx * (x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)) + cx
        pixels[i, 1] = fy * (y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y) + cy
    return pixels


@njit(cache=True)
def _undistorted(pixels: Floats, lens: Floats) -> Floats:
    """Normalised coordinates (N, 2) of raw pixels (N, 2); those that no lens could show keep their distorted place."""
    fx, fy, cx, cy, k1, k2, p1, p2, k3 = lens
    normalised = np.empty((len(pixels), 2))
    for i in range(len(pixels)):
        x0, y0 = (pixels[i, 0] - cx) / fx, (pixels[i, 1] - cy) / fy
        x, y = x0, y0
        for _ in range(_MAX_ITERATIONS):
            r2 = x * x + y * y
            radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
            if radial <= 0.0:
                x, y = x0, y0
                break
            next_x = (x0 - 2.0 * p1 * x * y - p2 * (r2 + 2.0 * x * x)) / radial
            next_y = (y0 - p1 * (r2 + 2.0 * y * y) - 2.0 * p2 * x * y) / radial
            step = abs(next_x - x) + abs(next_y - y)
            x, y = next_x, next_y
            # `not >`: a NaN stays what it is and ends here too.
            if not step > _PRECISION:
                break
        normalised[i, 0], normalised[i, 1] = x, y
    return normalised


def ideal(device: Pinhole) -> Pinhole:
    """Return the same device without lens distortion: the undistorted grid's camera."""
    return replace(device, distortion=np.zeros(5))


def project(device: Pinhole, points: Floats) -> Floats:
    """Project world points into the device's raw pixels, ``[us vs s] = P [X Y Z 1]`` (section 3.5) with distortion.

    Parameters
    ----------
    device : Pinhole
        Camera or projector.
    points : (..., 3) array
        World points [mm].

    Returns
    -------
    (..., 2) array
        Pixels (x, y).
    """
    flat = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 3)
    pixels: Floats = _projected(flat, np.ascontiguousarray(device.R), device.t, _lens(device))
    return pixels.reshape(*points.shape[:-1], 2)


def undistort(device: Pinhole, pixels: Floats) -> Floats:
    """Raw pixels to normalised image coordinates ``(x/z, y/z)`` on the device's plane z = 1; NaN stays NaN.

    Parameters
    ----------
    device : Pinhole
        Camera or projector.
    pixels : (..., 2) array
        Raw pixels.

    Returns
    -------
    (..., 2) array
        Dimensionless.
    """
    flat = np.ascontiguousarray(pixels, dtype=np.float64).reshape(-1, 2)
    normalised: Floats = _undistorted(flat, _lens(device))
    return normalised.reshape(pixels.shape)


def distort(device: Pinhole, normalised: Floats) -> Floats:
    """Normalised image coordinates on z = 1 to raw pixels: the inverse of :func:`undistort`."""
    rays = np.concatenate([normalised, np.ones((*normalised.shape[:-1], 1))], axis=-1)
    return project(replace(device, R=np.eye(3), t=np.zeros(3)), rays)


def centre(device: Pinhole) -> Floats:
    """Return the device's optical centre in the world, (3,) [mm]."""
    return np.asarray(-device.R.T @ device.t)


def rays(device: Pinhole, pixels: Floats) -> Floats:
    """Directions in the world of raw pixels, scaled to unit z in the device's frame.

    A surface point at device depth z is ``centre + z * ray``.

    Parameters
    ----------
    device : Pinhole
        Camera or projector.
    pixels : (..., 2) array
        Raw pixels.

    Returns
    -------
    (..., 3) array
        Directions, dimensionless.
    """
    normalised = undistort(device, pixels)
    local = np.concatenate([normalised, np.ones((*normalised.shape[:-1], 1))], axis=-1)
    return np.asarray(local @ device.R)


def onto_bed(device: Pinhole, pixels: Floats) -> Floats:
    """Back-project raw pixels onto the bed Z = 0, as section 4.1 does to measure in millimetres.

    Returns
    -------
    (..., 2) array
        World X, Y [mm].
    """
    origin, directions = centre(device), rays(device, pixels)
    return np.asarray(origin[:2] - directions[..., :2] * (origin[2] / directions[..., 2:]))


def pixel_grid(size: tuple[int, int]) -> Floats:
    """Return the (height, width, 2) array of pixel centres (x, y)."""
    width, height = size
    return np.stack(np.meshgrid(np.arange(width, dtype=np.float64), np.arange(height, dtype=np.float64)), axis=-1)

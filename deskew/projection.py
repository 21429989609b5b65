"""The pinhole camera with Brown's distortion: world to pixel and back (sections 2.2 and 3.5).

Below the stages, since acquisition and restoration both look through the camera. The rig has its own projection.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np

from deskew.types import Floats, Pinhole


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
    flat = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 1, 3)
    pixels, _ = cv2.projectPoints(flat, cv2.Rodrigues(device.R)[0], device.t, device.K, device.distortion)
    return np.asarray(pixels, dtype=np.float64).reshape(*points.shape[:-1], 2)


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
    flat = np.ascontiguousarray(pixels, dtype=np.float64).reshape(-1, 1, 2)
    # 40 iterations bring Brown's fixed point to machine precision for any lens that is worth calibrating.
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-14)
    normalised = cv2.undistortPoints(flat, device.K, device.distortion, criteria=criteria)
    return np.asarray(normalised, dtype=np.float64).reshape(pixels.shape)


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

"""The rig's own pinhole: world to raw pixel and back, compiled, sharing nothing with the reconstruction's.

A device is packed into one array of 21 numbers so that the kernels can take it:
fx, fy, cx, cy, k1, k2, p1, p2, k3, then R row by row, then t.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from deskew.errors import require
from deskew.types import Floats, Pinhole


def packed(device: Pinhole) -> Floats:
    """Return the device as the (21,) array that the kernels take."""
    require(float(device.K[0, 1]) == 0.0, "K", "have no skew", float(device.K[0, 1]))
    K = device.K
    return np.concatenate(
        [[K[0, 0], K[1, 1], K[0, 2], K[1, 2]], device.distortion, device.R.ravel(), device.t.ravel()]
    ).astype(np.float64)


@njit(cache=True)
def to_raw(device: Floats, x: float, y: float) -> tuple[float, float]:
    """Normalised coordinates (x, y) on z = 1 to the raw pixel: Brown's model, radial k1 k2 k3, tangential p1 p2."""
    r2 = x * x + y * y
    radial = 1.0 + r2 * (device[4] + r2 * (device[5] + r2 * device[8]))
    xd = x * radial + 2.0 * device[6] * x * y + device[7] * (r2 + 2.0 * x * x)
    yd = y * radial + device[6] * (r2 + 2.0 * y * y) + 2.0 * device[7] * x * y
    return device[0] * xd + device[2], device[1] * yd + device[3]


@njit(cache=True)
def from_raw(device: Floats, px: float, py: float) -> tuple[float, float]:
    """Raw pixel to normalised coordinates, by the fixed point of :func:`to_raw`."""
    tx, ty = (px - device[2]) / device[0], (py - device[3]) / device[1]
    x, y = tx, ty
    # The distortion is a mild contraction, so the plain fixed point gains a factor of ten a step.
    for _ in range(30):
        qx, qy = to_raw(device, x, y)
        dx, dy = (px - qx) / device[0], (py - qy) / device[1]
        x += dx
        y += dy
        if abs(dx) + abs(dy) < 1e-13:
            break
    return x, y


@njit(cache=True)
def see(device: Floats, X: float, Y: float, Z: float) -> tuple[float, float, float]:
    """World point [mm] to raw pixel (x, y) and the depth z in the device's frame [mm]."""
    x = device[9] * X + device[10] * Y + device[11] * Z + device[18]
    y = device[12] * X + device[13] * Y + device[14] * Z + device[19]
    z = device[15] * X + device[16] * Y + device[17] * Z + device[20]
    px, py = to_raw(device, x / z, y / z)
    return px, py, z


@njit(cache=True)
def see_all(device: Floats, points: Floats) -> Floats:
    """Apply :func:`see` to world points (h, w, 3) [mm]: (h, w, 3) of raw x, y [px] and depth [mm]."""
    seen = np.empty(points.shape)
    for r in range(points.shape[0]):
        for c in range(points.shape[1]):
            seen[r, c, 0], seen[r, c, 1], seen[r, c, 2] = see(device, points[r, c, 0], points[r, c, 1], points[r, c, 2])
    return seen


@njit(cache=True)
def on_bed(device: Floats, px: float, py: float) -> tuple[float, float, float]:
    """Raw pixel to the world point (X, Y) where its ray meets Z = 0 [mm], and that point's depth [mm]."""
    x, y = from_raw(device, px, py)
    # The ray in the world is R^T (x, y, 1); the centre is -R^T t.
    dz = device[11] * x + device[14] * y + device[17]
    cz = -(device[11] * device[18] + device[14] * device[19] + device[17] * device[20])
    depth = -cz / dz
    qx, qy, qz = depth * x - device[18], depth * y - device[19], depth - device[20]
    X = device[9] * qx + device[12] * qy + device[15] * qz
    Y = device[10] * qx + device[13] * qy + device[16] * qz
    return X, Y, depth

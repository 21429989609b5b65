"""Light taken out of pictures of a page: by its known shape under a known projector, or by the picture alone.

The paper leaves intensities as they are (section 3.5), so folds stay visible in the restored image. Where the shape is
known, so is the light that each facet gets from a calibrated projector. Neither function knows what is printed.
"""

from __future__ import annotations

import cv2
import numpy as np
from scipy.ndimage import distance_transform_edt

from deskew import projection
from deskew.errors import require, require_positive
from deskew.restoration.sampling import read_at
from deskew.types import Array, DepthMap, Floats, Pinhole

UNSHADED = "unshaded"
"""Name of the image that :func:`remove_shading` makes of a capture."""

# Facets that turn away from the projector are noise once divided by so little light.
_LEAST_LIGHT = 0.05
# Beside the page a local white is no paper's: nothing is divided by less than this share of the picture's white.
_LEAST_WHITE = 0.35


def projector_light(projector: Pinhole, points: Floats, normals: Floats) -> Floats:
    """Light that surface elements get from a fully lit projector, over what a level one gets at the world's origin.

    Parameters
    ----------
    projector : Pinhole
        As calibrated.
    points, normals : (..., 3) arrays
        Places in the world [mm] and unit normals.

    Returns
    -------
    (...) array
        Not negative; 0 where the element turns away. Shadows that other parts cast are not known here.

    Notes
    -----
    ``E = cos(a) / (cos^3(theta) r^2)`` with the angle of incidence a, the angle theta to the optical axis and the
    distance r. A projector lights a plane across its axis evenly, which a lamp of even intensity would light by
    ``cos^3(theta)``.
    """
    up, origin = np.array([0.0, 0.0, 1.0]), np.zeros(3)
    return np.maximum(_irradiance(projector, points, normals) / _irradiance(projector, origin, up), 0.0)


def _irradiance(projector: Pinhole, points: Floats, normals: Floats) -> Floats:
    """Up to the projector's power [1/mm^2]: the distance along the axis is r cos(theta)."""
    to_light = projection.centre(projector) - points
    along_axis = -to_light @ projector.R[2]
    return np.asarray((to_light * normals).sum(axis=-1) / along_axis**3)


def surface_points(depth: DepthMap) -> Floats:
    """Return the world points (H, W, 3) [mm] of a depth map; holes take the depth of the nearest pixel."""
    known = np.isfinite(depth.z)
    require(bool(known.any()), "depth", "have a pixel with a depth", "none")
    nearest = distance_transform_edt(~known, return_distances=False, return_indices=True)
    rays = projection.rays(depth.camera, projection.pixel_grid(depth.camera.size))
    return np.asarray(projection.centre(depth.camera) + depth.z[tuple(nearest)][..., None] * rays)


def surface_normals(points: Floats, sigma_px: float) -> Floats:
    """Return the unit normals (H, W, 3) of a surface seen on a pixel grid, towards the camera that sees it.

    Parameters
    ----------
    points : (H, W, 3) array
        World [mm]; rows run down the picture.
    sigma_px : float
        Standard deviation of the Gaussian whose derivative gives the slopes [px]: noise against sharp creases.
    """
    require_positive("sigma_px", sigma_px, 20.0, "px")
    smooth = cv2.GaussianBlur(points, (0, 0), sigma_px, borderType=cv2.BORDER_REPLICATE)
    down, across = np.gradient(smooth, axis=(0, 1))
    normals = np.cross(down, across)
    return np.asarray(normals / np.linalg.norm(normals, axis=-1, keepdims=True))


def remove_shading(
    white: Array, black: Array, camera: Pinhole, projector: Pinhole, points: Floats, sigma_px: float = 0.6
) -> Array:
    """Return the page as if it lay level at the world's origin everywhere, its reflectance alone.

    The black frame holds what the room and the projector's leak give, so the difference of the two is the projector's
    light alone, and its shading follows from the surface.

    Parameters
    ----------
    white, black : (height, width[, 3]) arrays
        Raw images under the fully lit and the dark projector, of one dtype.
    camera, projector : Pinhole
        As calibrated.
    points : (H, W, 3) array
        World point of each pixel of the UNDISTORTED grid [mm], as :func:`surface_points` gives them.
    sigma_px : float
        Smoothing of the normals, see :func:`surface_normals`. Little is right for a filtered depth map: normals that
        are smoother than the picture leave a dark and a bright line along every crease. A raw one needs 2 or more.

    Returns
    -------
    (height, width[, 3]) array
        A raw image of white's dtype, to be restored like any other. Cast shadows stay dark.
    """
    shape, grid = white.shape[:2], camera.size[::-1]
    require(shape == grid, "white", f"have the camera's shape {grid}", shape)
    require(black.shape == white.shape, "black", f"have white's shape {white.shape}", black.shape)
    require(points.shape == (*grid, 3), "points", f"have shape {(*grid, 3)}", points.shape)
    light = projector_light(projector, points, surface_normals(points, sigma_px))
    normalised = projection.undistort(camera, projection.pixel_grid(camera.size))
    seen = read_at(light, normalised @ camera.K[:2, :2].T + camera.K[:2, 2], 1.0)
    difference = np.maximum(white.astype(np.float64) - black, 0.0)
    flat = difference / np.maximum(seen, _LEAST_LIGHT).reshape(*grid, *([1] * (white.ndim - 2)))
    return _as(white, flat)


def divide_by_local_white(image: Array, capital_px: float) -> Array:
    """Divide a picture by the white of the paper around each pixel: what can be done without knowing the shape.

    Parameters
    ----------
    image : (height, width) array
        Grey, dark print on light paper.
    capital_px : float
        Height of a capital letter [px]: strokes are narrower than half of it and are closed, light that varies over
        more stays in the white.

    Returns
    -------
    (height, width) array
        Of the image's dtype, paper at nine tenths of the picture's white.
    """
    require(image.ndim == 2, "image", "be (height, width)", image.shape)
    require_positive("capital_px", capital_px, 1000.0, "px")
    side = 2 * round(capital_px / 4) + 1
    closed = cv2.morphologyEx(image, cv2.MORPH_CLOSE, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side)))
    local = cv2.GaussianBlur(closed.astype(np.float64), (0, 0), side / 4)
    white = float(np.percentile(image, 99.0))
    return _as(image, 0.9 * white * image / np.maximum(local, max(_LEAST_WHITE * white, 1.0)))


def _as(image: Array, values: Floats) -> Array:
    if image.dtype.kind not in "ui":
        return values.astype(image.dtype)
    limits = np.iinfo(image.dtype)
    return np.clip(np.rint(values), limits.min, limits.max).astype(image.dtype)

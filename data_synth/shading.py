"""The one geometry pass: what every camera sub-sample sees, how brightly, and which projector pixel lights it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from data_synth.devices import on_bed, packed, see, see_all
from data_synth.geometry import Ints, corner, rasterise, weights
from data_synth.pages import Page, coverage
from data_synth.rig import Rig
from data_synth.sheets import TrueSheet
from deskew.errors import require
from deskew.types import Floats, Size

SUBSAMPLES = 2
"""Sub-samples a pixel, each way; analytic anti-aliasing makes two enough."""

_SHADOW_SCALE = 2
_SHADOW_BIAS_MM = 0.1


@dataclass(frozen=True, slots=True)
class Samples:
    """Sub-samples of the raw image with a margin for the lens blur, all arrays (rows, columns) float32.

    Attributes
    ----------
    margin_px : int
        Camera pixels around the image.
    column, row : arrays
        Projector coordinates of the surface point [projector px].
    lit : array
        Radiance under full projector light, without the projector's frame [share of a white diffuser at the origin].
    sky : array
        Radiance under an even sky of the same strength.
    """

    margin_px: int
    column: Floats
    row: Floats
    lit: Floats
    sky: Floats


def sample_scene(rig: Rig, sheet: TrueSheet, page: Page, margin_px: int) -> Samples:
    """Look at a sheet on the bed.

    Parameters
    ----------
    rig : Rig
        Camera, projector and desk.
    sheet : TrueSheet
        The surface.
    page : Page
        What is printed on it; of the sheet's size.
    margin_px : int
        Camera pixels to sample beyond the image.

    Returns
    -------
    Samples
        Everything that any frame of this scene needs.
    """
    same = bool(np.allclose(page.page_size_mm, sheet.page_size_mm, atol=1e-6))
    require(same, "page", f"have the sheet's size {sheet.page_size_mm} mm", page.page_size_mm)
    camera, projector = packed(rig.camera), packed(rig.projector)
    width, height = (SUBSAMPLES * (n + 2 * margin_px) for n in rig.camera.size)
    # One more ring of cells, so that border pixels know the surface and their share of it is counted analytically.
    vertices, flat = _grown(sheet.vertices), _grown(sheet.flat)
    screen = see_all(camera, vertices)
    screen[..., :2] = (screen[..., :2] + 0.5 + margin_px) * SUBSAMPLES - 0.5
    ids = rasterise(screen, height, width)[1]
    u, v, du, dv = (plane.ravel() for plane in _page_coordinates(screen, flat, ids))
    share = np.zeros(ids.size, dtype=np.float32)
    on_page = np.flatnonzero(ids.ravel() >= 0)
    footprint = u[on_page], v[on_page], du[on_page], dv[on_page]
    share[on_page] = coverage(page.page_size_mm, *footprint)
    albedo = np.full(ids.size, rig.config.desk_albedo, dtype=np.float32)
    albedo[on_page] += share[on_page] * (page.albedo(*footprint) - albedo[on_page])
    # A sample with no share of the page is desk.
    ids.ravel()[share == 0] = -1
    shadows = _shadow_map(projector, sheet.vertices, rig.projector.size)
    column, row, light, sky = _illumination(camera, projector, screen, vertices, ids, shadows, margin_px)
    albedo = albedo.reshape(ids.shape)
    return Samples(margin_px, column, row, albedo * light, albedo * sky)


def _grown(grid: Floats) -> Floats:
    """Extend a grid (h, w, n) by one ring of vertices, straight on."""
    grid = np.concatenate([2 * grid[:1] - grid[1:2], grid, 2 * grid[-1:] - grid[-2:-1]])
    return np.concatenate([2 * grid[:, :1] - grid[:, 1:2], grid, 2 * grid[:, -1:] - grid[:, -2:-1]], axis=1)


def _shadow_map(projector: Floats, vertices: Floats, size: Size) -> Floats:
    """Inverse depth of what the projector lights first, at `_SHADOW_SCALE` samples a projector pixel."""
    screen = see_all(projector, vertices)
    screen[..., :2] = (screen[..., :2] + 0.5) * _SHADOW_SCALE - 0.5
    nearest: Floats = rasterise(screen, size[1] * _SHADOW_SCALE, size[0] * _SHADOW_SCALE)[0]
    return nearest


@njit(cache=True)
def _page_coordinates(screen: Floats, flat: Floats, ids: Ints) -> tuple[Floats, Floats, Floats, Floats]:
    """Page coordinates u, v of every sample and the sides du, dv of its footprint [mm]; 0 off the page."""
    height, width = ids.shape
    columns = screen.shape[1]
    u, v = np.zeros((height, width), dtype=np.float32), np.zeros((height, width), dtype=np.float32)
    du, dv = np.zeros((height, width), dtype=np.float32), np.zeros((height, width), dtype=np.float32)
    for y in range(height):
        for x in range(width):
            triangle = ids[y, x]
            if triangle < 0:
                continue
            w0, w1, w2, _ = weights(screen, triangle, x, y)
            r0, c0 = corner(triangle, 0, columns)
            r1, c1 = corner(triangle, 1, columns)
            r2, c2 = corner(triangle, 2, columns)
            u[y, x] = w0 * flat[r0, c0, 0] + w1 * flat[r1, c1, 0] + w2 * flat[r2, c2, 0]
            v[y, x] = w0 * flat[r0, c0, 1] + w1 * flat[r1, c1, 1] + w2 * flat[r2, c2, 1]
            ax, ay = screen[r1, c1, 0] - screen[r0, c0, 0], screen[r1, c1, 1] - screen[r0, c0, 1]
            bx, by = screen[r2, c2, 0] - screen[r0, c0, 0], screen[r2, c2, 1] - screen[r0, c0, 1]
            area = ax * by - bx * ay
            au, bu = flat[r1, c1, 0] - flat[r0, c0, 0], flat[r2, c2, 0] - flat[r0, c0, 0]
            av, bv = flat[r1, c1, 1] - flat[r0, c0, 1], flat[r2, c2, 1] - flat[r0, c0, 1]
            # The sample's unit square becomes a parallelogram on the page; a box of the same variance along u and
            # along v stands for it, exact while the page's axes follow the image's.
            du[y, x] = np.hypot((au * by - bu * ay) / area, (bu * ax - au * bx) / area)
            dv[y, x] = np.hypot((av * by - bv * ay) / area, (bv * ax - av * bx) / area)
    return u, v, du, dv


@njit(cache=True)
def _hit(
    camera: Floats, screen: Floats, vertices: Floats, triangle: int, x: int, y: int, margin_px: int
) -> tuple[float, float, float, float, float, float]:
    """World point and unit normal of a sample: on its triangle, or on the desk where that is -1."""
    if triangle < 0:
        X, Y, _ = on_bed(camera, (x + 0.5) / SUBSAMPLES - 0.5 - margin_px, (y + 0.5) / SUBSAMPLES - 0.5 - margin_px)
        return X, Y, 0.0, 0.0, 0.0, 1.0
    columns = screen.shape[1]
    w0, w1, w2, _ = weights(screen, triangle, x, y)
    r0, c0 = corner(triangle, 0, columns)
    r1, c1 = corner(triangle, 1, columns)
    r2, c2 = corner(triangle, 2, columns)
    p, q, s = vertices[r0, c0], vertices[r1, c1], vertices[r2, c2]
    ax, ay, az = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    bx, by, bz = s[0] - p[0], s[1] - p[1], s[2] - p[2]
    # v runs down, so (along u) x (along v) points away from the camera.
    nx, ny, nz = az * by - ay * bz, ax * bz - az * bx, ay * bx - ax * by
    norm = np.sqrt(nx * nx + ny * ny + nz * nz)
    X = w0 * p[0] + w1 * q[0] + w2 * s[0]
    Y = w0 * p[1] + w1 * q[1] + w2 * s[1]
    Z = w0 * p[2] + w1 * q[2] + w2 * s[2]
    return X, Y, Z, nx / norm, ny / norm, nz / norm


@njit(cache=True)
def irradiance(projector: Floats, X: float, Y: float, Z: float, nx: float, ny: float, nz: float) -> float:
    """Light of a fully lit projector on a surface element, ``cos(a) / (cos^3(theta) r^2)`` [1/mm^2].

    `a` is the angle of incidence, `theta` the angle between the ray and the optical axis: so a plane across the axis
    is lit evenly, as projectors are built to do. Negative on the far side of the surface.
    """
    depth = projector[15] * X + projector[16] * Y + projector[17] * Z + projector[20]
    # The projector's centre is -R^T t.
    cx = -(projector[9] * projector[18] + projector[12] * projector[19] + projector[15] * projector[20])
    cy = -(projector[10] * projector[18] + projector[13] * projector[19] + projector[16] * projector[20])
    cz = -(projector[11] * projector[18] + projector[14] * projector[19] + projector[17] * projector[20])
    lx, ly, lz = cx - X, cy - Y, cz - Z
    r = np.sqrt(lx * lx + ly * ly + lz * lz)
    cos_a, cos_theta = (lx * nx + ly * ny + lz * nz) / r, depth / r
    return float(cos_a / (cos_theta**3 * r * r))


@njit(cache=True)
def _shaded(shadows: Floats, px: float, py: float, depth: float) -> bool:
    """Tell whether something nearer to the projector stands in the ray of projector pixel (px, py)."""
    height, width = shadows.shape
    x, y = (px + 0.5) * _SHADOW_SCALE - 0.5, (py + 0.5) * _SHADOW_SCALE - 0.5
    if not (0 <= x < width - 1 and 0 <= y < height - 1):
        return False
    c, r = int(x), int(y)
    # The farthest of the four samples around the ray: a tilted plane then never shades itself, however steep.
    far = min(shadows[r, c], shadows[r, c + 1], shadows[r + 1, c], shadows[r + 1, c + 1])
    return bool(far > 1.0 / (depth - _SHADOW_BIAS_MM))


@njit(cache=True)
def _illumination(
    camera: Floats, projector: Floats, screen: Floats, vertices: Floats, ids: Ints, shadows: Floats, margin_px: int
) -> tuple[Floats, Floats, Floats, Floats]:
    """Projector column and row of each sample, and the light there from the projector and from the sky."""
    height, width = ids.shape
    column, row = np.empty((height, width), dtype=np.float32), np.empty((height, width), dtype=np.float32)
    light, sky = np.zeros((height, width), dtype=np.float32), np.empty((height, width), dtype=np.float32)
    reference = irradiance(projector, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    for y in range(height):
        for x in range(width):
            X, Y, Z, nx, ny, nz = _hit(camera, screen, vertices, ids[y, x], x, y, margin_px)
            px, py, depth = see(projector, X, Y, Z)
            column[y, x], row[y, x] = px, py
            # An even sky above an element tilted by b: (1 + cos b) / 2 of it is in sight.
            sky[y, x] = (1.0 + nz) / 2.0
            lit = irradiance(projector, X, Y, Z, nx, ny, nz)
            if lit > 0.0 and not _shaded(shadows, px, py, depth):
                light[y, x] = lit / reference
    return column, row, light, sky

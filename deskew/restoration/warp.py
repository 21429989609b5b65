"""The restored image: every quad textured from where it was to where it lies flat (section 3.5)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from deskew import projection
from deskew.errors import StepError, require
from deskew.restoration.quads import backward_quads
from deskew.restoration.sampling import sample_image
from deskew.types import Array, Flattened, Floats, Pinhole, Restoration, Sheet, Status

FARTHEST_MM = 1e9  # pixels of vertices farther away would overflow
NEAREST_MM = 1e-3


def view_camera(camera: Pinhole, scale: float = 1.0) -> Pinhole:
    """Return the ideal camera that control and restored images are seen through.

    Parameters
    ----------
    camera : Pinhole
        The raw camera.
    scale : float
        Pixels of the view for each of the camera's, in (0, 16].

    Returns
    -------
    Pinhole
        Same place and field of view, no distortion, `scale` times as many pixels.
    """
    require(bool(np.isfinite(scale)) and 0 < scale <= 16, "scale", "lie in (0, 16]", scale)
    width, height = camera.size
    size = round(width * scale), round(height * scale)
    require(min(size) >= 2, "scale", "leave a view of at least 2 x 2 pixels", f"{scale} for {width} x {height}")
    K = camera.K.copy()
    K[:2] *= scale
    # Pixel centres sit at integers, so the picture grows about its corner at (-1/2, -1/2).
    K[:2, 2] += (scale - 1.0) / 2.0
    return replace(projection.ideal(camera), K=K, size=size)


def _through_lens(camera: Pinhole, view: Pinhole, pixels: Floats) -> npt.NDArray[np.float32]:
    """Pixels (..., 2) of an undistorted view to raw camera pixels, NaN where the camera does not look."""
    normalised = (pixels - view.K[:2, 2]) @ np.linalg.inv(view.K[:2, :2]).T
    known = np.isfinite(normalised).all(axis=-1)
    raw = np.full(pixels.shape, np.nan)
    if known.any():
        raw[known] = projection.distort(camera, normalised[known])
    limit = np.array(camera.size) - 0.5
    outside = ~((raw >= -0.5) & (raw <= limit)).all(axis=-1)
    raw[outside] = np.nan
    return raw.astype(np.float32)


def undistortion_map(camera: Pinhole, scale: float = 1.0) -> npt.NDArray[np.float32]:
    """Return the raw camera pixel (x, y) that each pixel of the undistorted view shows, (H, W, 2), NaN outside."""
    view = view_camera(camera, scale)
    return _through_lens(camera, view, projection.pixel_grid(view.size))


def undistorted_view(image: Array, camera: Pinhole, scale: float = 1.0) -> Array:
    """See an image through the same camera without lens distortion: the control and the unrestored image.

    Parameters
    ----------
    image : (h, w[, channels]) array
        Raw image, any dtype, at the camera's resolution or a multiple of it.
    camera : Pinhole
        The raw camera.
    scale : float
        Pixels of the view for each of the camera's.

    Returns
    -------
    (H, W[, channels]) array
        The image's dtype; 0 where the camera does not look.
    """
    return sample_image(image, undistortion_map(camera, scale), camera.size, 1.0 / scale)


def texture_quads(image: Array, camera: Pinhole, sheet: Sheet, flattened: Flattened, scale: float = 1.0) -> Restoration:
    """Create the restored image as section 3.5 does, intensities unaltered.

    Old and new vertices are projected through the ideal camera; each restored pixel then looks from its place in a new
    quad to the old quad, and from there through the lens into the raw image, which is read once.

    Parameters
    ----------
    image : (h, w[, channels]) array
        Raw image, any dtype, at the camera's resolution or a multiple of it.
    camera : Pinhole
        The raw camera.
    sheet : Sheet
        The page as it was scanned, a grid.
    flattened : Flattened
        The same grid flattened.
    scale : float
        Pixels of the restored view for each of the camera's.

    Returns
    -------
    Restoration
        Reaches half a pixel beyond the mesh, so that border pixels show page and desk as a flat page's do.

    Raises
    ------
    InputError
        If the sheet is no grid, the two disagree in shape, or one lies behind the camera or beyond all measure.
    StepError
        If the flattened page does not lie in view of the camera.
    """
    require(sheet.faces is None, "sheet", "be a grid to be textured by quads", "a triangle mesh")
    shape = sheet.vertices.shape
    require(flattened.vertices.shape == shape, "flattened", f"have the sheet's shape {shape}", flattened.vertices.shape)
    finite = bool(np.isfinite(flattened.vertices).all())
    require(finite, "flattened", "have finite vertices", f"status {Status(flattened.status)} with NaN or infinity")
    view, ideal = view_camera(camera, scale), projection.ideal(camera)
    bent, flat, cut = _quads(sheet, flattened)
    new = _pixels(view, flat, "flattened")
    source = backward_quads(new, _pixels(ideal, bent, "sheet"), view.size, cut)
    backward = _through_lens(camera, ideal, source)
    if not np.isfinite(backward[..., 0]).any():
        raise StepError(
            f"Restoration: the flattened page lies at pixels {_extent(new)}, none of which sees the page in a view of "
            f"{view.size[0]} x {view.size[1]}; move the page back under the camera."
        )
    picture = sample_image(image, backward, camera.size, 1.0 / scale)
    return Restoration(picture, backward, view, flattened)


def _quads(sheet: Sheet, flattened: Flattened) -> tuple[Floats, Floats, npt.NDArray[np.bool_] | None]:
    """Return what is textured, bent and flat, and which quads are cut: the surface where both know it, or the grid."""
    if sheet.surface is None or flattened.surface is None:
        return sheet.vertices, flattened.vertices, sheet.cut
    n = sheet.refinement
    cut = None if sheet.cut is None else np.repeat(np.repeat(sheet.cut, n, axis=0), n, axis=1)
    return sheet.surface, flattened.surface, cut


def _pixels(view: Pinhole, vertices: Floats, name: str) -> Floats:
    """Project a sheet that lies in front of the camera; one behind it would be seen upside down."""
    farthest = float(np.abs(vertices).max())
    require(farthest < FARTHEST_MM, name, f"lie within {FARTHEST_MM:g} mm of the origin", f"{farthest:g} mm")
    nearest = float((vertices @ view.R[2] + view.t[2]).min())
    require(nearest >= NEAREST_MM, name, f"lie at least {NEAREST_MM:g} mm in front of the camera", f"{nearest:g} mm")
    return projection.project(view, vertices)


def _extent(pixels: Floats) -> str:
    low, high = pixels.reshape(-1, 2).min(axis=0), pixels.reshape(-1, 2).max(axis=0)
    return f"({low[0]:.0f}, {low[1]:.0f}) to ({high[0]:.0f}, {high[1]:.0f})"

"""Methods from outside that restore a page as a whole: what each is given, and what it must return."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from deskew.errors import DeskewError, StepError, in_one_line
from deskew.plugins import name_of
from deskew.restoration.warp import view_camera
from deskew.types import WHITE, Array, Dewarped, Flattened, Floats, Pinhole, Restoration, Scan, Size

Restorer = Callable[[Scan], Restoration]
Dewarper = Callable[[Array], Any]

LARGEST_PX = 1 << 26
"""Pixels of the largest image that a dewarper may return."""

_SAME = 1e-6  # pixels, millimetres: what a camera may lose on its way


def restore_by(restorer: Restorer, scan: Scan) -> Restoration:
    """Restore a scan by somebody's function.

    Parameters
    ----------
    restorer : callable
        Takes the `Scan`; what it is to restore is the image `white`.
    scan : Scan
        The page.

    Returns
    -------
    Restoration
        Seen through ``view_camera(scan.camera)``.

    Raises
    ------
    StepError
        If the function raises or exits, or returns something else: an image like the white one, a
        backward map into the camera's picture, NaN outside, and the camera of the view.
    """
    must = _Must(restorer)
    found = must.call(restorer, scan)
    must(isinstance(found, Restoration), "return a Restoration", type(found).__name__)
    view = view_camera(scan.camera)
    must.image(found.image, scan.images[WHITE], view.size)
    backward_map = must.backward_map(found.backward_map, view.size, scan.camera.size)
    same = isinstance(found.camera, Pinhole) and _same(found.camera, view)
    must(same, "return the camera `restoration.view_camera(scan.camera)`", "another")
    must.sheet(found.flattened, scan.sheet.vertices)
    return Restoration(found.image, backward_map, view, found.flattened)


def dewarp_by(dewarper: Dewarper, image: Array) -> Dewarped:
    """Flatten a page's raw image by somebody's function, which sees nothing else.

    Parameters
    ----------
    dewarper : callable
        Takes the image and returns the flat page's, grey or coloured and of the type as given, or a pair of that and
        its backward map.
    image : (height, width[, 3]) array
        As the camera saw the page, of 8 or 16 bits.

    Raises
    ------
    StepError
        If the function raises or exits, or returns something else.
    """
    must = _Must(dewarper)
    found = must.call(dewarper, image.copy())
    if isinstance(found, Dewarped):
        found = found.image, found.backward_map
    flat, places = found if isinstance(found, tuple) and len(found) == 2 else (found, None)
    must.image(flat, image, None)
    if places is None:
        return Dewarped(flat)
    return Dewarped(flat, must.backward_map(places, flat.shape[1::-1], image.shape[1::-1]))


class _Must:
    """Raises a StepError unless a method returned what it must; nothing about it is taken for granted."""

    def __init__(self, method: Callable[..., Any]) -> None:
        self.name = name_of(method)

    def __call__(self, holds: bool, what: str, got: object) -> None:
        if not holds:
            raise StepError(f"Restoration by `{self.name}` must {what}, got {got}.")

    def call(self, method: Callable[..., Any], given: object) -> Any:
        try:
            return method(given)
        except DeskewError:
            raise
        except (Exception, SystemExit) as error:
            raise StepError(f"Restoration by `{self.name}` failed: {in_one_line(error)}.") from error

    def image(self, image: Any, given: Array, size: Size | None) -> None:
        """Require a picture of the kind that was given, and of a size [px] if there is one."""
        array = isinstance(image, np.ndarray) and image.dtype == given.dtype
        self(array, f"return an image of {given.dtype}, as given", getattr(image, "dtype", type(image).__name__))
        shaped = image.ndim == given.ndim and image.shape[2:] == given.shape[2:]
        height, width = image.shape[:2] if shaped else (0, 0)
        if size is None:
            fits, what = (
                min(height, width) >= 2 and height * width <= LARGEST_PX,
                f"of at least 2 x 2 and at most {LARGEST_PX} pixels",
            )
        else:
            fits, what = (width, height) == size, f"of {size[0]} x {size[1]} pixels"
        channels = "(height, width)" if given.ndim == 2 else "(height, width, 3)"
        self(shaped and fits, f"return an image {channels} {what}", image.shape)

    def backward_map(self, places: Any, size: Size, camera_size: Size) -> Array:
        """Require a backward map of a picture's size whose places lie in the camera's, or are NaN as a whole."""
        array = isinstance(places, np.ndarray) and places.dtype.kind == "f"
        self(array, "return a backward map of floats", getattr(places, "dtype", type(places).__name__))
        wanted = (size[1], size[0], 2)
        self(places.shape == wanted, f"return a backward map of shape {wanted}", places.shape)
        shown = np.isfinite(places).all(axis=-1)
        self(
            bool(np.isnan(places[~shown]).all()),
            "return a backward map that is NaN or finite",
            "infinity or half a NaN",
        )
        self(bool(shown.any()), "return a backward map that shows something", "NaN everywhere")
        low, high = places[shown].min(), (places[shown] - camera_size).max()
        inside = low >= -0.5 and high <= -0.5
        self(bool(inside), f"keep to raw pixels of {camera_size[0]} x {camera_size[1]}", "places outside the picture")
        return np.asarray(places, dtype=np.float32)

    def sheet(self, flattened: Any, bent: Floats) -> None:
        """Require a flattened sheet like the bent one, or None."""
        vertices: Any = getattr(flattened, "vertices", None)
        real = isinstance(vertices, np.ndarray) and vertices.dtype.kind in "fiu"
        like = isinstance(flattened, Flattened) and real and np.shape(vertices) == bent.shape
        good = flattened is None or (like and bool(np.isfinite(vertices).all()))
        self(good, f"return a finite Flattened of shape {bent.shape}, or None", np.shape(vertices))


def _same(found: Pinhole, wanted: Pinhole) -> bool:
    parts = ((getattr(found, name), getattr(wanted, name)) for name in ("K", "distortion", "R", "t"))
    return found.size == wanted.size and all(np.allclose(a, b, rtol=0.0, atol=_SAME) for a, b in parts)

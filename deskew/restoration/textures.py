"""One flattening, one backward map, many textures: the page under every light it was photographed in (section 2.4).

Images of the scan's own size come from the same pixels of the same camera: they are registered as they are, which is
the point of taking them through one lens. Images of another size are another format of the sensor, and where their
pixels lie is found from the images (:mod:`deskew.restoration.registration`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy.typing as npt

from deskew.errors import StepError, require
from deskew.restoration.registration import Registration, register
from deskew.restoration.sampling import read_at
from deskew.restoration.shading import UNSHADED
from deskew.restoration.warp import texture_quads
from deskew.types import WHITE, Array, Flattened, Pinhole, Restoration, Scan, Size


@dataclass(frozen=True, slots=True)
class Textures:
    """A restored page under several lights, pixel on pixel.

    Attributes
    ----------
    images : mapping of light name to (height, width[, channels]) array
        Undistorted pinhole views of the flattened page, each of its texture's type; 0 outside the page.
    backward_map : (height, width, 2) float32 array
        Raw camera pixel (x, y) of each restored pixel, NaN outside the page.
    camera : Pinhole
        The ideal camera that the views are seen through.
    flattened : Flattened
        The geometry behind all of them.
    registrations : mapping of light name to Registration
        Of the lights in another format; the others need none.
    """

    images: Mapping[str, Array]
    backward_map: npt.NDArray[Any]
    camera: Pinhole
    flattened: Flattened
    registrations: Mapping[str, Registration]

    def restoration(self, light: str) -> Restoration:
        """Return one light's image as a restoration."""
        return Restoration(self.images[light], self.backward_map, self.camera, self.flattened)


def register_textures(images: Mapping[str, Array], scan: Array) -> dict[str, Registration]:
    """Find where the lights that were taken in another format than the scan show what the scan shows.

    Lights of one size share a format, so also a map: the one of whichever light states the smallest uncertainty. A
    light that shows little of the print is so carried by another one.

    Parameters
    ----------
    images : mapping of light name to image
        Lights of the scan's own size are passed over.
    scan : (height, width[, channels]) array
        The scan's white image.

    Returns
    -------
    dict of light name to Registration

    Raises
    ------
    StepError
        If no light of a format fits.
    """
    formats: dict[Size, list[str]] = {}
    for light, image in images.items():
        size = image.shape[1], image.shape[0]
        if size != (scan.shape[1], scan.shape[0]):
            formats.setdefault(size, []).append(light)
    found: dict[str, Registration] = {}
    for lights in formats.values():
        shared = _best([(light, images[light]) for light in lights], scan)
        found |= dict.fromkeys(lights, shared)
    return found


def _best(candidates: list[tuple[str, Array]], scan: Array) -> Registration:
    fits, misfits = [], []
    for light, image in candidates:
        try:
            fits.append(register(image, scan, light))
        except StepError as error:
            misfits.append(error)
    if not fits:
        raise misfits[0]
    return min(fits, key=lambda fit: fit.uncertainty_px)


def restore_textures(
    scan: Scan,
    flattened: Flattened,
    lights: Iterable[str] | None = None,
    scale: float = 1.0,
    registrations: Mapping[str, Registration] | None = None,
) -> Textures:
    """Texture the flattened page with the image of every light; nothing is flattened again.

    Parameters
    ----------
    scan : Scan
        The page and its images; with an `unshaded` one, images of another format are registered to that.
    flattened : Flattened
        Its sheet, flattened.
    lights : names, optional
        Which lights; all if not given.
    scale : float
        Pixels of the restored views for each of the camera's, in (0, 16]; a texture's own resolution is reached at its
        `Registration.scale`.
    registrations : mapping of light name to Registration, optional
        As :func:`register_textures` found them before, for every wanted light in another format.

    Raises
    ------
    InputError
        If the scan has no such light.
    StepError
        If the page lies out of view, or a light in another format does not fit.
    """
    wanted = list(scan.images if lights is None else dict.fromkeys(lights))
    known = ", ".join(scan.images)
    for light in wanted:
        require(light in scan.images, "light", f"be one of {known}", light)
    white = scan.images[WHITE]
    size = white.shape[1], white.shape[0]
    # Every image of a format helps to find its map, wanted or not.
    formats = {scan.images[light].shape[1::-1] for light in wanted} - {size}
    others = {light: image for light, image in scan.images.items() if image.shape[1::-1] in formats}
    if registrations is None:
        # Shading is no part of the page: light from another side shifts what the patches compare by .2 texture pixels.
        registrations = register_textures(others, scan.images.get(UNSHADED, white))
    plain = texture_quads(white, scan.camera, scan.sheet, flattened, scale)
    images = {}
    for light in wanted:
        places, step = plain.backward_map.astype("float64"), 1.0 / scale
        if light in registrations:
            places = registrations[light].to_texture(places)
            step *= float(registrations[light].scale.mean())
        images[light] = plain.image if light == WHITE else read_at(scan.images[light], places, step)
    used = {light: registrations[light] for light in wanted if light in registrations}
    return Textures(images, plain.backward_map, plain.camera, flattened, used)

"""Images: PNG and TIFF, grey or colour, 8 or 16 bits, as they are; colour is in RGB order in memory."""

from __future__ import annotations

import math
from pathlib import Path

import cv2
import numpy as np

from deskew.errors import InputError, require
from deskew.io import png, pngtags, tiff
from deskew.io.colour import is_profile
from deskew.io.files import read_bytes, read_head, write_bytes
from deskew.types import Array, Size

IMAGE_SUFFIXES = (".png", ".tif", ".tiff")

MAX_DECODED_BYTES = 3 << 27
"""Largest picture that is decoded, 134 megapixels of 8-bit colour: what is wrong is said within 1 GB of memory."""

_PACKED_MAX = (
    1 << 13
)  # decoded over stored bytes; LZW and Deflate reach some 1400, and a decoded grey counts four times

_ROWS = 64


def _header(data: bytes, path: Path) -> tiff.Header:
    read = png.header if path.suffix.lower() == ".png" else tiff.header
    found = read(data, str(path))
    small = found.decoded_bytes <= MAX_DECODED_BYTES
    size = f"{found.size[0]}x{found.size[1]} px"
    require(small, str(path), f"decode to at most {MAX_DECODED_BYTES} bytes", f"{size}, {found.decoded_bytes} bytes")
    return found


def _require_pixels(found: tiff.Header, data: bytes, path: Path) -> None:
    """Refuse a TIFF too short for what it declares: its decoder would leave the rest black, and say nothing."""
    room = found.decoded_bytes <= _PACKED_MAX * len(data)
    size = f"{found.size[0]}x{found.size[1]} px"
    require(room, str(path), f"hold the {size} that it declares", f"{len(data)} bytes")


def _decode(data: bytes, path: Path) -> Array:
    if path.suffix.lower() == ".png":
        data = png.essential(data, str(path))
    level = cv2.utils.logging.getLogLevel()
    # A damaged TIFF would make OpenCV write its own lines to stderr, beside the one line that says it.
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        image = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error as error:
        raise InputError(f"`{path}` must be a readable image, got damaged data.") from error
    finally:
        cv2.utils.logging.setLogLevel(level)
    require(image is not None, str(path), "be a readable image", "damaged data")
    return np.asarray(image)


def png_size(path: Path) -> Size:
    """Width and height [px] as a PNG's header declares them, without reading the rest.

    Raises
    ------
    InputError
        If `path` is no PNG file or would decode to more than `MAX_DECODED_BYTES`.
    """
    return _header(read_head(path, 64), path).size


def read_raster(path: Path, size: Size | None = None) -> Array:
    """Decode an image file of any sample type, after its header has been checked.

    Parameters
    ----------
    path : Path
        PNG or TIFF.
    size : (width, height), optional
        What it has to be [px].

    Returns
    -------
    (height, width[, channels]) array
        Colour in RGB order.

    Raises
    ------
    InputError
        If it is missing, cut, damaged, too large or of another size.
    """
    suffix = path.suffix.lower()
    require(suffix in IMAGE_SUFFIXES, str(path), f"end in {' or '.join(IMAGE_SUFFIXES)}", suffix or "no suffix")
    data = read_bytes(path)
    header = _header(data, path)
    if suffix != ".png":
        _require_pixels(header, data, path)
    declared = header.size
    if size is not None:
        require(declared == size, str(path), f"be {size[0]}x{size[1]} px", f"{declared[0]}x{declared[1]} px")
    image = _decode(data, path)
    found = (image.shape[1], image.shape[0])
    require(found == declared, str(path), f"decode to {declared} px as its header says", f"{found} px")
    if image.ndim == 3 and image.shape[2] in (3, 4):
        # In place, since a large picture need not be held twice, and by numpy, which knows every sample type.
        for rows in range(0, len(image), _ROWS):
            image[rows : rows + _ROWS, :, :3] = image[rows : rows + _ROWS, :, 2::-1].copy()
    return image


def read_image(path: Path, size: Size | None = None) -> Array:
    """Read a picture, (height, width) or (height, width, 3) in RGB order, uint8 or uint16 as stored.

    Parameters
    ----------
    path : Path
        PNG or TIFF; an alpha channel is dropped if it is opaque throughout.
    size : (width, height), optional
        What it has to be [px].

    Raises
    ------
    InputError
        If it is missing, cut, damaged, too large, of another size, transparent, or not of 8 or 16 bits.
    """
    image = read_raster(path, size)
    require(image.dtype in (np.uint8, np.uint16), str(path), "have 8 or 16 bits a sample", image.dtype)
    if image.ndim == 3 and image.shape[2] == 4:
        least = int(image[..., 3].min())
        require(least == np.iinfo(image.dtype).max, str(path), "be without transparency", f"an alpha down to {least}")
        image = np.ascontiguousarray(image[..., :3])
    grey_or_colour = image.ndim == 2 or image.shape[2] == 3
    require(grey_or_colour, str(path), "have 1 or 3 channels", image.shape[2:])
    return image


def encoded(image: Array, suffix: str) -> bytes:
    """Encode an image of a sample type that the format holds; colour in RGB order.

    Parameters
    ----------
    image : (height, width[, 3]) array
        Any type that the format holds.
    suffix : str
        One of `IMAGE_SUFFIXES`.
    """
    stored = image if image.ndim == 2 else cv2.cvtColor(np.ascontiguousarray(image), cv2.COLOR_RGB2BGR)
    done, data = cv2.imencode(suffix, stored)
    require(bool(done), "image", f"be one that {suffix} can hold", f"{image.dtype} of shape {image.shape}")
    return bytes(data)


def picture_bytes(
    image: Array, suffix: str, profile: bytes | None = None, dpi: tuple[float, float] | None = None
) -> bytes:
    """Encode a picture with its colour profile and resolution; parameters as in :func:`write_image`."""
    data = encoded(image, suffix)
    if profile is None and dpi is None:
        return data
    channels = 1 if image.ndim == 2 else 3
    fits = profile is None or is_profile(profile, channels)
    require(fits, "profile", f"be the ICC profile of a picture with {channels} channels", "another")
    finite = dpi is None or all(math.isfinite(value) and value > 0 for value in dpi)
    require(finite, "dpi", "be two finite numbers above 0", dpi)
    tagged = pngtags.tagged if suffix == ".png" else tiff.tagged
    return tagged(data, profile, dpi)


def require_picture(image: Array, name: str) -> None:
    """Raise an InputError unless `image` is non-empty, grey or colour, of 8 or 16 bits."""
    require(image.dtype in (np.uint8, np.uint16), name, "have 8 or 16 bits a sample", image.dtype)
    good = (image.ndim == 2 or (image.ndim == 3 and image.shape[2] == 3)) and image.size > 0
    require(good, name, "be non-empty (height, width) or (height, width, 3)", image.shape)


def write_image(
    image: Array, path: Path, *, profile: bytes | None = None, dpi: tuple[float, float] | None = None
) -> None:
    """Write a picture, (height, width) or (height, width, 3) in RGB order, keeping its 8 or 16 bits.

    Parameters
    ----------
    image : (height, width[, 3]) array
        uint8 or uint16.
    path : Path
        PNG or TIFF.
    profile : bytes, optional
        Its ICC colour profile, as :func:`deskew.io.read_profile` found it.
    dpi : (x, y), optional
        Resolution [dots per inch].

    Raises
    ------
    InputError
        If it is anything else, the suffix is not a PNG's or TIFF's, or the profile is of another kind of picture.
    StepError
        If the file system refuses.
    """
    suffix = path.suffix.lower()
    require(suffix in IMAGE_SUFFIXES, str(path), f"end in {' or '.join(IMAGE_SUFFIXES)}", suffix or "no suffix")
    require_picture(image, "image")
    write_bytes(picture_bytes(image, suffix, profile, dpi), path)

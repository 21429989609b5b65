"""TIFF files: their size, read from the first directory, before any decoder sees them (TIFF 6.0, section 2).

What an encoder left out, the resolution and the colour profile, is added in a directory of its own.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from deskew.errors import InputError, require

_WIDTH, _HEIGHT, _BITS, _CHANNELS = 256, 257, 258, 277
_FORMATS = {3: "H", 4: "I"}  # SHORT and LONG: what these four tags may be
_X_RESOLUTION, _Y_RESOLUTION, _RESOLUTION_UNIT, _PROFILE = 282, 283, 296, 34675
_SHORT, _RATIONAL, _UNDEFINED = 3, 5, 7


@dataclass(frozen=True, slots=True)
class Header:
    """What an image file says it holds.

    Attributes
    ----------
    size : (width, height)
        Pixels.
    decoded_bytes : int
        An upper bound of the decoded array's size.
    """

    size: tuple[int, int]
    decoded_bytes: int


def _tags(data: bytes) -> dict[int, int]:
    order = "<" if data[:2] == b"II" else ">"
    (at,) = struct.unpack_from(order + "I", data, 4)
    (n_entries,) = struct.unpack_from(order + "H", data, at)
    tags: dict[int, int] = {}
    for entry in range(at + 2, at + 2 + 12 * n_entries, 12):
        tag, kind, count = struct.unpack_from(order + "HHI", data, entry)
        if tag in (_WIDTH, _HEIGHT, _BITS, _CHANNELS):
            code = order + _FORMATS[kind]
            fits = count * struct.calcsize(code) <= 4
            (where,) = (entry + 8,) if fits else struct.unpack_from(order + "I", data, entry + 8)
            (tags[tag],) = struct.unpack_from(code, data, where)
    return tags


def header(data: bytes, name: str) -> Header:
    """Read the size of the first picture of a classic TIFF.

    Raises
    ------
    InputError
        If the file is no classic TIFF, cut before its directory, or declares nonsense.
    """
    require(data[:4] in (b"II*\0", b"MM\0*"), name, "be a TIFF image", f"{len(data)} bytes that begin {data[:8]!r}")
    try:
        tags = _tags(data)
        size = (tags[_WIDTH], tags[_HEIGHT])
    except (struct.error, KeyError) as error:
        raise InputError(f"`{name}` must be a whole TIFF, got no complete directory.") from error
    require(min(size) >= 1, name, "have a size of at least 1 pixel", size)
    bits, channels = tags.get(_BITS, 1), tags.get(_CHANNELS, 1)
    # The decoder may widen samples to 8 bits and to four channels.
    return Header(size, size[0] * size[1] * max(channels, 4) * max(1, -(-bits // 8)))


def tagged(data: bytes, icc: bytes | None, dpi: tuple[float, float] | None) -> bytes:
    """Return a whole TIFF of one picture with a colour profile and its resolution.

    The first directory is written anew behind everything else: what it points to stays where it is.

    Parameters
    ----------
    data : bytes
        As an encoder wrote it.
    icc : bytes or None
        The profile (ICC.1:2022, annex B.3).
    dpi : (x, y) or None
        Dots per inch, kept to a thousandth.
    """
    order = "<" if data[:2] == b"II" else ">"
    (at,) = struct.unpack_from(order + "I", data, 4)
    (n_entries,) = struct.unpack_from(order + "H", data, at)
    entries = {
        struct.unpack_from(order + "H", data, i)[0]: data[i : i + 12]
        for i in range(at + 2, at + 2 + 12 * n_entries, 12)
    }
    out = bytearray(data + bytes(len(data) % 2))

    def add(tag: int, kind: int, count: int, body: bytes) -> None:
        place = body.ljust(4, b"\0")
        if len(body) > 4:
            place = struct.pack(order + "I", len(out))
            out.extend(body + bytes(len(body) % 2))
        entries[tag] = struct.pack(order + "HHI", tag, kind, count) + place

    if dpi is not None:
        for tag, value in zip((_X_RESOLUTION, _Y_RESOLUTION), dpi, strict=True):
            add(tag, _RATIONAL, 1, struct.pack(order + "II", min(max(1, round(value * 1000)), (1 << 32) - 1), 1000))
        add(_RESOLUTION_UNIT, _SHORT, 1, struct.pack(order + "H", 2))  # inch
    if icc is not None:
        add(_PROFILE, _UNDEFINED, len(icc), icc)
    out[4:8] = struct.pack(order + "I", len(out))
    out += struct.pack(order + "H", len(entries)) + b"".join(entries[tag] for tag in sorted(entries)) + bytes(4)
    return bytes(out)

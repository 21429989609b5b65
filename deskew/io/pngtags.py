"""Chunks of a PNG that say something of its pixels, colour profile and resolution, apart from those that make them."""

from __future__ import annotations

import struct
import zlib

from deskew.io.png import SIGNATURE

_HEADER_END = 33


def n_channels(data: bytes) -> int:
    """Channels of the picture that a whole header announces: 1 grey, 3 colour; transparency does not count."""
    return 3 if data[25] & 2 else 1


def profile(data: bytes, limit: int) -> bytes | None:
    """Return what the chunk iCCP before the pixels unpacks to, None if there is none, damaged or above `limit` bytes.

    Parameters
    ----------
    data : bytes
        The beginning of a PNG, at least up to its pixels.
    limit : int
        Largest profile [bytes].
    """
    at = len(SIGNATURE)
    while at + 12 <= len(data):
        (length,) = struct.unpack_from(">I", data, at)
        kind, body = data[at + 4 : at + 8], data[at + 8 : at + 8 + length]
        if kind in (b"IDAT", b"IEND"):
            break
        if kind == b"iCCP":
            _, _, packed = body.partition(b"\0")  # a name, a null, the method 0, then the profile
            inflater = zlib.decompressobj()
            try:
                found = inflater.decompress(packed[1:], limit) if packed[:1] == b"\0" else b""
            except zlib.error:
                return None
            return found if inflater.eof else None
        at += 12 + length
    return None


def tagged(data: bytes, icc: bytes | None, dpi: tuple[float, float] | None) -> bytes:
    """Return a whole PNG with a colour profile (iCCP) and its resolution (pHYs) before its pixels.

    Parameters
    ----------
    data : bytes
        As an encoder wrote it, its header first.
    icc : bytes or None
        The profile.
    dpi : (x, y) or None
        Dots per inch; PNG keeps whole dots a metre.
    """
    extra = b"" if icc is None else _chunk(b"iCCP", b"ICC profile\0\0" + zlib.compress(icc, 9))
    if dpi is not None:
        per_metre = [min(max(1, round(value / 0.0254)), (1 << 31) - 1) for value in dpi]
        extra += _chunk(b"pHYs", struct.pack(">IIB", *per_metre, 1))
    return data[:_HEADER_END] + extra + data[_HEADER_END:]


def _chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

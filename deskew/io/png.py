"""PNG files as they come from outside: looked over before any decoder sees them.

A decoder meets only files whose declared size is bounded, whose checksums hold and whose pixel data are all there, so
that a bomb costs nothing, a cut file is named, and libpng never writes to stderr by itself.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Sequence

from deskew.errors import InputError, require
from deskew.io.tiff import Header

SIGNATURE = b"\x89PNG\r\n\x1a\n"

_CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
_DEPTHS = {0: (1, 2, 4, 8, 16), 2: (8, 16), 3: (1, 2, 4, 8), 4: (8, 16), 6: (8, 16)}
_MAX_CHUNKS = 1 << 18  # twice what 1 GB takes in the smallest chunks that programs write
_FED, _PIECE = 1 << 16, 1 << 20  # compressed and inflated bytes that are held at once
# Adam7: x and y of each pass's first pixel and its steps (PNG specification, section 8.2).
_ADAM7 = ((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2))


Chunk = tuple[bytes, memoryview]


def _chunks(data: bytes, name: str) -> Iterator[Chunk]:
    at, view = len(SIGNATURE), memoryview(data)  # slices of it are no copies of a large file
    for _ in range(_MAX_CHUNKS):
        require(at + 12 <= len(data), name, "be a whole PNG", f"its end after {len(data)} bytes")
        (length,) = struct.unpack_from(">I", data, at)
        end = at + 12 + length
        require(end <= len(data), name, "be a whole PNG", f"its end after {len(data)} bytes")
        kind, body = data[at + 4 : at + 8], view[at + 8 : end - 4]
        (crc,) = struct.unpack_from(">I", data, end - 4)
        require(zlib.crc32(view[at + 4 : end - 4]) == crc, name, "be an undamaged PNG", f"a bad checksum at byte {at}")
        yield kind, body
        if kind == b"IEND":
            return
        at = end
    require(False, name, f"have at most {_MAX_CHUNKS} chunks", "more")


def header(data: bytes, name: str) -> Header:
    """Read the size from the first 33 bytes.

    Raises
    ------
    InputError
        If they are not the beginning of a PNG.
    """
    begins = data.startswith(SIGNATURE) and len(data) >= 33 and data[8:16] == b"\0\0\0\rIHDR"
    require(begins, name, "be a PNG image", f"{len(data)} bytes that begin {data[:8]!r}")
    width, height, depth, colour, compression, filtering, interlace = struct.unpack_from(">IIBBBBB", data, 16)
    valid = depth in _DEPTHS.get(colour, ()) and compression == filtering == 0 and interlace <= 1
    require(valid and min(width, height) >= 1, name, "have a valid PNG header", data[16:29].hex())
    channels = 4 if colour == 3 else 2 * _CHANNELS[colour] if colour == 4 else _CHANNELS[colour]
    return Header((width, height), width * height * channels * (2 if depth == 16 else 1))


def _inflated(compressed: Sequence[memoryview], most: int, name: str) -> Iterator[bytes]:
    """Yield the pixel data piece by piece; they have to end where the last chunk does, after at most `most` bytes."""
    inflater, n_bytes = zlib.decompressobj(), 0
    for body in compressed:
        for start in range(0, len(body), _FED):
            waiting: bytes | memoryview = body[start : start + _FED]
            full = True
            while waiting or full:
                whole = not inflater.eof and n_bytes <= most
                require(whole, name, "hold the pixels its header declares", "more pixel data")
                try:
                    piece = inflater.decompress(waiting, _PIECE)
                except zlib.error as error:
                    raise InputError(f"`{name}` must hold valid pixel data, got {error}.") from error
                waiting, full, n_bytes = inflater.unconsumed_tail, len(piece) == _PIECE, n_bytes + len(piece)
                yield piece
    whole = inflater.eof and not inflater.unused_data
    require(whole, name, "hold the pixels its header declares", "pixel data of another length")


def _require_all_pixels(ihdr: memoryview, compressed: Sequence[memoryview], name: str) -> None:
    width, height, depth, colour, _, _, interlace = struct.unpack(">IIBBBBB", ihdr)
    bits = depth * _CHANNELS[colour]
    passes = _ADAM7 if interlace else ((0, 0, 1, 1),)
    spans = [
        (-(-(height - y) // dy), 1 + (-(-(width - x) // dx) * bits + 7) // 8)
        for x, y, dx, dy in passes
        if width > x and height > y
    ]
    wanted, begin = sum(rows * stride for rows, stride in spans), 0
    for piece in _inflated(compressed, wanted, name):
        _require_filters(piece, begin, spans, name)
        begin += len(piece)
    require(begin == wanted, name, "hold the pixels its header declares", f"{begin} of {wanted} bytes")


def _require_filters(piece: bytes, begin: int, spans: Sequence[tuple[int, int]], name: str) -> None:
    """Check the filter that each row of the `piece` begins with; `spans` are rows and bytes a row, pass by pass."""
    at = 0
    for rows, stride in spans:
        first, end = max(at - begin, (at - begin) % stride), min(at + rows * stride - begin, len(piece))
        worst = max(piece[first:end:stride], default=0) if first < end else 0
        require(worst <= 4, name, "hold valid PNG rows", f"the filter {worst}")
        at += rows * stride


def essential(data: bytes, name: str) -> bytes:
    """Return the same picture with nothing but the chunks that make its pixels, all verified.

    Colour profiles and text never reach the decoder: it would complain of common harmless faults in them on stderr.

    Raises
    ------
    InputError
        If the file is cut, damaged or inconsistent.
    """
    chunks = list(_chunks(data, name))
    kept = [(kind, body) for kind, body in chunks if kind in (b"IHDR", b"PLTE", b"IDAT", b"IEND")]
    kinds = [kind for kind, _ in kept]
    n_data = kinds.count(b"IDAT")
    palette = [b"PLTE"] if b"PLTE" in kinds else []
    in_order = n_data > 0 and kinds == [b"IHDR", *palette, *[b"IDAT"] * n_data, b"IEND"]
    require(in_order, name, "hold the PNG chunks in order", " ".join(dict.fromkeys(k.decode("latin-1") for k in kinds)))
    indexed = kept[0][1][9] == 3
    sound = len(kept[1][1]) % 3 == 0 and 3 <= len(kept[1][1]) <= 768 if palette else not indexed
    require(sound, name, "have a valid palette", "none" if not palette else f"{len(kept[1][1])} bytes")
    _require_all_pixels(kept[0][1], [body for kind, body in kept if kind == b"IDAT"], name)
    parts: list[bytes | memoryview] = [SIGNATURE]
    for kind, body in kept:
        if kind != b"PLTE" or indexed:
            parts += [struct.pack(">I", len(body)), kind, body, struct.pack(">I", zlib.crc32(body, zlib.crc32(kind)))]
    return b"".join(parts)

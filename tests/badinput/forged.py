"""Files made byte by byte, so that they may say what no writer of theirs would."""

from __future__ import annotations

import io
import struct
import zipfile
import zlib

import numpy as np

SIGNATURE = b"\x89PNG\r\n\x1a\n"


def chunk(kind: bytes, body: bytes) -> bytes:
    """A PNG chunk with a good checksum."""
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def png(
    width: int,
    height: int,
    depth: int = 8,
    colour: int = 0,
    raw: bytes | None = None,
    interlace: int = 0,
    extra: bytes = b"",
) -> bytes:
    """A PNG that declares this size; black unless `raw` rows are given."""
    channels = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}.get(colour, 1)
    rows = bytes(height * (1 + -(-width * channels * depth // 8))) if raw is None else raw
    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, interlace))
    return SIGNATURE + header + extra + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def tiff(entries: dict[int, int], body: bytes = b"") -> bytes:
    """A little-endian TIFF with these LONG tags in its one directory."""
    table = b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in sorted(entries.items()))
    return struct.pack("<2sHIH", b"II", 42, 8, len(entries)) + table + bytes(4) + body


def npz(members: dict[str, bytes], method: int = zipfile.ZIP_DEFLATED) -> bytes:
    """A ZIP archive of these files."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", method) as archive:
        for name, body in members.items():
            archive.writestr(name, body)
    return packed.getvalue()


def npy(descr: str, shape: str, body: bytes = b"", order: str = "False") -> bytes:
    """An array whose header says whatever it is told to."""
    head = f"{{'descr': {descr}, 'fortran_order': {order}, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head + body


def npz_bomb(n_bytes: int) -> bytes:
    """An NPZ of a few hundred kilobytes that unpacks to an array of zeros of `n_bytes`."""
    packed = io.BytesIO()
    with (
        zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open("V.npy", "w") as stream,
    ):
        np.lib.format.write_array_header_1_0(stream, {"descr": "|u1", "fortran_order": False, "shape": (n_bytes,)})
        for _ in range(n_bytes >> 24):
            stream.write(bytes(1 << 24))
    return packed.getvalue()


def npz_that_declares(n_bytes: int) -> bytes:
    """An NPZ of a small array whose directory says that it unpacks to `n_bytes`."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("V.npy", bytes(9))
        archive.infolist()[0].file_size = n_bytes
    return packed.getvalue()

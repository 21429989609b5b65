"""Seeded damage to files: blind, word by word, and along the structure of PNG, TIFF, NPZ and PLY.

Blind damage dies at a checksum or in a header. What is damaged along the structure has its checksums made good again,
so that the layers behind them are reached.
"""

from __future__ import annotations

import io
import re
import struct
import warnings
import zipfile
import zlib
from collections.abc import Callable, Sequence
from contextlib import suppress
from random import Random

Damage = Callable[[Random, bytes], bytes]

WORDS = (
    *("0", "-1", "1", "2", "255", "65535", "65536", "2147483648", "4294967295", "18446744073709551616", "9" * 400),
    *("1e999", "-1e999", "nan", "NaN", "inf", "-Infinity", "1e-320", "0x10", "1_000", "0.5", "1e5", "true", "null"),
    *("''", '"', "[]", "{}", "[" * 300, "\0", "\ufeff", "\ud800", "../../x", "/dev/zero", "${oc.env:HOME}", "a" * 300),
)
_NUMBERS = (0, 1, 2, 3, 4, 5, 6, 7, 8, 15, 16, 127, 128, 255, 256, 32767, 65535, 1 << 16, 1 << 31, (1 << 32) - 1)
_TOKEN = re.compile(rb"[\w.+-]+|[^\w\s]|\s+")


def bytewise(rng: Random, data: bytes) -> bytes:
    """Flip, set, cut, drop, repeat or move bytes, once or a few times."""
    damaged = bytearray(data)
    for _ in range(rng.choice((1, 1, 1, 2, 4, 16))):
        at, length = rng.randrange(len(damaged) + 1), rng.choice((1, 2, 4, 8, 64))
        piece = damaged[at : at + length]
        match rng.randrange(6):
            case 0 if piece:
                damaged[at] ^= 1 << rng.randrange(8)
            case 1 if piece:
                damaged[at] = rng.choice((0, 1, 127, 128, 255, rng.randrange(256)))
            case 2:
                del damaged[at:]
            case 3:
                del damaged[at : at + length]
            case 4:
                damaged[at:at] = piece * rng.choice((1, 2, 30))
            case _:
                where = rng.randrange(len(damaged) + 1)
                damaged[where : where + length] = piece
    return bytes(damaged)


def wordwise(rng: Random, data: bytes) -> bytes:
    """Replace, drop, repeat or swap words, lines or signs of a text; sometimes bytes."""
    if rng.random() < 0.2:
        return bytewise(rng, data)
    parts = _TOKEN.findall(data) if rng.random() < 0.7 else data.splitlines(keepends=True)
    for _ in range(rng.choice((1, 1, 2, 3))):
        if not parts:
            break
        at, other = rng.randrange(len(parts)), rng.randrange(len(parts))
        match rng.randrange(5):
            case 0 | 1:
                parts[at] = rng.choice(WORDS).encode("utf-8", "surrogatepass")
            case 2:
                del parts[at]
            case 3:
                parts[at:at] = [parts[other]] * rng.choice((1, 2, 50))
            case _:
                parts[at], parts[other] = parts[other], parts[at]
    return b"".join(parts)


def _number(rng: Random, n_bytes: int) -> int:
    return rng.choice((*_NUMBERS, rng.getrandbits(32))) & ((1 << 8 * n_bytes) - 1)


def png(rng: Random, data: bytes) -> bytes:
    """Damage chunks of a PNG, its pixels before they are compressed included, and mend the checksums."""
    if rng.random() < 0.2:
        return bytewise(rng, data)
    chunks, at = [], 8
    while at + 12 <= len(data):
        (length,) = struct.unpack_from(">I", data, at)
        chunks.append((data[at + 4 : at + 8], data[at + 8 : at + 8 + length]))
        at += 12 + length
    i, j = rng.randrange(len(chunks)), rng.randrange(len(chunks))
    kind, body = chunks[i]
    match rng.randrange(7):
        case 0 if kind == b"IDAT":
            with suppress(zlib.error):
                chunks[i] = (kind, zlib.compress(bytewise(rng, zlib.decompress(body))))
        case 0 | 1 | 2:
            field = rng.choice((">I", ">I", "B", "B", "B", "B", "B"))
            place = rng.choice((0, 4, 8, 9, 10, 11, 12)) if kind == b"IHDR" else rng.randrange(max(1, len(body) - 4))
            if place + struct.calcsize(field) <= len(body):
                changed = bytearray(body)
                struct.pack_into(field, changed, place, _number(rng, struct.calcsize(field)))
                chunks[i] = (kind, bytes(changed))
        case 3:
            chunks[i] = (kind, bytewise(rng, body))
        case 4:
            chunks[i] = (rng.choice((b"IDAT", b"PLTE", b"tRNS", b"IEND", b"acTL", b"iCCP", b"pHYs", b"\0\0\0\0")), body)
        case 5:
            chunks.insert(j, chunks[i])
        case _:
            chunks[i], chunks[j] = chunks[j], chunks[i]
    return data[:8] + b"".join(
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body)) for kind, body in chunks
    )


def tiff(rng: Random, data: bytes) -> bytes:
    """Damage the entries of a little-endian TIFF's first directory."""
    if rng.random() < 0.3 or len(data) < 8:
        return bytewise(rng, data)
    changed = bytearray(data)
    for _ in range(rng.choice((1, 1, 2))):
        with suppress(struct.error):
            (start,) = struct.unpack_from("<I", data, 4)
            (n_entries,) = struct.unpack_from("<H", data, start)
            entry = start + 2 + 12 * rng.randrange(n_entries)
            offset, field = rng.choice(((0, "<H"), (2, "<H"), (4, "<I"), (8, "<I"), (8, "<I"), (8, "<H")))
            tags = (256, 257, 258, 259, 262, 273, 277, 278, 279, 282, 284, 317, 322, 323, 324, 325, 330, 338, 339)
            value = rng.choice(tags) if offset == 0 else _number(rng, struct.calcsize(field))
            struct.pack_into(field, changed, entry + offset, value)
    return bytes(changed)


def npz(rng: Random, data: bytes) -> bytes:
    """Damage one member of an NPZ, its header or its numbers, its name or its method, and pack it anew."""
    if rng.random() < 0.2:
        return bytewise(rng, data)
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = [(name, archive.read(name)) for name in archive.namelist()]
    i = rng.randrange(len(members))
    name, body = members[i]
    match rng.randrange(6):
        case 0 | 1:
            head = 10 + struct.unpack_from("<H", body, 8)[0]
            members[i] = (name, body[:10] + wordwise(rng, body[10:head]) + body[head:])
        case 2:
            members[i] = (name, body[:128] + _odd_numbers(rng, body[128:]))
        case 3:
            members[i] = (name, bytewise(rng, body))
        case 4:
            del members[i]
        case _:
            members.append((rng.choice((name, "../x.npy", "x", "\u00e9.npy", "a/b.npy")), rng.choice(members)[1]))
    packed, method = io.BytesIO(), rng.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2))
    with zipfile.ZipFile(packed, "w", method) as archive, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a name that is there twice
        for name, body in members:
            archive.writestr(zipfile.ZipInfo(name), body, method)
    return packed.getvalue()


def _odd_numbers(rng: Random, body: bytes) -> bytes:
    """Put numbers that nobody counts with among an array's."""
    changed, odd = bytearray(body), (float("nan"), float("inf"), -1.0, 0.0, 1e300, 1e-310, -1e9, 2.0**53)
    for _ in range(rng.choice((1, 1, 4, 1000))):
        if len(changed) >= 8:
            struct.pack_into("<d", changed, 8 * rng.randrange(len(changed) // 8), rng.choice(odd))
    return bytes(changed)


def ply(rng: Random, data: bytes) -> bytes:
    """Damage a PLY's header word by word, or what follows it."""
    head, end, body = data.partition(b"end_header\n")
    if rng.random() < 0.5:
        return wordwise(rng, head) + end + body
    return head + end + (wordwise if b"ascii" in head else bytewise)(rng, body)


def of(suffix: str, others: Sequence[bytes] = ()) -> Damage:
    """Return the damage for a kind of file; sometimes the file is swapped for one of `others`."""
    kinds: dict[str, Damage] = {".png": png, ".tif": tiff, ".npz": npz, ".ply": ply, ".jpg": bytewise}
    own = kinds.get(suffix, wordwise)

    def damage(rng: Random, data: bytes) -> bytes:
        if others and rng.random() < 0.02:
            return rng.choice(others)
        return own(rng, data)

    return damage

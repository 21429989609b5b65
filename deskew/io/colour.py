"""ICC colour profiles: the bytes that say what a picture's numbers look like; they are carried along, never applied.

A profile that is damaged or of another kind of picture is no profile: the picture is read as one without.
"""

from __future__ import annotations

import struct
from pathlib import Path

from deskew.io import pngtags
from deskew.io.files import read_head

MAX_PROFILE_BYTES = 1 << 22
"""Largest profile that is carried along; a printer's with its tables has 2 MB."""

_HEADER_BYTES = 128  # ICC.1:2022, section 7.2: size at 0, colour space at 16, signature at 36
_SPACES = {1: b"GRAY", 3: b"RGB "}


def is_profile(data: bytes, n_channels: int) -> bool:
    """Tell whether bytes are the ICC profile of a picture with 1 or 3 channels, as far as its header says."""
    whole = _HEADER_BYTES <= len(data) <= MAX_PROFILE_BYTES and struct.unpack_from(">I", data) == (len(data),)
    return whole and data[36:40] == b"acsp" and data[16:20] == _SPACES.get(n_channels)


def read_profile(path: Path) -> bytes | None:
    """Read the colour profile of a PNG, None if it has no sound one.

    Raises
    ------
    InputError
        If the file is missing or unreadable.
    """
    head = read_head(path, 2 * MAX_PROFILE_BYTES)  # the profile comes before the pixels
    found = pngtags.profile(head, MAX_PROFILE_BYTES)
    return found if found is not None and is_profile(found, pngtags.n_channels(head)) else None

"""Seeds that the organiser of a comparison commits to before methods are handed in, and reveals after.

    python -m experiments.hidden_seeds draw FILE [COUNT]    # writes the seeds, prints the SHA-256 to publish
    python -m experiments.hidden_seeds check FILE SHA256    # exit code 1 if the file is not what was published

A seed has 32 bits, few enough to be guessed from a digest of seeds alone, so the file also holds 256 random bits.
Seeds below 1000 are for development and never drawn. See RULES.md.
"""

from __future__ import annotations

import hashlib
import hmac
import os
import re
import secrets
import sys
from collections.abc import Sequence
from pathlib import Path

from deskew.errors import DeskewError, InputError, require
from deskew.io import write_bytes
from deskew.io.files import read_bytes, shown

N_OPEN = 1000
"""Seeds below are open: whoever develops a method may use them."""

_N_MOST = 1000
_SALT = "salt "


def drawn(count: int) -> str:
    """Return the text of a file of hidden seeds: a salt, then a seed a line, no two equal.

    Parameters
    ----------
    count : int
        Seeds, in [1, 1000].
    """
    require(1 <= count <= _N_MOST, "COUNT", f"be a whole number in [1, {_N_MOST}]", count)
    seeds = secrets.SystemRandom().sample(range(N_OPEN, 2**32), count)
    return "\n".join([f"{_SALT}{secrets.token_hex(32)}", *map(str, seeds)]) + "\n"


def digest(content: bytes) -> str:
    """Return the SHA-256 that commits to a file."""
    return hashlib.sha256(content).hexdigest()


def main(arguments: Sequence[str]) -> int:
    """Draw seeds or check a file against what was published; 0, 1 if it does not agree, 2 for wrong input."""
    try:
        match list(arguments):
            case ["draw", file]:
                return _draw(Path(file), "1")
            case ["draw", file, count]:
                return _draw(Path(file), count)
            case ["check", file, published]:
                return _check(Path(file), published)
        raise InputError(f"The arguments must be draw FILE [COUNT] or check FILE SHA256, got {' '.join(arguments)}.")
    except DeskewError as error:
        print(error, file=sys.stderr)
        return error.exit_code


def _draw(path: Path, count: str) -> int:
    whole = count.isascii() and count.isdigit() and len(count) <= len(str(_N_MOST))
    require(whole, "COUNT", f"be a whole number in [1, {_N_MOST}]", shown(count))
    require(
        not os.path.lexists(path), str(path), "not be there: seeds that were committed to are not drawn again", "a file"
    )
    content = drawn(int(count)).encode()
    write_bytes(content, path)
    print(digest(content))
    return 0


def _check(path: Path, published: str) -> int:
    require(re.fullmatch(r"[0-9a-f]{64}", published) is not None, "SHA256", "be 64 hexadecimal digits", published)
    agrees = hmac.compare_digest(digest(read_bytes(path)), published)
    print("They agree." if agrees else f"`{path}` is not the file that was committed to.")
    return int(not agrees)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

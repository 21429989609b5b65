"""Photographs of real printed documents with their true words: what the reading machine makes of them as they are.

Nobody measured their shape, so nothing is restored: the figures are the engine's floor on flat and crumpled paper. True
words come without an order that a reader could be held to (an invoice has columns, and a reader that takes them one by
one is as right as one that reads across), so words are compared as bags, not letters in a row.
"""

from __future__ import annotations

import json
import struct
from pathlib import Path

import cv2
import numpy as np

from deskew import metrics
from deskew.errors import InputError, in_one_line, require
from deskew.io.files import MAX_TEXT_BYTES, read_bytes
from deskew.metrics import OcrEngine
from deskew.types import Array
from experiments.trials import Recorder

SOURCE = "FelixHertlein/inv3d-model @ bca21b5, input/inv3d_real/data"
_WORDS, _FLAT = "ground_truth_words.json", "flat_document.png"
# A capital of the invoices' body text, flat and in the photographs alike.
_CAPITAL_PX = 24.0
_MAX_PIXELS = 1 << 28


def documents(folder: Path) -> list[Path]:
    """Return the folders of the documents in the order of their names.

    Raises
    ------
    InputError
        If `folder` is none, or holds no document.
    """
    require(folder.is_dir(), "ocr.real_path", "be a folder", folder)
    found = sorted(path.parent for path in folder.glob(f"*/{_WORDS}"))
    require(bool(found), "ocr.real_path", f"hold folders with {_WORDS}, as {SOURCE} does", folder)
    return found


def pictures(document: Path) -> dict[str, Path]:
    """Return a document's pictures by what was done to the paper: `flat`, `crumpleseasy`, `crumpleshard`, ..."""
    warped = sorted(document.glob("warped_document_*.jpg"))
    return {"flat": document / _FLAT} | {path.stem.split("_")[2]: path for path in warped}


def measure_document(record: Recorder, engine: OcrEngine, document: Path) -> None:
    """Read a document's pictures and record them as `real/KIND`: words found among the true ones."""
    words = true_words(document / _WORDS)
    for kind, path in pictures(document).items():
        condition = f"real/{kind}"
        with record.attempt(condition), record.stage("ocr", condition):
            read = engine.read(grey_photograph(path), _CAPITAL_PX).split()
            record.add(condition, "-", metrics.match_words(read, words) | {"words": len(words)})


def true_words(path: Path) -> list[str]:
    """Return the words of a document, in no order.

    Raises
    ------
    InputError
        If the file is no JSON list of objects with a `text`.
    """
    try:
        words = [entry["text"] for entry in json.loads(read_bytes(path, MAX_TEXT_BYTES))]
    except InputError:
        raise
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise InputError(f"`{path}` must be a list of words, each with its text, got {in_one_line(error)}.") from error
    require(all(isinstance(word, str) for word in words), str(path), "hold texts", "others")
    return words


def grey_photograph(path: Path) -> Array:
    """Return a photograph, JPEG or PNG, as (height, width) uint8.

    Raises
    ------
    InputError
        If it is missing, damaged, or larger than `_MAX_PIXELS`.
    """
    data = read_bytes(path)
    n_pixels = _declared_pixels(data)
    require(n_pixels <= _MAX_PIXELS, str(path), f"have at most {_MAX_PIXELS} pixels", n_pixels)
    level = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)  # the error below says it in one line
    try:
        image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_GRAYSCALE) if data else None
    except cv2.error:
        image = None
    finally:
        cv2.utils.logging.setLogLevel(level)
    if image is None:
        raise InputError(f"`{path}` must be a readable image, got damaged data.")
    return np.asarray(image)


def _declared_pixels(data: bytes) -> int:
    """Pixels of a PNG, or the most that a frame of a JPEG declares; none of what is neither."""
    if data.startswith(b"\x89PNG"):
        width, height = struct.unpack(">II", data[16:24].ljust(8, b"\0"))
        return int(width * height)
    most, at = 0, 2
    while data.startswith(b"\xff\xd8") and at + 9 <= len(data) and data[at] == 0xFF:
        marker, length, height, width = data[at + 1], *struct.unpack(">HxHH", data[at + 2 : at + 9])
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            most = max(most, width * height)
        at += 2 + length
    return most

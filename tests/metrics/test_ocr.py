"""The reading machines: each by its own name, the same in every run, both with one model."""

from __future__ import annotations

import os
from importlib.util import find_spec
from shutil import which

import numpy as np
import numpy.typing as npt
import pytest

from data_synth.lettering import set_words
from deskew.errors import InputError
from deskew.metrics import OcrEngine, OcrSettings, count_misses, ocr, ocr_engine

WORDS = ("HELMET", "OXEN", "GROUND", "ZEBRA", "PLATE", "WATCH")
MODEL_SHA256 = "7d4322bd2a7749724879683fc3912cb542f19906c83bcc1a52132556427170b2"
PX_PER_MM = 2.1
needs_program = pytest.mark.skipif(which("tesseract") is None, reason="the program tesseract is not installed")


@pytest.fixture(scope="module")
def page() -> npt.NDArray[np.uint8]:
    """A small page of clean print, capitals 21 px high."""
    text = set_words(WORDS, (160.0, 70.0), capital_mm=10.0, margin_mm=10.0)
    x, y = np.meshgrid(np.arange(336.0), np.arange(147.0))
    side = np.full(x.size, 1.0 / PX_PER_MM)
    ink = text.coverage((x.ravel() + 0.5) / PX_PER_MM, (y.ravel() + 0.5) / PX_PER_MM, side, side)
    return np.rint(220.0 - 200.0 * ink.reshape(x.shape)).astype(np.uint8)


@pytest.fixture(scope="module")
def engine() -> OcrEngine:
    return ocr_engine("tesserocr")


def test_clean_print_is_read_without_a_miss_and_alike_every_time(
    engine: OcrEngine, page: npt.NDArray[np.uint8]
) -> None:
    first = engine.read(page, 10.0 * PX_PER_MM)
    assert count_misses(first, " ".join(WORDS)).total == 0
    # Another picture in between leaves nothing behind.
    engine.read(page[::-1].copy(), 10.0 * PX_PER_MM)
    assert ocr_engine("tesserocr").read(page, 10.0 * PX_PER_MM) == first
    assert engine.read(np.repeat(page[..., None], 3, axis=2), 10.0 * PX_PER_MM) == first


@needs_program
def test_both_engines_hold_one_model_and_agree_within_two_misses(
    engine: OcrEngine, page: npt.NDArray[np.uint8]
) -> None:
    other = ocr_engine("pytesseract")
    assert other.model_sha256 == engine.model_sha256
    # Print, and print so faint and blurred that letters are lost.
    hard = np.rint(120.0 + 0.1 * np.roll(page, 1, axis=0) + 0.1 * page).astype(np.uint8)
    for picture in (page, hard):
        texts = [reader.read(picture, 10.0 * PX_PER_MM) for reader in (engine, other)]
        first, second = (count_misses(text, " ".join(WORDS)).total for text in texts)
        assert abs(first - second) <= 2


@needs_program
def test_the_program_leaves_the_environment_as_it_was(
    page: npt.NDArray[np.uint8], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OMP_THREAD_LIMIT", "3")
    ocr_engine("pytesseract").read(page, 10.0 * PX_PER_MM)
    assert os.environ["OMP_THREAD_LIMIT"] == "3"


def test_an_engine_says_what_a_reading_depends_on() -> None:
    about = ocr_engine("tesserocr", OcrSettings(psm=4)).about()
    assert about["model_sha256"] == MODEL_SHA256
    assert (about["engine"], about["psm"], about["oem"]) == ("tesserocr", 4, 1)
    assert str(about["version"])[:2] == "5."


def test_a_missing_engine_is_named_with_its_line_and_never_replaced(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ocr, "which", lambda _: None)
    with pytest.raises(InputError, match=r"got pytesseract, which is not \(tesserocr is\): apt-get install tesseract"):
        ocr_engine("pytesseract")
    assert ocr_engine("tesserocr").name == "tesserocr"


@pytest.mark.parametrize("name", ["tesserocr", "pytesseract"])
def test_without_any_engine_one_error_says_how_to_install_both(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    absent = {"tesserocr", "pytesseract"}
    monkeypatch.setattr(ocr, "find_spec", lambda module: None if module in absent else find_spec(module))
    with pytest.raises(InputError) as refusal:
        ocr_engine(name)
    for line in ocr.INSTALL.values():
        assert line in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_an_unknown_engine_is_refused() -> None:
    with pytest.raises(InputError, match=r"`ocr\.engine` must be one of tesserocr, pytesseract, got 'readiris'"):
        ocr_engine("readiris")


@pytest.mark.parametrize(
    ("capital_px", "height"), [(5.0, 500), (8.0, 300), (16.0, 300), (21.0, 200), (30.0, 100), (100.0, 50)]
)
def test_capitals_are_brought_to_the_height_that_the_model_reads_best(capital_px: float, height: int) -> None:
    grey = np.zeros((100, 40), np.uint8)
    found = ocr.enlarged(grey, capital_px)
    assert found.shape[0] == height
    assert ocr.UPSCALED_PX[0] <= capital_px * found.shape[0] / 100 <= ocr.UPSCALED_PX[1]


def test_what_is_no_picture_is_refused(engine: OcrEngine) -> None:
    with pytest.raises(InputError, match="`image` must be"):
        engine.read(np.zeros((4, 4)), 12.0)
    with pytest.raises(InputError, match="`capital_px` must be"):
        engine.read(np.zeros((4, 4), np.uint8), 0.0)
    with pytest.raises(InputError, match="`psm` must be"):
        OcrSettings(psm=99)

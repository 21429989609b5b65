from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from data_synth.slides import main, slides
from deskew.acquisition import decode
from deskew.errors import InputError
from deskew.io import read_capture, write_capture
from deskew.types import Array, Frames, PatternKind

SIZE = (96, 64)


def photographed(slide: Array, rng: np.random.Generator) -> Array:
    """What a camera makes of a slide that it sees pixel on pixel: blurred, noisy, neither black nor white."""
    seen = 10 + 0.8 * cv2.GaussianBlur(slide.astype(np.float32), (0, 0), 0.8, borderType=cv2.BORDER_CONSTANT)
    return np.rint(seen + rng.normal(0, 0.7, slide.shape)).astype(np.uint8)


@dataclass(frozen=True, slots=True)
class Photographs:
    slides: Frames

    def __len__(self) -> int:
        return len(self.slides)

    def __iter__(self) -> Iterator[Array]:
        rng = np.random.default_rng(len(self))
        return (photographed(slide, rng) for slide in self.slides)


@pytest.mark.parametrize("pattern", list(PatternKind))
def test_a_camera_that_sees_the_slides_decodes_its_own_pixels(pattern: PatternKind) -> None:
    """The camera is linear and the projector told to be, so every pixel's coordinate is its own place."""
    shown = slides(SIZE, pattern, gamma=1.0)
    columns, rows = Photographs(shown.columns), Photographs(shown.rows)
    rng = np.random.default_rng(1)
    white, black = photographed(shown.white, rng), photographed(shown.black, rng)
    found = decode(replace(shown, white=white, black=black, columns=columns, rows=rows))
    assert found.projector.stray < 0.015
    inside = np.s_[4:-4, 4:-4]
    place_y, place_x = np.mgrid[: SIZE[1], : SIZE[0]]
    assert (found.reason[inside] == 0).all()
    assert np.abs(found.column - place_x)[inside].max() < 0.1
    assert np.abs(found.row - place_y)[inside].max() < 0.1


def test_a_gamma_bends_the_codes_of_fringes_and_no_others() -> None:
    plain, bent = (slides(SIZE, PatternKind.GRAY_PHASE, gamma) for gamma in (1.0, 2.2))
    for flat, curved in zip(plain.columns, bent.columns, strict=True):
        # Light is the share asked for, to the rounding of its code.
        assert np.abs((curved / 255) ** 2.2 - flat / 255).max() < 2.2 * 0.5 / 255 + 0.5 / 255
    sweep = slides(SIZE, PatternKind.LINE_SWEEP)
    assert {*np.unique(np.stack(list(sweep.rows)))} == {0, 255}


def test_the_command_writes_a_folder_whose_names_a_capture_has(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "slides"
    assert main([str(folder), "--projector", *map(str, SIZE)]) == 0
    assert capsys.readouterr().out == f"{folder}: white, black and 26 pictures to project\n"
    found = read_capture(folder)
    assert (found.pattern, found.projector_size, found.camera_size) == (PatternKind.GRAY_CODE, SIZE, SIZE)
    for read, made in zip(found.rows, slides(SIZE, PatternKind.GRAY_CODE).rows, strict=True):
        assert np.array_equal(read, made)
    write_capture(found, tmp_path / "again")
    names = [{p.relative_to(at) for p in at.rglob("*")} for at in (folder, tmp_path / "again")]
    assert names[0] == names[1]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("--pattern stripes", "`pattern` must be one of line_sweep, gray_code, gray_phase, multi_phase, got stripes."),
        ("--projector 1 768", "`projector_size` must be 2 to 8192 pixels each way, got (1, 768)."),
        ("--gamma 0.1", "`gamma` must be in [0.5, 4], got 0.1."),
        ("--projector 64", "The arguments must be as --help shows, got: argument --projector: expected 2 arguments."),
    ],
)
def test_a_wrong_option_is_one_line_and_leaves_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: str, message: str
) -> None:
    assert main([str(tmp_path / "slides"), *options.split()]) == InputError.exit_code
    assert capsys.readouterr().err == f"error: {message}\n"
    assert list(tmp_path.iterdir()) == []

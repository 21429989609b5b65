from __future__ import annotations

import errno
import gc
import os
import shutil
import tracemalloc
import weakref
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from deskew.errors import InputError, StepError
from deskew.io import read_capture, write_capture
from deskew.types import Array, Capture, PatternKind

MakeCapture = Callable[..., Capture]
Break = Callable[[Path], object]


def everything(capture: Capture) -> list[Array]:
    return [capture.white, capture.black, *capture.columns, *capture.rows, *capture.textures.values()]


def edit(name: str, old: str, new: str) -> Break:
    def change(folder: Path) -> None:
        text = (folder / name).read_text()
        assert old in text
        (folder / name).write_text(text.replace(old, new))

    return change


def image(name: str, shape: tuple[int, ...], dtype: type = np.uint8) -> Break:
    return lambda folder: cv2.imwrite(str(folder / name), np.zeros(shape, dtype))


def data(name: str, content: bytes) -> Break:
    return lambda folder: (folder / name).write_bytes(content)


def remove(name: str) -> Break:
    return lambda folder: (folder / name).unlink()


def rename(name: str, other: str) -> Break:
    return lambda folder: (folder / name).rename(folder / other)


def cut(name: str) -> Break:
    return lambda folder: os.truncate(folder / name, (folder / name).stat().st_size - 9)


def link(name: str, target: str) -> Break:
    def change(folder: Path) -> None:
        (folder / name).unlink()
        (folder / name).symlink_to(target)

    return change


def link_outside(name: str) -> Break:
    def change(folder: Path) -> None:
        shutil.move(folder / name, folder.parent / "elsewhere.png")
        (folder / name).symlink_to(folder.parent / "elsewhere.png")

    return change


def fifo(name: str) -> Break:
    def change(folder: Path) -> None:
        (folder / name).unlink()
        os.mkfifo(folder / name)

    return change


TOML = "capture.toml"
WRONG_GRAY: dict[str, tuple[Break, str]] = {
    "no folder": (lambda f: shutil.rmtree(f), r"gray_page` must be a folder, got nothing there"),
    "no capture.toml": (remove(TOML), r"capture\.toml` must be a file, got nothing there"),
    "empty capture.toml": (data(TOML, b""), r"must have the keys .*, got none named camera_size_px"),
    "binary capture.toml": (data(TOML, b"\xff\xfe\x00"), "must be valid TOML"),
    "unclosed toml": (edit(TOML, "lights = [", "lights = [["), "must be valid TOML"),
    "toml nested without end": (data(TOML, b"a = " + b"[" * 100_000), "must be valid TOML, got .*nesting too deep"),
    "toml of 2 MB": (data(TOML, b"#" * (2 << 20)), "must have at most 1048576 bytes, got 2097152"),
    "toml with endless digits": (edit(TOML, "version = 1", "version = " + "1" * 5000), "must be valid TOML"),
    "repeated key": (edit(TOML, "version = 1", "version = 1\nversion = 1"), "must be valid TOML"),
    "unknown version": (edit(TOML, "version = 1", "version = 2"), r"version` must be 1, got 2"),
    "version true": (edit(TOML, "version = 1", "version = true"), r"version` must be 1, got True"),
    "misspelt key": (edit(TOML, "lights", "light"), r"must have the keys .*, got also 'light'"),
    "unknown pattern": (edit(TOML, "gray_code", "grey_code"), r"pattern` must be one of line_sweep, gray_code"),
    "pattern not a string": (edit(TOML, '"gray_code"', "[1]"), r"pattern` must be one of"),
    "zero camera": (
        edit(TOML, "[12, 8]", "[12, 0]"),
        r"camera_size_px` must be two integers in \[1, 65536\], got \[12, 0\]",
    ),
    "negative projector": (edit(TOML, "[6, 5]", "[-6, 5]"), r"projector_size_px` must be two integers"),
    "fractional size": (edit(TOML, "[6, 5]", "[6.0, 5]"), r"projector_size_px` must be two integers"),
    "size of three": (edit(TOML, "[6, 5]", "[6, 5, 4]"), r"projector_size_px` must be two integers"),
    "size a date": (edit(TOML, "[6, 5]", "2001-07-09"), r"projector_size_px` must be two integers"),
    "enormous projector": (edit(TOML, "[6, 5]", "[99999999999, 5]"), r"projector_size_px` must be two integers"),
    "larger projector": (edit(TOML, "[6, 5]", "[9, 5]"), r"gray` must hold 14 frames, 00.png to 13.png, got 12 images"),
    "smaller projector": (edit(TOML, "[6, 5]", "[4, 4]"), r"gray` must hold 8 frames, .* got 12 images, also '08.png'"),
    "other camera": (edit(TOML, "[12, 8]", "[8, 12]"), r"white\.png` must be 8x12 px, got 12x8 px"),
    "no white": (remove("white.png"), r"white\.png` must be a file, got nothing there"),
    "white a folder": (
        lambda f: (f / "white.png").unlink() or (f / "white.png").mkdir(),
        "must be a file, got a folder",
    ),
    "white a pipe": (fifo("white.png"), "must be a file, got something else"),
    "white linked to itself": (link("white.png", "white.png"), "must be a file, got something else"),
    "white linked to nothing": (link("white.png", "gone.png"), "must be a file, got something else"),
    "white empty": (data("white.png", b""), r"white\.png` must be a PNG image, got 0 bytes"),
    "white a JPEG": (data("white.png", b"\xff\xd8\xff\xe0" + bytes(99)), r"white\.png` must be a PNG image"),
    "white cut": (cut("white.png"), r"white\.png` must be a whole PNG, got its end after"),
    "black of another size": (image("black.png", (9, 12)), r"black\.png` must be 12x8 px, got 12x9 px"),
    "black in colour": (image("black.png", (8, 12, 3)), r"black\.png` must have the white image's shape \(8, 12\)"),
    "black in 16 bits": (image("black.png", (8, 12), np.uint16), r"black\.png` must have the white image's type uint8"),
    "no frames": (lambda f: shutil.rmtree(f / "gray"), r"gray` must be a folder, got nothing there"),
    "frames a file": (
        lambda f: shutil.rmtree(f / "gray") or (f / "gray").touch(),
        r"gray` must be a folder, got a file",
    ),
    "frame missing": (remove("gray/07.png"), r"gray` must hold 12 frames, .* got 11 images, '07\.png' missing"),
    "last frame missing": (remove("gray/11.png"), r"got 11 images, '11\.png' missing"),
    "frame too many": (image("gray/12.png", (8, 12)), r"got 13 images, also '12\.png'"),
    "frame doubled": (image("gray/07 (1).png", (8, 12)), r"got 13 images, also '07 \(1\)\.png'"),
    "frame not padded": (rename("gray/07.png", "gray/7.png"), r"'07\.png' missing"),
    "frame a JPEG": (rename("gray/07.png", "gray/07.jpg"), r"'07\.png' missing"),
    "frame in capitals": (rename("gray/07.png", "gray/07.PNG"), r"'07\.png' missing"),
    "numbered from 1": (rename("gray/00.png", "gray/12.png"), r"'00\.png' missing"),
    "name of control characters": (rename("gray/00.png", "gray/\n\x1b[31m.png"), r"missing"),
    "frame linked outside": (
        link_outside("gray/03.png"),
        r"gray/03\.png` must stay inside .*gray_page, got .*elsewhere",
    ),
    "white linked outside": (link_outside("white.png"), r"white\.png` must stay inside"),
    "light outside": (edit(TOML, '"raking"', '"../../raking"'), r"lights` must be a list of names made of letters"),
    "light absolute": (edit(TOML, '"raking"', '"/etc/passwd"'), r"lights` must be a list of names"),
    "light empty": (edit(TOML, '"raking"', '""'), r"lights` must be a list of names"),
    "lights a string": (edit(TOML, '["raking"]', '"raking"'), r"lights` must be a list of names"),
    "light twice": (edit(TOML, '"raking"', '"raking", "raking"'), r"lights` must be at most 256 different names"),
    "light without image": (edit(TOML, '"raking"', '"raking", "uv"'), r"textures/uv\.png` must be a file"),
    "image without light": (edit(TOML, '"raking"', ""), r"lights` must name every image in textures, got no light for"),
    "texture no image": (data("textures/raking.png", b"text"), r"raking\.png` must be a PNG image"),
}

WRONG_FRAMES: dict[str, tuple[Break, str]] = {
    "deleted after opening": (remove("columns/0004.png"), r"columns/0004\.png` must be a file, got nothing there"),
    "cut": (cut("rows/0002.png"), r"rows/0002\.png` must be a whole PNG"),
    "another size": (image("rows/0002.png", (8, 13)), r"rows/0002\.png` must be 12x8 px, got 13x8 px"),
    "colour": (image("columns/0003.png", (8, 12, 3)), r"columns/0003\.png` must have the white image's shape"),
    "16 bits": (image("columns/0003.png", (8, 12), np.uint16), r"columns/0003\.png` must have the white image's type"),
    "a text": (data("columns/0003.png", b"not an image"), r"columns/0003\.png` must be a PNG image"),
}


@pytest.mark.parametrize("channels", [0, 3], ids=["grey", "colour"])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("pattern", list(PatternKind))
def test_a_capture_comes_back_as_it_was_written(
    tmp_path: Path, new_capture: MakeCapture, pattern: PatternKind, dtype: type, channels: int
) -> None:
    capture = new_capture(pattern, dtype, channels, lights=("uv", "raking"))
    write_capture(capture, tmp_path / "page")
    found = read_capture(tmp_path / "page")
    assert (found.pattern, found.projector_size, found.camera_size) == (pattern, (6, 5), (12, 8))
    assert found.fringes == capture.fringes
    assert list(found.textures) == ["uv", "raking"]
    for ours, theirs in zip(everything(capture), everything(found), strict=True):
        assert ours.dtype == theirs.dtype
        assert np.array_equal(ours, theirs)


def test_frames_lie_on_disk_under_the_documented_names(
    tmp_path: Path, gray_folder: Path, sweep_folder: Path, new_capture: MakeCapture
) -> None:
    assert sorted(p.name for p in (sweep_folder / "columns").iterdir()) == [f"000{i}.png" for i in range(6)]
    assert sorted(p.name for p in (sweep_folder / "rows").iterdir()) == [f"000{i}.png" for i in range(5)]
    assert sorted(p.name for p in (gray_folder / "gray").iterdir()) == [f"{i:02d}.png" for i in range(12)]
    capture = new_capture()
    first_row = cv2.imread(str(gray_folder / "gray" / "06.png"), cv2.IMREAD_UNCHANGED)
    assert np.array_equal(first_row, capture.rows[0])  # 6 column planes stand before it


def test_any_width_of_zero_padding_is_read_in_order(sweep_folder: Path) -> None:
    before = list(read_capture(sweep_folder).columns)
    for path in sorted((sweep_folder / "columns").iterdir()):
        path.rename(path.with_name(f"{int(path.stem)}.png"))
    assert all(np.array_equal(a, b) for a, b in zip(before, read_capture(sweep_folder).columns, strict=True))


def test_what_desktops_leave_behind_is_no_frame(sweep_folder: Path) -> None:
    (sweep_folder / "columns" / ".DS_Store").touch()
    (sweep_folder / "columns" / "._0000.png").touch()
    (sweep_folder / "columns" / "Thumbs.db").touch()
    assert len(list(read_capture(sweep_folder).columns)) == 6


def test_a_capture_folder_may_itself_be_a_link(sweep_folder: Path, tmp_path: Path) -> None:
    (tmp_path / "linked").symlink_to(sweep_folder)
    assert len(list(read_capture(tmp_path / "linked").rows)) == 5


def test_frames_are_read_anew_in_every_pass(sweep_folder: Path) -> None:
    columns = read_capture(sweep_folder).columns
    first = list(columns)
    image("columns/0002.png", (8, 12))(sweep_folder)
    second = list(columns)
    assert [np.array_equal(a, b) for a, b in zip(first, second, strict=True)] == [True, True, False, True, True, True]


def test_textures_are_read_when_asked_for(gray_folder: Path) -> None:
    textures = read_capture(gray_folder).textures
    assert textures["raking"].shape == (17, 31)
    (gray_folder / "textures" / "raking.png").unlink()
    with pytest.raises(InputError, match=r"raking\.png` must be a file, got nothing there"):
        textures["raking"]


def test_reading_holds_a_few_frames_at_most(tmp_path: Path) -> None:
    noise = np.random.default_rng(0).integers(0, 255, (128, 256), dtype=np.uint8)
    frames = [noise] * 64
    write_capture(Capture(noise, noise, (64, 64), PatternKind.LINE_SWEEP, frames, frames), tmp_path / "page")
    found = read_capture(tmp_path / "page")
    tracemalloc.start()
    n_frames = sum(1 for frame in found.columns)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert n_frames == 64
    assert noise.nbytes < peak < 10 * noise.nbytes  # compressed, verified and decoded copies of one frame


def test_writing_holds_one_frame_at_a_time(tmp_path: Path, new_capture: MakeCapture) -> None:
    capture = new_capture(PatternKind.LINE_SWEEP)
    alive: list[weakref.ref[Array]] = []
    most = []

    class Rendered:
        def __len__(self) -> int:
            return 6

        def __iter__(self) -> Iterator[Array]:
            for _ in range(6):
                gc.collect()
                most.append(sum(ref() is not None for ref in alive))
                frame = np.zeros((8, 12), np.uint8)
                alive.append(weakref.ref(frame))
                yield frame

    write_capture(replace(capture, columns=Rendered()), tmp_path / "page")
    assert len(alive) == 6
    assert max(most) <= 1


@pytest.mark.parametrize("case", list(WRONG_GRAY))
def test_a_wrong_folder_is_refused_when_it_is_opened(gray_folder: Path, case: str) -> None:
    break_it, message = WRONG_GRAY[case]
    break_it(gray_folder)
    with pytest.raises(InputError, match=message) as caught:
        read_capture(gray_folder)
    assert len(str(caught.value)) < 600


@pytest.mark.parametrize("case", list(WRONG_FRAMES))
def test_a_wrong_frame_is_named_when_it_is_reached(sweep_folder: Path, case: str) -> None:
    capture = read_capture(sweep_folder)
    break_it, message = WRONG_FRAMES[case]
    break_it(sweep_folder)
    with pytest.raises(InputError, match=message):
        everything(capture)


def test_a_wrong_frame_stops_the_writer_and_leaves_nothing(tmp_path: Path, new_capture: MakeCapture) -> None:
    capture = new_capture()
    rows = [*list(capture.rows)[:-1], np.zeros((8, 13), np.uint8)]
    with pytest.raises(InputError, match=r"gray/11\.png` must have the white image's shape \(8, 12\), got \(8, 13\)"):
        write_capture(replace(capture, rows=rows), tmp_path / "page")
    assert list(tmp_path.iterdir()) == []


def test_a_filled_folder_is_never_written_into(tmp_path: Path, new_capture: MakeCapture) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match="must be new or an empty folder, got a folder"):
        write_capture(new_capture(), tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["notes.txt"]


def test_a_full_disk_is_a_failed_step_that_leaves_nothing(
    tmp_path: Path, new_capture: MakeCapture, monkeypatch: pytest.MonkeyPatch
) -> None:
    write = Path.write_bytes

    def until_full(path: Path, content: bytes) -> int:
        if path.name == "09.png":
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write(path, content)

    monkeypatch.setattr(Path, "write_bytes", until_full)
    with pytest.raises(StepError, match="page` failed: No space left on device"):
        write_capture(new_capture(), tmp_path / "page")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("light", ["../up", "", "a/b", ".hidden", "x" * 65])
def test_a_light_that_is_no_file_name_is_not_written(tmp_path: Path, new_capture: MakeCapture, light: str) -> None:
    with pytest.raises(InputError, match="`textures` must have names made of letters"):
        write_capture(new_capture(lights=(light,)), tmp_path / "page")
    assert list(tmp_path.iterdir()) == []


def test_written_files_obey_the_umask(gray_folder: Path) -> None:
    umask = os.umask(0)
    os.umask(umask)
    assert gray_folder.stat().st_mode & 0o777 == 0o777 & ~umask
    assert (gray_folder / "white.png").stat().st_mode & 0o777 == 0o666 & ~umask


def test_a_misspelt_key_of_the_fringes_does_not_pass(tmp_path: Path, new_capture: MakeCapture) -> None:
    write_capture(new_capture(PatternKind.GRAY_PHASE, np.uint8, 0), tmp_path / "page")
    path = tmp_path / "page" / "capture.toml"
    path.write_text(path.read_text().replace("[fringes]", "[fringes]\nn_step = 3"))
    with pytest.raises(InputError, match=r"fringes` must have the keys n_steps, period_px, got also .*n_step"):
        read_capture(tmp_path / "page")

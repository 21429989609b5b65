"""Capture folders: what a camera saw of one still page, on disk.

``capture.toml`` states sizes, pattern and lights; beside it lie ``white.png`` and ``black.png``, the frames in
``columns/`` and ``rows/`` (line sweep: one frame a projector column and row; phase patterns: as `Capture` orders them)
or in ``gray/`` (Gray code: columns then rows, most significant bit first, each pattern followed by its inverse), named
by their zero-padded number from 0, and ``textures/LIGHT.png``, at any resolution, for every named light.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from deskew.errors import InputError, require
from deskew.io.colour import read_profile
from deskew.io.fields import Fields
from deskew.io.files import read_toml, replacing_folder, require_folder, require_inside, shown
from deskew.io.images import picture_bytes, png_size, read_image, require_picture
from deskew.types import WHITE, Array, Capture, Frames, Fringe, Fringes, PatternKind, Size, n_frames, require_fringes

CAPTURE_VERSION = 1
MAX_LIGHTS = 256
MAX_FRINGES = 16

_IMAGE_NAMES = (".png", ".tif", ".tiff", ".jpg", ".jpeg", ".bmp")
LIGHT_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")


@dataclass(frozen=True, slots=True, eq=False)
class StoredFrames:
    """Frames on disk, read one at a time whenever they are iterated.

    Attributes
    ----------
    paths : tuple of Path
        In projection order.
    like : (height, width[, 3]) array
        What every frame has to have the size, channels and bit depth of: the capture's white image.
    """

    paths: tuple[Path, ...]
    like: Array

    def __len__(self) -> int:
        """Return the number of frames."""
        return len(self.paths)

    def __iter__(self) -> Iterator[Array]:
        """Yield each frame; an InputError names the first one that is missing, damaged or unlike the white image."""
        for path in self.paths:
            frame = read_image(path, size=(self.like.shape[1], self.like.shape[0]))
            _require_like(frame, self.like, str(path))
            yield frame


@dataclass(frozen=True, slots=True)
class StoredTextures(Mapping[str, Array]):
    """Images by light name, decoded whenever they are asked for: they may be far larger than the frames."""

    paths: Mapping[str, Path]

    def __getitem__(self, light: str) -> Array:
        """Read one light's image."""
        return read_image(self.paths[light])

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names of the lights."""
        return iter(self.paths)

    def __len__(self) -> int:
        """Return the number of lights."""
        return len(self.paths)


def _require_like(frame: Array, like: Array, name: str) -> None:
    require(frame.shape == like.shape, name, f"have the white image's shape {like.shape}", frame.shape)
    require(frame.dtype == like.dtype, name, f"have the white image's type {like.dtype}", frame.dtype)


def read_pair(white_path: Path, black_path: Path, size: Size) -> tuple[Array, Array]:
    """Read the white and the black image of one capture, alike in size, channels and bit depth."""
    white, black = read_image(white_path, size=size), read_image(black_path, size=size)
    _require_like(black, white, str(black_path))
    return white, black


def _images_in(folder: Path) -> list[str]:
    """Names of the images in a folder; hidden files and what desktops leave behind are no images."""
    require_folder(folder)
    return sorted(p.name for p in folder.iterdir() if p.suffix.lower() in _IMAGE_NAMES and not p.name.startswith("."))


def numbered(folder: Path, n: int, root: Path, prefix: str = "") -> tuple[Path, ...]:
    """Return the paths of exactly `n` images, ``PREFIX0...0.png`` and on, all of one width.

    Raises
    ------
    InputError
        If one is missing, one too many is there, or one leads out of `root`.
    """
    found = _images_in(folder)
    digits = len(found[0]) - len(prefix) - len(".png") if found else 0
    width = max(digits, len(str(n - 1)))
    wanted = [f"{prefix}{i:0{width}d}.png" for i in range(n)]
    missing = sorted(set(wanted) - set(found))
    extra = sorted(set(found) - set(wanted))
    detail = f"{shown(missing[0])} missing" if missing else f"also {shown(extra[0]) if extra else ''}"
    allowed = f"hold {n} frames, {wanted[0]} to {wanted[-1]}"
    require(not missing and not extra, str(folder), allowed, f"{len(found)} images, {detail}")
    paths = tuple(folder / name for name in wanted)
    for path in paths:
        require_inside(path, root)
    return paths


def _lights(fields: Fields, folder: Path) -> StoredTextures:
    lights = fields.values.get("lights", [])
    good = isinstance(lights, list) and all(isinstance(n, str) and LIGHT_NAME.fullmatch(n) for n in lights)
    name = f"{fields.name}: lights"
    require(good, name, "be a list of names made of letters, digits, - and _", shown(lights))
    unique = len(set(lights)) == len(lights) <= MAX_LIGHTS
    require(unique, name, f"be at most {MAX_LIGHTS} different names", shown(lights))
    paths = {light: folder / "textures" / f"{light}.png" for light in lights}
    for path in paths.values():
        require_inside(path, folder)
        png_size(path)  # a missing, foreign or enormous file is refused now, not after the scan
    if (folder / "textures").exists():
        unnamed = sorted(set(_images_in(folder / "textures")) - {path.name for path in paths.values()})
        require(not unnamed, name, "name every image in textures", f"no light for {shown(unnamed[:1])}")
    return StoredTextures(paths)


def _fringes(fields: Fields, pattern: PatternKind, projector_size: Size) -> Fringes:
    """Periods and steps of a phase pattern; the other patterns have none."""
    if pattern in (PatternKind.LINE_SWEEP, PatternKind.GRAY_CODE):
        none = "fringes" not in fields.values
        require(none, f"{fields.name}: fringes", f"be left out for a {pattern}", shown(fields.values.get("fringes")))
        return ()
    table = fields.table("fringes")
    table.only(("period_px", "n_steps"))
    periods, steps = table.numbers("period_px", MAX_FRINGES), table.numbers("n_steps", MAX_FRINGES)
    alike = len(steps) == len(periods)
    require(alike, f"{fields.name}: fringes", "have as many n_steps as period_px", f"{len(steps)} and {len(periods)}")
    try:
        fringes = tuple(Fringe(float(p), n) for p, n in zip(periods, steps, strict=True))  # type: ignore[arg-type]
        require_fringes(pattern, fringes, projector_size)
    except InputError as error:
        raise InputError(f"`{fields.name}`: {error}") from error
    return fringes


def _sweeps(
    folder: Path, pattern: PatternKind, fringes: Fringes, projector_size: Size, white: Array
) -> tuple[Frames, Frames]:
    n_columns, n_rows = (n_frames(pattern, extent, fringes) for extent in projector_size)
    if pattern is PatternKind.GRAY_CODE:
        planes = numbered(folder / "gray", n_columns + n_rows, folder)
        return StoredFrames(planes[:n_columns], white), StoredFrames(planes[n_columns:], white)
    columns = numbered(folder / "columns", n_columns, folder)
    return StoredFrames(columns, white), StoredFrames(numbered(folder / "rows", n_rows, folder), white)


def read_capture(folder: Path) -> Capture:
    """Open a capture folder.

    Names, counts, sizes and the white and black images are checked now; frames are read one at a time when they are
    iterated, as often as they are, and checked then.

    Parameters
    ----------
    folder : Path
        As this module describes it.

    Returns
    -------
    Capture
        `columns` and `rows` are `StoredFrames`, `textures` is a `StoredTextures`.

    Raises
    ------
    InputError
        Naming the file or key at fault.
    """
    folder = Path(folder)
    require_folder(folder)
    require_inside(folder / "capture.toml", folder)
    fields = Fields(read_toml(folder / "capture.toml"), str(folder / "capture.toml"))
    fields.only(("version", "pattern", "camera_size_px", "projector_size_px"), ("lights", "fringes"))
    fields.version("version", CAPTURE_VERSION)
    pattern = PatternKind(fields.word("pattern", tuple(PatternKind)))
    camera_size, projector_size = fields.pair("camera_size_px"), fields.pair("projector_size_px")
    for name in ("white.png", "black.png"):
        require_inside(folder / name, folder)
    white, black = read_pair(folder / "white.png", folder / "black.png", camera_size)
    textures = _lights(fields, folder)
    fringes = _fringes(fields, pattern, projector_size)
    columns, rows = _sweeps(folder, pattern, fringes, projector_size, white)
    pictures = {WHITE: folder / "white.png", **textures.paths}
    profiles = {light: profile for light, path in pictures.items() if (profile := read_profile(path)) is not None}
    return Capture(white, black, projector_size, pattern, columns, rows, textures, fringes, profiles)


def _write_picture(image: Array, path: Path, profile: bytes | None = None) -> None:
    require_picture(image, path.name)
    path.write_bytes(picture_bytes(image, path.suffix, profile))


def _write_frames(frames: Frames, folder: Path, like: Array, names: list[str]) -> None:
    folder.mkdir(exist_ok=True)
    # Capture has checked the count that the frames announce; a generator that yields another is a bug, not an input.
    for name, frame in zip(names, frames, strict=True):
        _require_like(frame, like, f"{folder.name}/{name}")
        _write_picture(frame, folder / name)


def _settings(capture: Capture) -> str:
    lights = ", ".join(f'"{light}"' for light in capture.textures)
    return (
        f'version = {CAPTURE_VERSION}\npattern = "{capture.pattern}"\n'
        f"camera_size_px = {list(capture.camera_size)}\nprojector_size_px = {list(capture.projector_size)}\n"
        f"lights = [{lights}]\n{_fringe_table(capture.fringes)}"
    )


def _fringe_table(fringes: Fringes) -> str:
    if not fringes:
        return ""
    periods, steps = [float(f.period_px) for f in fringes], [int(f.n_steps) for f in fringes]
    return f"\n[fringes]\nperiod_px = {periods}\nn_steps = {steps}\n"


def write_capture(capture: Capture, folder: Path) -> None:
    """Write a capture folder, one frame at a time; it appears whole or not at all.

    Parameters
    ----------
    capture : Capture
        8 or 16 bits, grey or colour (RGB).
    folder : Path
        New, or an empty folder.

    Raises
    ------
    InputError
        If the folder is not empty, a light's name is no file name, or a frame is unlike the white image.
    StepError
        If the file system refuses.
    """
    for light in capture.textures:
        named = bool(LIGHT_NAME.fullmatch(light))
        require(named, "textures", "have names made of letters, digits, - and _", shown(light))
    gray = capture.pattern is PatternKind.GRAY_CODE
    n_columns, n_rows = len(capture.columns), len(capture.rows)
    digits = 2 if gray else max(4, len(str(max(n_columns, n_rows) - 1)))
    first_row = n_columns if gray else 0
    column_names = [f"{i:0{digits}d}.png" for i in range(n_columns)]
    row_names = [f"{i:0{digits}d}.png" for i in range(first_row, first_row + n_rows)]
    with replacing_folder(Path(folder)) as new:
        (new / "capture.toml").write_text(_settings(capture), encoding="utf-8")
        _write_picture(capture.white, new / "white.png", capture.profiles.get(WHITE))
        _write_picture(capture.black, new / "black.png")
        for light, image in capture.textures.items():
            (new / "textures").mkdir(exist_ok=True)
            _write_picture(image, new / "textures" / f"{light}.png", capture.profiles.get(light))
        _write_frames(capture.columns, new / ("gray" if gray else "columns"), capture.white, column_names)
        _write_frames(capture.rows, new / ("gray" if gray else "rows"), capture.white, row_names)

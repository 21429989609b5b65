"""Capture folders from the rig, so that anyone can try ``deskew`` without a projector.

python -m data_synth.captures example/ --pattern gray_code --pages 2 --lights --planes 3
deskew calibrate example/board -o calibration.json
deskew run example/page_00 --calibration calibration.json -o restored.png --light all
deskew run example/page_* --calibration calibration.json -o restored/
deskew accuracy example/flat example/plane_* --calibration calibration.json
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NoReturn, TypeVar

import numpy as np
from tqdm import tqdm

from data_synth.boards import BOARD, board_poses, render_board
from data_synth.folds import crumpled
from data_synth.lights import Format, standard_lights
from data_synth.manuscript import hidden_manuscript
from data_synth.pages import Blank, Checkerboard
from data_synth.render import photograph
from data_synth.rig import Rig, default_rig
from data_synth.sheets import PAGE_SIZE_MM, flat_sheet, plane
from deskew.errors import DeskewError, require
from deskew.io import write_board, write_capture
from deskew.io.files import replacing_folder
from deskew.types import Capture, PatternKind, Pinhole

MAX_PAGES = 100

_FLAT, _PAGES, _BOARDS = 0, 1, 2
_PLANE_MM, _TILT_DEG, _TURN_DEG = (200.0, 150.0), 12.0, 137.5  # a tilted page would leave the camera's frame
_SCALES = (0.1, 1.0)
_T = TypeVar("_T")


def write_example(
    rig: Rig,
    folder: Path,
    *,
    seed: int = 0,
    n_pages: int = 1,
    n_poses: int = 9,
    slope_p90_deg: float = 20.0,
    pattern: PatternKind = PatternKind.LINE_SWEEP,
    n_planes: int = 1,
    lights: bool = False,
) -> None:
    """Write ``board/`` (a calibration folder), ``flat/`` (a blank flat page) and ``page_00/``, ... (crumpled pages).

    Frames are rendered and written one at a time; a line sweep of the default rig takes 180 MB, the other
    patterns some 10. All appear or none.

    Parameters
    ----------
    rig : Rig
        The bench.
    folder : Path
        New, or an empty folder.
    seed : int
        At least 0; the same seed writes the same bytes.
    n_pages : int
        Crumpled pages, each another sheet, in [1, `MAX_PAGES`].
    n_poses : int
        Poses of the board, as :func:`board_poses` allows.
    slope_p90_deg : float
        Severity, as :func:`crumpled` allows.
    pattern : PatternKind
        What the projector shows.
    n_planes : int
        Blank planes, in [1, `MAX_PAGES`]: beyond ``flat/`` tilted ones, ``plane_01/``, ..., each to another side.
    lights : bool
        Pages are manuscripts with hidden writing instead of checkers, and are photographed under
        :func:`standard_lights` too.

    Raises
    ------
    InputError
        If a setting is out of range or the folder is not empty.
    StepError
        If no sheet of that severity is found, or the file system refuses.
    """
    require(seed >= 0, "seed", "be at least 0", seed)
    require(1 <= n_pages <= MAX_PAGES, "n_pages", f"be in [1, {MAX_PAGES}]", n_pages)
    require(1 <= n_planes <= MAX_PAGES, "n_planes", f"be in [1, {MAX_PAGES}]", n_planes)
    poses = board_poses(n_poses)

    def draw(kind: int, i: int) -> np.random.Generator:
        return np.random.default_rng(np.random.SeedSequence([seed, kind, i]))

    def boards() -> Iterator[Capture]:
        for i, pose in enumerate(_watched(poses, "board")):
            yield render_board(rig, pose, draw(_BOARDS, i), pattern=pattern)

    with replacing_folder(folder) as new:
        # The pages first: a severity that cannot be drawn is then known before the minutes that the board takes.
        for i in _watched(range(n_pages), "pages"):
            rng = draw(_PAGES, i)
            sheet = crumpled(rng, PAGE_SIZE_MM, slope_p90_deg)
            page, lamps = (hidden_manuscript(rng), standard_lights()) if lights else (Checkerboard(), ())
            write_capture(photograph(rig, sheet, page, rng, pattern, lights=lamps), new / f"page_{i:02d}")
        for i in _watched(range(n_planes), "planes"):
            tilted = plane(_PLANE_MM, tilt_deg=_TILT_DEG, azimuth_deg=_TURN_DEG * i) if i else flat_sheet()
            name = f"plane_{i:02d}" if i else "flat"
            write_capture(photograph(rig, tilted, Blank(tilted.page_size_mm), draw(_FLAT, i), pattern), new / name)
        write_board(BOARD, boards(), new / "board")


def scaled(rig: Rig, scale: float) -> Rig:
    """Return the bench with `scale` times as many pixels across both devices, which see the same.

    Raises
    ------
    InputError
        If the scale is out of [0.1, 1].
    """
    require(_SCALES[0] <= scale <= _SCALES[1], "scale", f"be in [{_SCALES[0]:g}, {_SCALES[1]:g}]", scale)

    def coarser(device: Pinhole) -> Pinhole:
        width, height = device.size
        # The sensor's corner, half a pixel before the first one's centre, stays where it is.
        corner = (scale - 1.0) / 2.0
        return Format((round(width * scale), round(height * scale)), (scale, scale), (corner, corner)).camera(device)

    return replace(rig, camera=coarser(rig.camera), projector=coarser(rig.projector))


def _watched(items: Iterable[_T], label: str) -> Iterable[_T]:
    """Show progress on a terminal; into a log or a pipe write nothing."""
    return tqdm(items, label, file=sys.stderr, leave=False, disable=None)


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line, as every command of the project does."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message} (--help shows what is allowed)\n")


def main(argv: Sequence[str] | None = None) -> int:
    """Run ``python -m data_synth.captures`` and return its exit code: 0 done, 2 wrong input, 3 a step failed."""
    parser = _Parser(
        prog="data_synth.captures",
        description="Render a calibration folder and capture folders, to try deskew without a camera and a projector. "
        "A capture takes 10 MB and 2 s as a Gray code, 180 MB and 20 s as a line sweep; with --scale 0.5 a fifth.",
        epilog="Example: python -m data_synth.captures example/ --pattern gray_code --pages 2 --lights",
        allow_abbrev=False,
    )
    parser.add_argument("folder", type=Path, help="new or empty folder; gets board/, flat/, page_00/, ...")
    parser.add_argument("--lights", action="store_true", help="pages with hidden writing, under four lamps too")
    parser.add_argument("--planes", type=int, default=1, help="blank planes: flat/, plane_01/, ... [%(default)s]")
    parser.add_argument("--scale", type=float, default=1.0, help="pixels across for each of 640 and 1024 [%(default)s]")
    parser.add_argument("--seed", type=int, default=0, help="same seed, same bytes [%(default)s]")
    parser.add_argument("--pages", type=int, default=1, help="crumpled pages [%(default)s]")
    parser.add_argument("--poses", type=int, default=9, help="poses of the printed board [%(default)s]")
    parser.add_argument("--slope-p90-deg", type=float, default=20.0, help="how crumpled: 1 to 45 [%(default)s]")
    parser.add_argument(
        "--pattern",
        choices=[str(kind) for kind in PatternKind],
        default=str(PatternKind.LINE_SWEEP),
        help="what the projector shows [%(default)s]",
    )
    chosen = parser.parse_args(argv)
    try:
        write_example(
            scaled(default_rig(), chosen.scale),
            chosen.folder,
            seed=chosen.seed,
            n_pages=chosen.pages,
            n_poses=chosen.poses,
            slope_p90_deg=chosen.slope_p90_deg,
            pattern=PatternKind(chosen.pattern),
            n_planes=chosen.planes,
            lights=chosen.lights,
        )
    except DeskewError as error:
        print(f"{parser.prog}: {error}", file=sys.stderr)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())

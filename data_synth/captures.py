"""Capture folders from the rig, so that anyone can try ``deskew`` without a projector.

python -m data_synth.captures example/
deskew calibrate example/board -o calibration.json
deskew run example/page_00 --calibration calibration.json -o restored.png
deskew accuracy example/flat --calibration calibration.json
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NoReturn, TypeVar

import numpy as np
from tqdm import tqdm

from data_synth.boards import BOARD, board_poses, render_board
from data_synth.folds import crumpled
from data_synth.pages import Blank, Checkerboard
from data_synth.render import photograph
from data_synth.rig import Rig, default_rig
from data_synth.sheets import PAGE_SIZE_MM, flat_sheet
from deskew.errors import DeskewError, require
from deskew.io import write_board, write_capture
from deskew.io.files import replacing_folder
from deskew.types import Capture, PatternKind

MAX_PAGES = 100

_FLAT, _PAGES, _BOARDS = 0, 1, 2
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
) -> None:
    """Write ``board/`` (a calibration folder), ``flat/`` (a blank flat page) and ``page_00/``, ... (crumpled checkers).

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

    Raises
    ------
    InputError
        If a setting is out of range or the folder is not empty.
    StepError
        If no sheet of that severity is found, or the file system refuses.
    """
    require(seed >= 0, "seed", "be at least 0", seed)
    require(1 <= n_pages <= MAX_PAGES, "n_pages", f"be in [1, {MAX_PAGES}]", n_pages)
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
            write_capture(photograph(rig, sheet, Checkerboard(), rng, pattern), new / f"page_{i:02d}")
        write_capture(photograph(rig, flat_sheet(), Blank(), draw(_FLAT, 0), pattern), new / "flat")
        write_board(BOARD, boards(), new / "board")


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
        description="Render a calibration folder and capture folders (a line sweep: 180 MB and 20 s each).",
        epilog="Example: python -m data_synth.captures example/ --poses 8 --pages 2",
        allow_abbrev=False,
    )
    parser.add_argument("folder", type=Path, help="new or empty folder; gets board/, flat/, page_00/, ...")
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
            default_rig(),
            chosen.folder,
            seed=chosen.seed,
            n_pages=chosen.pages,
            n_poses=chosen.poses,
            slope_p90_deg=chosen.slope_p90_deg,
            pattern=PatternKind(chosen.pattern),
        )
    except DeskewError as error:
        print(f"{parser.prog}: {error}", file=sys.stderr)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""The pictures that a real projector has to show, as files named like the photographs that are taken of them.

    python -m data_synth.slides slides --projector 1024 768 --pattern gray_code

writes a capture folder as a camera would record it that saw just what the projector shows. Photograph each picture and
save the photograph under the picture's name: that folder, with the camera's size in its `capture.toml`, is a capture.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from data_synth.patterns import default_fringes, projected_lines
from data_synth.surfaces import CommandParser
from deskew.errors import DeskewError, require
from deskew.io import write_capture
from deskew.types import Capture, Floats, PatternKind, Size

LARGEST_PX = 8192
GAMMA_RANGE = (0.5, 4.0)


@dataclass(frozen=True, slots=True)
class Slides:
    """Pictures of one axis, made one at a time.

    Attributes
    ----------
    codes : (frames, extent) uint8 array
        Of each projector line in each picture.
    size : (width, height)
        Of the projector [px].
    upright : bool
        The lines are columns.
    """

    codes: npt.NDArray[np.uint8]
    size: Size
    upright: bool

    def __len__(self) -> int:
        """Return the number of pictures."""
        return len(self.codes)

    def __iter__(self) -> Iterator[npt.NDArray[np.uint8]]:
        """Yield the pictures (height, width)."""
        width, height = self.size
        for line in self.codes:
            yield np.broadcast_to(line if self.upright else line[:, np.newaxis], (height, width))


def slides(projector_size: Size, pattern: PatternKind, gamma: float = 2.2) -> Capture:
    """Return what a projector has to show, as a capture by a camera that sees just that.

    Parameters
    ----------
    projector_size : (width, height)
        Pixels, up to `LARGEST_PX` each way.
    pattern : PatternKind
        Kind; fringes are those of :func:`default_fringes`.
    gamma : float
        Exponent of the projector, in [0.5, 4]: code c is answered by light ``(c / 255) ** gamma``. It shapes fringes
        alone; what is wrong with it is found in the frames and said by every command.

    Raises
    ------
    InputError
        If an argument is out of range.
    """
    good = all(2 <= n <= LARGEST_PX for n in projector_size)
    require(good, "projector_size", f"be 2 to {LARGEST_PX} pixels each way", projector_size)
    require(GAMMA_RANGE[0] <= gamma <= GAMMA_RANGE[1], "gamma", "be in [0.5, 4]", gamma)
    fringes = default_fringes(pattern, projector_size)

    def lines(extent: int) -> Floats:
        return np.eye(extent) if pattern is PatternKind.LINE_SWEEP else projected_lines(pattern, extent, fringes)

    width, height = projector_size
    columns, rows = (np.rint(255 * lines(n) ** (1 / gamma)).astype(np.uint8) for n in projector_size)
    black = np.zeros((height, width), dtype=np.uint8)
    both = Slides(columns, projector_size, True), Slides(rows, projector_size, False)
    return Capture(np.full_like(black, 255), black, projector_size, pattern, *both, fringes=fringes)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    parser = CommandParser(prog="python -m data_synth.slides", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("folder", type=Path, help="new or empty")
    parser.add_argument("--projector", type=int, nargs=2, metavar=("W", "H"), default=(1024, 768), help="%(default)s")
    kinds = [str(kind) for kind in PatternKind]
    parser.add_argument("--pattern", default=str(PatternKind.GRAY_CODE), help=f"{', '.join(kinds)} [%(default)s]")
    parser.add_argument("--gamma", type=float, default=2.2, help="of the projector; for fringes [%(default)s]")
    try:
        _write(parser.parse_args(arguments), kinds)
    except DeskewError as error:
        print(f"error: {error}", file=sys.stderr)
        return error.exit_code
    return 0


def _write(options: argparse.Namespace, kinds: Sequence[str]) -> None:
    require(options.pattern in kinds, "pattern", f"be one of {', '.join(kinds)}", options.pattern)
    shown = slides(tuple(options.projector), PatternKind(options.pattern), options.gamma)
    write_capture(shown, options.folder)
    print(f"{options.folder}: white, black and {len(shown.columns) + len(shown.rows)} pictures to project")


if __name__ == "__main__":
    sys.exit(main())

"""The command that made the shipped crumples, and tells of them.

    python -m data_synth.crumpling              # severity and strain of the shipped sheets
    python -m data_synth.crumpling FOLDER       # makes them anew there: some 12 minutes of one core

The same machine makes the same bytes again; another one may round otherwise.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from data_synth.crumples import SHAPE, SHIPPED, SLOPES_P90_DEG, crumple_path, read_crumple, write_crumple
from data_synth.physical import physical
from data_synth.surfaces import CommandParser, made_folder, severity
from deskew.errors import DeskewError


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    parser = CommandParser(prog="python -m data_synth.crumpling", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("folder", type=Path, nargs="?", help="write the sheets there, made anew")
    try:
        folder = parser.parse_args(arguments).folder
        if folder is not None:
            made_folder(folder)
        for index, slope in enumerate(SLOPES_P90_DEG):
            path = crumple_path(index, folder or SHIPPED)
            if folder is not None:
                write_crumple(physical(np.random.default_rng(index), SHAPE, slope_p90_deg=slope), path)
            print(f"{path.stem}: {severity(read_crumple(path))}", flush=True)
    except DeskewError as error:
        print(f"error: {error}", file=sys.stderr)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())

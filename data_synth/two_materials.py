"""Write sheets of two materials, one of which changed size, as NPZ files for `sheet.paths`.

    python -m data_synth.two_materials OUT_FOLDER --case A --count 5 --seed 0

writes ``two_materials_A_0.npz`` to ``two_materials_A_4.npz``: V are bent positions, F the page coordinates before the
change, both in mm; the sheets that come with the package are those of seeds 0 to 4 of each case.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from data_synth.buckling import cell_growth, metric_strain
from data_synth.materials import (
    MAX_SEED,
    SHAPE,
    Case,
    TwoMaterials,
    draw_change,
    draw_two_materials,
    generator,
    write_two_materials,
)
from data_synth.plate import unchanged
from data_synth.sheets import least_cell
from data_synth.surfaces import CommandParser, made_folder
from deskew.errors import DeskewError, require, require_whole
from deskew.types import Floats


def true_growth(case: Case, seed: int, shape: tuple[int, int]) -> Floats:
    """Growth of each cell of the sheet that a seed of a case stands for: (rows - 1, columns - 1)."""
    change = draw_change(generator(case, seed), case)
    return unchanged(shape) if change is None else cell_growth(change, shape)


def described(two: TwoMaterials, growth: Floats) -> str:
    """How much a sheet changed, how bent it is, and how far it is from the lengths that its cells want."""
    strain = np.abs(metric_strain(two.sheet, growth))
    return (
        f"change {two.change_percent:+.2f} %, relief {two.sheet.relief_mm:.1f} mm, "
        f"slope p90 {two.sheet.slope_p90_deg:.1f} deg, strain against its own metric {strain.mean():.2e} mean, "
        f"{np.percentile(strain, 99):.2e} p99, least cell {least_cell(two.sheet.vertices):.2f}"
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    parser = CommandParser(prog="python -m data_synth.two_materials", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("folder", type=Path, help="made if it does not exist")
    parser.add_argument("--case", default="A,B,N", help="one or more, comma between [%(default)s]")
    parser.add_argument("--count", type=int, default=5, help="sheets of each case [%(default)s]")
    parser.add_argument("--seed", type=int, default=0, help="of the first; the next one's is one more [%(default)s]")
    parser.add_argument("--rows", type=int, default=SHAPE[0], help="vertices along the page's height [%(default)s]")
    parser.add_argument("--columns", type=int, default=SHAPE[1], help="vertices along its width [%(default)s]")
    try:
        _write_all(parser.parse_args(arguments))
    except DeskewError as error:
        print(f"error: {error}", file=sys.stderr)
        return error.exit_code
    return 0


def _write_all(options: argparse.Namespace) -> None:
    names = options.case.split(",")
    for name in names:
        require(name in list(Case), "case", f"be one of {', '.join(Case)}", name)
    require_whole("count", options.count, 1, 10_000)
    require_whole("seed", options.seed, 0, MAX_SEED - options.count + 1)
    shape = options.rows, options.columns
    for name, n in zip(("rows", "columns"), shape, strict=True):
        require_whole(name, n, 8, 400)
    made_folder(options.folder)
    for case in map(Case, names):
        for seed in range(options.seed, options.seed + options.count):
            two = draw_two_materials(generator(case, seed), case, shape)
            write_two_materials(two, options.folder / f"two_materials_{case}_{seed}.npz")
            print(f"two_materials_{case}_{seed}: {described(two, true_growth(case, seed, shape))}", flush=True)


if __name__ == "__main__":
    sys.exit(main())

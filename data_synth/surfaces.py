"""Meshes that store their true flat sheet: what any flattening program can be scored on.

    python -m data_synth.surfaces OUT_FOLDER --kind cylinder,folds --count 2 --seed 1

writes ``cylinder_1.obj``, ``cylinder_2.obj``, ...: `v` are bent positions, `vt` the true flat coordinates, both in mm.
"""

from __future__ import annotations

import argparse
import io
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

import numpy as np

from data_synth.developables import cone, cylinder, folds
from data_synth.folds import crumpled
from data_synth.physical import physical
from data_synth.sheets import PAGE_SIZE_MM, TrueSheet, least_cell
from deskew.errors import DeskewError, InputError, require, require_whole
from deskew.io import grid_faces, write_bytes
from deskew.types import Floats

Shape = tuple[int, int]
Size = tuple[float, float]
Kind = Callable[[np.random.Generator, Shape, Size, float], TrueSheet]


def mirror(
    rng: np.random.Generator,
    shape: Shape,
    page_size_mm: Size = PAGE_SIZE_MM,
    slope_p90_deg: float = 20.0,
) -> TrueSheet:
    """Draw a sheet of sharp mirror folds, :func:`data_synth.folds.crumpled`, on a grid of `shape`."""
    return crumpled(rng, page_size_mm, slope_p90_deg, shape=shape)


MAX_SEED = 2**63 - 1

KINDS: dict[str, tuple[Kind, tuple[float, float]]] = {
    "cylinder": (cylinder, (25.0, 45.0)),
    "cone": (cone, (25.0, 45.0)),
    "folds": (folds, (20.0, 40.0)),
    "mirror": (mirror, (15.0, 25.0)),
    "physical": (physical, (12.0, 21.0)),
}
"""Each kind's function and the range that its 90th percentile of slope is drawn from [deg]."""


@dataclass(frozen=True, slots=True)
class Severity:
    """How bent a surface is, and how far from isometric.

    Attributes
    ----------
    slope_p90_deg, relief_mm : float
        As measured on the grid, see :class:`TrueSheet`.
    strain_mean, strain_p99, strain_max : float
        Of the absolute relative change of length over the edges of the grid's triangles. A chord across a bend is
        shorter than the paper: on a closed form that is all there is.
    least_cell : float
        Smallest projected cell over their median; positive on a height field.
    """

    slope_p90_deg: float
    relief_mm: float
    strain_mean: float
    strain_p99: float
    strain_max: float
    least_cell: float

    def __str__(self) -> str:
        strains = f"{self.strain_mean:.2e} mean, {self.strain_p99:.2e} p99, {self.strain_max:.2e} max"
        return (
            f"slope p90 {self.slope_p90_deg:.2f} deg, relief {self.relief_mm:.2f} mm, "
            f"edge strain {strains}, least cell {self.least_cell:.2f}"
        )


def edge_strain(sheet: TrueSheet) -> Floats:
    """Relative change of length of every edge of the grid's triangles (E,): bent over flat, less one."""
    strains = []
    for a, b in (np.s_[:, 1:], np.s_[:, :-1]), (np.s_[1:], np.s_[:-1]), (np.s_[1:, :-1], np.s_[:-1, 1:]):
        bent = np.linalg.norm(sheet.vertices[a] - sheet.vertices[b], axis=-1)
        flat = np.linalg.norm(sheet.flat[a] - sheet.flat[b], axis=-1)
        strains.append((bent / flat - 1.0).ravel())
    return np.concatenate(strains)


def severity(sheet: TrueSheet) -> Severity:
    """Measure a sheet."""
    strain = np.abs(edge_strain(sheet))
    mean, p99, largest = float(strain.mean()), float(np.percentile(strain, 99)), float(strain.max())
    return Severity(sheet.slope_p90_deg, sheet.relief_mm, mean, p99, largest, least_cell(sheet.vertices))


def generate(
    kind: str,
    seed: int,
    shape: Shape | None = None,
    page_size_mm: Size = PAGE_SIZE_MM,
    slope_p90_deg: float | None = None,
) -> TrueSheet:
    """Return the surface of a kind that a seed stands for.

    Parameters
    ----------
    kind : str
        A name in `KINDS`.
    seed : int
        Same seed, same bytes.
    shape : (rows, columns)
        Grid; by default drawn, 180 to 240 rows of square cells.
    page_size_mm : (width, height)
        Page [mm].
    slope_p90_deg : float
        Severity; by default drawn from the kind's range [deg].

    Raises
    ------
    InputError
        If an argument is out of range.
    StepError
        If no drawn surface was fit.
    """
    require(kind in KINDS, "kind", f"be one of {', '.join(KINDS)}", kind)
    require_whole("seed", seed, 0, MAX_SEED)
    rng = np.random.default_rng([seed, *kind.encode()])  # kinds of one seed have nothing in common
    draw, (gentle, steep) = KINDS[kind]
    # Both are drawn even when given, so that a seed's surface is the same shape of bends at any grid and severity.
    rows, slope = int(rng.integers(180, 241)), float(rng.uniform(gentle, steep))
    if shape is None:
        shape = (rows, round((rows - 1) * page_size_mm[0] / page_size_mm[1]) + 1)
    for name, n in zip(("rows", "columns"), shape, strict=True):
        require_whole(name, n, 2, 2000)
    return draw(rng, shape, page_size_mm, slope if slope_p90_deg is None else slope_p90_deg)


def write_surface(sheet: TrueSheet, path: Path, comments: Sequence[str] = ()) -> None:
    """Write a sheet as OBJ, whole or not at all; `vt` are the page coordinates (u, v) in mm.

    Raises
    ------
    InputError
        If the folder does not exist.
    StepError
        If the file system refuses.
    """
    rows, columns = sheet.vertices.shape[:2]
    text = io.BytesIO()
    text.write("".join(f"# {line}\n" for line in comments).encode())
    np.savetxt(text, sheet.vertices.reshape(-1, 3), fmt="v %.9f %.9f %.9f")
    np.savetxt(text, sheet.flat.reshape(-1, 2), fmt="vt %.9f %.9f")
    np.savetxt(text, np.repeat(grid_faces(rows, columns) + 1, 2, axis=1), fmt="f %d/%d %d/%d %d/%d")
    write_bytes(text.getvalue(), path)


def made_folder(folder: Path) -> None:
    """Make a folder unless it is there; raise an InputError where there is no place for one."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"`folder` must be a folder or a place for one, got {error.strerror or error}.") from error


class CommandParser(argparse.ArgumentParser):
    """A parser that would print its usage and exit, made to complain in one line."""

    def error(self, message: str) -> NoReturn:
        """Raise an InputError in the project's wording."""
        raise InputError(f"The arguments must be as --help shows, got: {message}.")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    parser = CommandParser(prog="python -m data_synth.surfaces", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("folder", type=Path, help="made if it does not exist")
    parser.add_argument("--kind", default=",".join(KINDS), help="one or more, comma between [%(default)s]")
    parser.add_argument("--count", type=int, default=1, help="surfaces of each kind [%(default)s]")
    parser.add_argument("--seed", type=int, default=1, help="of the first; the next one's is one more [%(default)s]")
    parser.add_argument("--rows", type=int, help="vertices along the page's height [drawn, 180 to 240]")
    parser.add_argument("--columns", type=int, help="vertices along the page's width [square cells]")
    parser.add_argument("--slope-p90-deg", type=float, help="how bent [drawn]")
    try:
        _write_all(parser.parse_args(arguments))
    except DeskewError as error:
        print(f"error: {error}", file=sys.stderr)
        return error.exit_code
    return 0


def _write_all(options: argparse.Namespace) -> None:
    kinds = options.kind.split(",")
    for kind in kinds:
        require(kind in KINDS, "kind", f"be one of {', '.join(KINDS)}", kind)
    require_whole("count", options.count, 1, 10_000)
    require_whole("seed", options.seed, 0, MAX_SEED - options.count + 1)
    both = (options.rows is None) == (options.columns is None)
    require(both, "rows", "be given together with `columns`", "one of them")
    shape = None if options.rows is None else (options.rows, options.columns)
    made_folder(options.folder)
    for kind in kinds:
        for seed in range(options.seed, options.seed + options.count):
            sheet = generate(kind, seed, shape, slope_p90_deg=options.slope_p90_deg)
            name, rows, columns = f"{kind}_{seed}", *sheet.vertices.shape[:2]
            lines = [f"{name}: {rows} x {columns} vertices", str(severity(sheet))]
            write_surface(sheet, options.folder / f"{name}.obj", [*lines, "v: bent sheet [mm]; vt: flat sheet [mm]"])
            print(", ".join(lines), flush=True)


if __name__ == "__main__":
    sys.exit(main())

"""Synthetic figures beside real ones: `reports/SYNTHETIC_AND_REAL.md`.

Devices, targets and distances differ, so lengths are given in per cent of a target's square.
"""

from __future__ import annotations

from dataclasses import dataclass

from experiments.reporting.beside.measures import Once, Rest, cell, mean, sources
from experiments.reporting.claims.claim import BEST, EULER
from experiments.reporting.claims.measures import Evidence, Measure, Values
from experiments.reporting.markdown import NONE, markdown_table

PAGE_SQUARE_MM, BOARD_SQUARE_MM, REAL_SQUARE_UNITS = 13.0, 18.0, 75.0
"""Sides of the squares of the rendered page and calibration board, and of the real board."""

_PAGE, _BOARD, _REAL = (100.0 / side for side in (PAGE_SQUARE_MM, BOARD_SQUARE_MM, REAL_SQUARE_UNITS))
_HEAD = """# Synthetic beside real

Every figure of the rendered rig that has a real counterpart, with its counterpart: the mean of n trials with its 95 %
bootstrap interval. The real boards are five Gray-code captures by somebody else's camera and projector, the real
documents photographs of printed invoices, flat and crumpled; neither is part of this project (the README says where to
get them), and nobody measured the shape of the documents. The two columns are not expected to agree: the last section
says of each line why. Generated from the reports by `python -m experiments.reporting.generated`.

Lengths are in per cent of a square: {page:g} mm on the rendered page, {board:g} mm on the rendered calibration board,
{real:g} units on the real one."""


@dataclass(frozen=True, slots=True)
class Pair:
    """One quantity, measured on rendered and on real pictures.

    Attributes
    ----------
    what : str
        The quantity, with its unit.
    synthetic, real : Measure
        Its two figures.
    why : str
        Why they differ or cannot be compared, in a sentence.
    """

    what: str
    synthetic: Measure
    real: Measure
    why: str


def _residual(device: str, why: str) -> Pair:
    metric = f"calib_{device}_rms_px"
    synthetic = Once(Values("corner_distance", "unrestored", metric))
    return Pair(f"calibration residual, {device} [px]", synthetic, mean("real_boards", "left_out", f"{metric}"), why)


def _read(rendered: str, real: str, why: str) -> Pair:
    return Pair(
        f"letters read of rendered pages, {rendered}; words read of photographs, {real} [%]",
        Rest(100.0, mean("ocr_misses", rendered, "error_rate_percent", digits=1)),
        mean("ocr_misses", f"real/{real}", "word_recall", digits=1, scale=100.0),
        why,
    )


PAIRS: tuple[Pair, ...] = (
    _residual(
        "camera",
        "The rendered lens is of the very model that is fitted and the rendered board is flat, so what "
        "is left is the detector's noise; a real lens, board and print have errors of their own.",
    ),
    _residual(
        "projector",
        "Both are residuals of decoded stripes; the real captures are Gray code, whose edges are read between two "
        "pixels, the rendered ones a line sweep.",
    ),
    _residual("stereo", "Of both devices together, so it lies between the two above."),
    Pair(
        "error of held-out lengths, RMS [% of a square]",
        mean("plane_accuracy", "checkered", "length_error_mm", digits=2, scale=_PAGE),
        mean("real_boards", "left_out", "length_error_units", digits=2, scale=_REAL),
        "Lengths between corners of a plane that the calibration has not seen. The rendered one is calibrated on nine "
        "poses close to the page, the real one on four that lean far apart, one of which decides much.",
    ),
    Pair(
        "mean deviation from a plane [% of a square]",
        mean("plane_accuracy", "checkered", "plane_mean_abs_mm", digits=2, scale=_PAGE),
        mean("real_boards", "left_out", "plane_mean_abs_units", digits=2, scale=_REAL),
        "The rendered figure is of all pixels, ink edges included; the real one of points averaged around the corners, "
        "which leaves noise out, on a board that need not be flat.",
    ),
    Pair(
        "restored corners, the best method, rigid mean [% of a square]",
        mean("corner_distance", "restored", "corner_rigid_mean_mm", BEST, digits=2, scale=_PAGE),
        mean("real_boards", "restored", "corner_rigid_mean_units", BEST, digits=2, scale=_REAL),
        "The rendered page is crumpled and its corners are compared with its flat picture's; the real board is flat "
        "and leans, and its corners are compared with exact squares, so its print counts as well.",
    ),
    Pair(
        "restored corners, the paper's method, rigid mean [% of a square]",
        mean("corner_distance", "restored", "corner_rigid_mean_mm", EULER, digits=2, scale=_PAGE),
        mean("real_boards", "restored", "corner_rigid_mean_units", EULER, digits=2, scale=_REAL),
        "As the figure before. On a flat board both methods agree, since chords are as long as the surface: real "
        "captures of bent pages with known truth would be needed to tell them apart.",
    ),
    Pair(
        "share of the target's pixels with depth",
        mean("plane_accuracy", "checkered", "depth_coverage", digits=4),
        mean("real_boards", "left_out", "depth_coverage", digits=4),
        "Rendered ink reflects a little light and is decoded; the real board's black is too dark for a Gray code's "
        "edges, so its black squares have no depth.",
    ),
    _read(
        "control",
        "flat",
        "A word counts if every letter is right, and the words of an invoice come in no order that a letter could be "
        "held to. Rendered pages have large capitals of one size, chosen so that the machine reads them; invoices have "
        "many sizes, columns and numbers.",
    ),
    _read(
        "unrestored",
        "crumpleseasy",
        "Invoices are photographed freely, in perspective and uneven light, and nothing undoes that; the rendered "
        "camera looks down on the page in soft light.",
    ),
    _read(
        "unrestored",
        "crumpleshard",
        "As the figure before; how bent the rendered pages are was chosen by the error rate of the paper and not after "
        "these photographs.",
    ),
)


def real_page(evidence: Evidence) -> str:
    """Return the text of `SYNTHETIC_AND_REAL.md`, with the pairs of which both figures are there."""
    cells = [(pair, cell(pair.synthetic, evidence), cell(pair.real, evidence)) for pair in PAIRS]
    both = [found for found in cells if NONE not in (found[1][0], found[2][0])]
    rows = [[f"{i}. {pair.what}", *one, *other, _from(pair)] for i, (pair, one, other) in enumerate(both, 1)]
    head = _HEAD.format(page=PAGE_SQUARE_MM, board=BOARD_SQUARE_MM, real=REAL_SQUARE_UNITS)
    notes = "\n".join(f"{i}. {pair.why}" for i, (pair, *_) in enumerate(both, 1))
    table = markdown_table(("quantity", "synthetic", "n", "real", "n", "reports"), rows)
    return "\n\n".join((head, table, "## Why they differ", notes)) + "\n"


def _from(pair: Pair) -> str:
    return ", ".join(dict.fromkeys((sources(pair.synthetic), sources(pair.real))))

"""Write the report for people: one HTML file of a folder of reports.

python -m experiments.page [--reports reports] [--out out/report.html]

The page that its three-dimensional view shows is rendered, scanned and flattened on the way, which takes a minute or
two; it is kept in out/ under a name that changes with the sources, and read from there the next time.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from deskew.errors import DeskewError, InputError
from deskew.io import require_writable, write_bytes
from experiments.page.document import document
from experiments.page.runs import read_runs
from experiments.page.verdicts import judged_claims
from experiments.reporting.claims.measures import Evidence
from experiments.studies.falling_sheet import kept_falling_sheet

_ROOT = Path(__file__).resolve().parents[2]
_SEED = 2


class _Parser(argparse.ArgumentParser):
    """A parser whose complaint is one line, as every program's here."""

    def error(self, message: str) -> NoReturn:
        raise InputError(f"The arguments must be --reports FOLDER and --out FILE.html, got: {message}.")


def write_page(reports: Path, out: Path, kept: Path = _ROOT / "out") -> None:
    """Write the report of a folder of reports.

    Parameters
    ----------
    reports : Path
        Holds NAME/run.json, NAME/results.csv, ...
    out : Path
        The HTML file; folders are made.
    kept : Path
        Folder of what the next report can use again: the recorded page and the rig's calibration.

    Raises
    ------
    InputError
        If the reports are not there or damaged, or `out` cannot be written.
    StepError
        If the recorded page cannot be made.
    """
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"`--out` must lie in a folder that can be made, got {out}: {error.strerror}.") from error
    require_writable(out, (".html",))
    runs = read_runs(reports)
    claims = judged_claims(Evidence(reports))
    print("The page that falls flat: recorded once, in a minute or two, then kept.", file=sys.stderr)
    sheet = kept_falling_sheet(_SEED, kept / "falling_sheet", kept / "calibrations")
    print(f"Tables and figures of {len(runs)} reports.", file=sys.stderr)
    write_bytes(document(runs, claims, sheet).encode(), out)


def main(arguments: Sequence[str]) -> int:
    """Write the page; return 0, or 2 or 3 after one line of complaint."""
    parser = _Parser(prog="python -m experiments.page", description="Write the report for people, one HTML file.")
    parser.add_argument("--reports", type=Path, default=_ROOT / "reports", help="folder of reports (reports)")
    parser.add_argument("--out", type=Path, default=Path("out/report.html"), help="the file (out/report.html)")
    try:
        given = parser.parse_args(list(arguments))
        write_page(given.reports, given.out)
    except DeskewError as error:
        print(error, file=sys.stderr)
        return error.exit_code
    print(given.out)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

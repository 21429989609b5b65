"""Write `CLAIMS.md` into a folder of reports, by default `reports/`.

python -m experiments.reporting.claims [REPORTS_FOLDER]
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path

from deskew.errors import DeskewError, require
from deskew.io import write_bytes
from experiments.reporting.claims.measures import Evidence
from experiments.reporting.claims.page import claims_page
from experiments.reporting.claims.paper import CLAIMS

_REPORTS = Path(__file__).resolve().parents[3] / "reports"


def main(arguments: Sequence[str]) -> int:
    """Write the page; return 0, or after one line of complaint 2 for wrong input and 3 for what cannot be written."""
    try:
        require(len(arguments) <= 1, "arguments", "be one folder of reports, or none", " ".join(arguments))
        folder = Path(arguments[0]) if arguments else _REPORTS
        is_folder = os.path.isdir(folder)  # noqa: PTH112  # answers for names that pathlib raises on
        require(is_folder, "REPORTS_FOLDER", "be a folder", str(folder))
        write_bytes(claims_page(CLAIMS, Evidence(folder)).encode(), folder / "CLAIMS.md")
    except DeskewError as error:
        print(error, file=sys.stderr)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

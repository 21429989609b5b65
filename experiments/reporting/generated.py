"""The committed files that are written from the committed reports, and whether they are current.

python -m experiments.reporting.generated            # writes what is not
python -m experiments.reporting.generated --check    # names what is not; exit code 1 if there is any
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from deskew.errors import InputError
from deskew.io import write_bytes
from experiments.reporting.artifact import with_artifact
from experiments.reporting.beside.nulls import nulls_page
from experiments.reporting.beside.real import real_page
from experiments.reporting.claims.measures import Evidence
from experiments.reporting.claims.page import claims_page
from experiments.reporting.claims.paper import CLAIMS
from experiments.reporting.croissant import croissant_text
from experiments.reporting.decisions import decisions_page
from experiments.reporting.headlines import with_results
from experiments.reporting.readme import with_tables
from experiments.reporting.scaling import Measured, with_figures

ROOT = Path(__file__).resolve().parents[2]


def _measured(root: Path) -> Measured:
    return Measured.read(root / "docs/scaling.csv", root / "reports")


GENERATED: Mapping[str, Callable[[Path], str]] = {
    "README.md": lambda root: with_results((root / "README.md").read_text(), Evidence(root / "reports")),
    "ARTIFACT.md": lambda root: with_artifact((root / "ARTIFACT.md").read_text(), root / "reports"),
    "docs/adr/README.md": lambda root: decisions_page(root / "docs/adr"),
    "docs/results.md": lambda root: with_tables((root / "docs/results.md").read_text(), root / "reports"),
    "docs/scaling.md": lambda root: with_figures((root / "docs/scaling.md").read_text(), _measured(root)),
    "reports/CLAIMS.md": lambda root: claims_page(CLAIMS, Evidence(root / "reports")),
    "reports/NULLS.md": lambda root: nulls_page(Evidence(root / "reports")),
    "reports/SYNTHETIC_AND_REAL.md": lambda root: real_page(Evidence(root / "reports")),
    "reports/croissant.json": croissant_text,
}
"""What each file should hold, by its name in a checkout; files with markers are read and filled."""


def outdated(root: Path) -> dict[str, str]:
    """Return the text that each file should hold, of those that hold another or are not there."""
    wanted = {name: text(root) for name, text in GENERATED.items()}
    return {n: text for n, text in wanted.items() if not (root / n).is_file() or (root / n).read_text() != text}


def main(arguments: Sequence[str]) -> int:
    """Write the outdated files, or name them."""
    if list(arguments) not in ([], ["--check"]):
        print(f"The argument must be --check or nothing, got {' '.join(arguments)}.", file=sys.stderr)
        return InputError.exit_code
    found = outdated(ROOT)
    for name, text in found.items():
        print(name)
        if not arguments:
            write_bytes(text.encode(), ROOT / name)
    return int(bool(arguments and found))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

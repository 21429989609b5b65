"""The one table of results that the README begins with: few figures, the paper's beside ours, each with its interval.

What stands between `<!-- results -->` and `<!-- end -->` is made from the reports' `results.csv`; every row links to
the report that has all that stands around it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from deskew.errors import InputError
from experiments.reporting.claims.claim import BEST, EULER
from experiments.reporting.claims.measures import Evidence, Mean, MissingError, Values
from experiments.reporting.markdown import NONE, markdown_table

_BLOCK = re.compile(r"(<!-- results -->\n).*?(<!-- end -->)", re.DOTALL)


@dataclass(frozen=True, slots=True)
class Headline:
    """One row.

    Attributes
    ----------
    what : str
        What is measured, with its unit.
    report, metric : str
        Where.
    bent, restored : str
        Conditions before restoration and after; "" for none.
    paper : str
        What the paper states.
    digits : int
        Decimals shown.
    methods : tuple of str
        Of the two last columns: the paper's, and the best; "-" for what no method flattened, "" for none.
    """

    what: str
    report: str
    metric: str
    bent: str
    restored: str
    paper: str
    digits: int = 2
    methods: tuple[str, str] = (EULER, BEST)

    def cells(self, evidence: Evidence) -> tuple[str, ...]:
        """Return the row.

        Raises
        ------
        MissingError
            If a report is not there or has no such rows.
        """
        figures = [self._figure(evidence, self.bent, "-")]
        figures += [self._figure(evidence, self.restored, method) for method in self.methods]
        bent, theirs, ours = figures
        n = max(n for _, n in figures)
        link = f"[{self.what}](reports/{self.report}/table.md)"
        return link, str(n), bent[0], self.paper or NONE, theirs[0], ours[0]

    def _figure(self, evidence: Evidence, condition: str, method: str) -> tuple[str, int]:
        if not condition or not method:
            return NONE, 0
        values = Values(self.report, condition, self.metric, method)
        found = Mean((values,), digits=self.digits).figure(evidence)
        return found.text + (f", {found.n_failed} failed" if found.n_failed else ""), found.n


_OCR = "ocr_misses"
_PAGES, _CRUMPLES, _PLANES = "corner_distance", "corner_distance_physical", "plane_accuracy"
_SCAN = ("-", "")

HEADLINES: tuple[Headline, ...] = (
    Headline("Corners, folded pages [px]", _PAGES, "corner_mean_px", "unrestored", "restored", "< 0.5"),
    Headline("The same [mm]", _PAGES, "corner_mean_mm", "unrestored", "restored", "< 0.25", 3),
    Headline("Corners, crumpled pages [px]", _CRUMPLES, "corner_mean_px", "unrestored", "restored", "< 0.5"),
    Headline("Every pixel, rigidly [mm]", _PAGES, "dense_mean_mm", "", "restored", "", 3),
    Headline("Letters missed, of 176", _OCR, "misses", "unrestored", "restored", "1 to 3", 1),
    Headline(
        "Scan of a blank plane [mm]", _PLANES, "plane_mean_abs_mm", "", "white", "0.31 (0.25 to 0.5)", 3, methods=_SCAN
    ),
    Headline("Scan of a printed plane [mm]", _PLANES, "plane_mean_abs_mm", "", "checkered", "", 3, methods=_SCAN),
)
"""In the order of the table."""

HEADINGS = ("mean error", "n", "unrestored", "the paper says", "its method here", "`spring`")


def with_results(text: str, evidence: Evidence) -> str:
    """Return a text with its marked block filled.

    Parameters
    ----------
    text : str
        Markdown with one `<!-- results -->` ... `<!-- end -->` block.
    evidence : Evidence
        The reports.

    Raises
    ------
    InputError
        If a report is missing or lacks what a row needs.
    """
    try:
        table = markdown_table(HEADINGS, [headline.cells(evidence) for headline in HEADLINES])
    except MissingError as error:
        raise InputError(f"`reports` must hold {error} with what the README's results need, got none.") from error
    return _BLOCK.sub(lambda block: f"{block[1]}{table}\n{block[2]}", text)

"""Each judged metric beside its null: `reports/NULLS.md`."""

from __future__ import annotations

from dataclasses import dataclass

from experiments.reporting.beside.measures import cell, mean
from experiments.reporting.claims.claim import BEST, EULER
from experiments.reporting.claims.measures import Evidence, Mean
from experiments.reporting.markdown import markdown_table

_HEAD = """# What each metric reads when nothing is right

A figure says something only if it is bad where the page is bad. Here every judged metric is given the truth, then a
truth spoilt by a stated amount, and stands beside what the methods reach. Where the null reads as well as the truth the
metric is blind to that fault, which the line says. Means of the trials with their 95 % bootstrap intervals, from
[null_controls](null_controls/table.md), which says how many, and, for figures that only a scan has, from the null rows
of the reports themselves. Generated from the reports by `python -m experiments.reporting.generated`."""
_NULLS = "null_controls"


@dataclass(frozen=True, slots=True)
class Line:
    """One metric and one way to spoil its truth.

    Attributes
    ----------
    metric, null : str
        The metric with its unit, and what was done to the truth.
    truth, spoilt : Mean
        What it reads of either.
    best, paper : Mean or None
        What the best method, and the paper's, reach in the committed reports.
    """

    metric: str
    null: str
    truth: Mean
    spoilt: Mean
    best: Mean | None = None
    paper: Mean | None = None


def _line(
    metric: str, heading: str, null: str, said: str, report: str = "", digits: int = 3, place: str = "restored"
) -> Line:
    """Return the line of a metric of `null_controls`, beside a report's restored pages if one is named."""
    best, paper = (mean(report, place, metric, m, digits=digits) if report else None for m in (BEST, EULER))
    truth = mean(_NULLS, "null/itself", metric, digits=digits)
    return Line(heading, said, truth, mean(_NULLS, f"null/{null}", metric, digits=digits), best, paper)


_I, _II, _ACCURACY, _LIGHTS = "corner_distance", "ocr_misses", "plane_accuracy", "textures"
# Report, decimals and condition.
_MESH = "surfaces", 4, "flattened/mirror"
_LONGER = "the page 1 % longer along u"
_OTHER = "the page restored by another page's shape"
_LAIN = "the page not flattened"

LINES: tuple[Line, ...] = (
    _line("corner_mean_px", "corners, affine mean [px]", "another", _OTHER, _I),
    _line("corner_mean_px", "corners, affine mean [px]", "unflattened", _LAIN, _I),
    _line("corner_mean_px", "corners, affine mean [px]", "stretched", f"{_LONGER}: blind", _I),
    _line("corner_rigid_mean_mm", "corners, rigid mean [mm]", "stretched", _LONGER, _I),
    _line("corner_rigid_mean_mm", "corners, rigid mean [mm]", "shifted", "the page 1 mm aside: blind, as meant", _I),
    _line("dense_mean_mm", "all pixels, rigid mean [mm]", "stretched", _LONGER, _I),
    _line("dense_mean_mm", "all pixels, rigid mean [mm]", "another", _OTHER, _I),
    _line("page_coverage", "share of the page shown", "another", f"{_OTHER}: nearly blind", _I, 4),
    _line("depth_rms_mm", "filtered depth, RMS [mm]", "bed", "the empty bed's depth", _I),
    _line("depth_rms_mm", "filtered depth, RMS [mm]", "shifted", "the page 1 mm farther away", _I),
    Line(
        "mean deviation from a plane [mm]",
        "baseline of the calibration 1 % wrong: blind",
        mean(_ACCURACY, "fault/none", "plane_mean_abs_mm"),
        mean(_ACCURACY, "fault/baseline", "plane_mean_abs_mm"),
    ),
    Line(
        "error of 300 mm [mm]",
        "baseline of the calibration 1 % wrong",
        mean(_ACCURACY, "fault/none", "length_error_mm"),
        mean(_ACCURACY, "fault/baseline", "length_error_mm"),
    ),
    _line("flat_rigid_mean_mm", "vertices, rigid mean [mm]", "stretched", _LONGER, *_MESH),
    _line("flat_mean_mm", "vertices, affine mean [mm]", "stretched", f"{_LONGER}: blind", *_MESH),
    _line("flat_rigid_mean_mm", "vertices, rigid mean [mm]", "unflattened", "the mesh seen from above", *_MESH),
    _line("strain_rms", "strain, RMS", "unflattened", "the mesh seen from above", *_MESH),
    _line("misses", "letters missed of 176", "shuffled", "the letters in random order", _II, 2),
    _line("misses", "letters missed of 176", "nothing", "nothing read", _II, 2),
    _line("misses_paper", "the same as the paper counts", "nothing", "nothing read: blind", _II, 2),
    _line("word_recall", "true words read", "another", "another page's text", _II),
    _line("ms_ssim_docunet", "MS-SSIM, DocUNet's sum", "nothing", "bare paper", _II),
    _line("ms_ssim_docunet", "MS-SSIM, DocUNet's sum", "shifted", "the picture 1 pixel aside", _II),
    _line("ms_ssim_wang", "MS-SSIM, Wang's product", "nothing", "bare paper", _II),
    _line("ld_dis_px", "LD by DIS flow [px]", "another", "another page's picture", _II),
    _line("ad_dis", "AD by DIS flow", "another", "another page's picture", _II),
    _line("ad_dis", "AD by DIS flow", "shifted", "the picture 1 pixel aside: blind, as meant", _II),
    _line("lid_dis_px", "Li-D by DIS flow [px]", "another", "another page's picture", _II),
    _line("line_straightness_px", "lines bend by [px]", "another", "another page's picture: blind, as meant", _II),
    Line(
        "hidden writing, share read",
        "the same page in a light that does not show it",
        mean(_LIGHTS, "restored/uv", "uv_text_read", BEST),
        mean(_LIGHTS, "restored/white", "uv_text_read", BEST),
    ),
    Line(
        "gain of the right stiffness [times]",
        "a page of which nothing changed its size",
        mean("stiffness", "restored/A/vellum_over_paper=0.01", "kept_gain_over_wrong", BEST, digits=1),
        mean("stiffness", "restored/N/vellum_over_paper=100", "kept_gain_over_wrong", BEST, digits=1),
    ),
    Line(
        "shrinkage found [%]",
        "a page of which nothing changed its size",
        mean("stiffness", "restored/A/free_scale", "shrink_estimated", BEST, digits=2),
        mean("stiffness", "restored/N/free_scale", "shrink_estimated", BEST, digits=2),
    ),
)
"""In the order of the page. The last three can be given no truth: a page that is not spoilt stands in its place."""


def nulls_page(evidence: Evidence) -> str:
    """Return the text of `NULLS.md`."""
    rows = []
    for line in LINES:
        figures = [cell(measure, evidence)[0] for measure in (line.truth, line.spoilt, line.best, line.paper)]
        rows.append([line.metric, line.null, *figures])
    headings = ("metric", "null", "of the truth", "of the null", "best method", "the paper's method")
    return "\n\n".join((_HEAD, markdown_table(headings, rows))) + "\n"

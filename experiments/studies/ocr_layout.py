"""Table and figures of Experiment II."""

from __future__ import annotations

from experiments.reporting import Column, Curve, FigurePage, Layout, Numbers, Section, Versus

_LETTERS = 176
_PAPER = {"control": "0", "unrestored": "9..18", "restored": "1..3"}
_PARTS = ("substitutions", "insertions", "deletions", "misses_paper")
_IMAGE = (
    "ms_ssim_docunet",
    "ms_ssim_wang",
    "ld_dis_px",
    "ad_dis",
    "lid_dis_px",
    "line_straightness_px",
    "line_spread_deg",
    "text_lines",
)
_WAYS = {"_normalised": "normalised", "_projector": "projector light", "_unshaded": "shading removed"}


def _columns() -> tuple[Column, ...]:
    further = []
    for suffix, heading in _WAYS.items():
        further += [Column(f"misses{suffix}", f"misses, {heading}", 2)]
        further += [Column(f"{part}{suffix}", f"{part.replace('_', ' ')}, {heading}", 2) for part in _PARTS]
    return (
        Column("misses", "misses", 2, _PAPER),
        Column("substitutions", "substitutions", 2),
        Column("insertions", "insertions", 2),
        Column("deletions", "deletions", 2),
        Column("misses_paper", "as the paper counts", 2, _PAPER),
        Column("letters", "letters", 0),
        Column("error_rate_percent", "error rate [%]", 2, {"control": "0", "unrestored": "5..10", "restored": "1..2"}),
        Column("without_miss", "without a miss", share=True),
        *further,
        Column("shading_percent", "shading left [%]", 2),
        Column("shading_projector_percent", "shading left, projector light [%]", 2),
        Column("shading_unshaded_percent", "shading left, shading removed [%]", 2),
        Column("dense_mean_mm", "dense mean [mm]", 3),
        Column("dense_p95_mm", "dense p95 [mm]", 3),
        Column("dense_max_mm", "dense max [mm]", 2),
        Column("page_coverage", "coverage", 4),
        Column("depth_raw_rms_mm", "depth RMS [mm]", 3),
        Column("depth_rms_mm", "filtered depth RMS [mm]", 3),
        Column("depth_coverage", "depth coverage", 4),
        Column("at_rest", "at rest", share=True),
        Column("folded_quads", "folded quads", 0),
        Column("slope_p90_deg", "p90 slope [deg]", 1),
        Column("relief_mm", "relief [mm]", 1),
        Column("ms_ssim_docunet", "MS-SSIM (DocUNet's sum)", 4),
        Column("ms_ssim_wang", "MS-SSIM (Wang's product)", 4),
        Column("ld_dis_px", "LD, DIS flow [px]", 3),
        Column("ad_dis", "AD, DIS flow", 4),
        Column("lid_dis_px", "Li-D, DIS flow [px]", 3),
        Column("line_straightness_px", "lines bend by [px]", 3),
        Column("line_spread_deg", "lines diverge by [deg]", 3),
        Column("text_lines", "lines found", 1),
        Column("word_recall", "true words read", 3),
        Column("word_precision", "words read that are true", 3),
        Column("words", "true words", 0),
    )


_MAIN = ("control", "unrestored", "ideal", "restored")

LAYOUT = Layout(
    "Experiment II: OCR (section 4.2, figure 4)",
    f"Misses of a reading machine on pages of {_LETTERS} letters, against the true text: letters read as another "
    "(substitutions), read where there are none (insertions) and not read (deletions, which the paper does not mention "
    "and we count). The paper: control 0, unrestored 5 to 10 % of the letters, restored 1 to 3 letters. Pages are "
    "photographed in soft light and read as they are; pictures are cut alike, to the flat page less 6 mm all round.",
    _columns(),
    sections=(
        Section(
            "Misses",
            "How bent the sheets are was chosen once on unrestored pages and frozen (docs/adr/0019). `spring` is the "
            "best method, `paper_*` the paper's as a whole, its scan included; `ideal` is the page warped back by its "
            "true shape: what it misses is light read as marks, which no restoration that keeps the light can help. "
            "`null/shuffled` is the true letters in random order: what a reading scores that has nothing but them.",
            (*_MAIN, "null/shuffled"),
            (
                "misses",
                *_PARTS,
                "letters",
                "error_rate_percent",
                "without_miss",
                "dense_mean_mm",
                "slope_p90_deg",
                "relief_mm",
            ),
        ),
        Section(
            "Light",
            "The same pages: soft light as it is, divided by the local white of the picture (normalised), the "
            "projector's own hard light as it is, and that light with the shading removed by the scanned shape and the "
            "calibrated projector. `shading left` is the standard deviation of blank paper's grey levels over their "
            "mean, the sensor's noise included.",
            _MAIN,
            (
                "misses",
                *(f"misses{suffix}" for suffix in _WAYS),
                "shading_percent",
                "shading_projector_percent",
                "shading_unshaded_percent",
            ),
        ),
        Section(
            "Image metrics",
            "What the document-unwarping field reports, from pictures alone, against the control (docs/adr/0026). LD, "
            "AD and Li-D are by DIS flow, not by the field's SIFT flow, and in pixels of pictures of 149,600 pixels. "
            "MS-SSIM and LD count where the page lies in the picture, which no method is asked to know; AD, Li-D and "
            "the lines count its shape. `null/shifted` is the control itself moved by one pixel: what a metric reads "
            "of a truth that is spoilt.",
            ("control", "null/shifted", "unrestored", "ideal", "restored"),
            _IMAGE,
        ),
        Section(
            "Severity",
            "The same words on the same folds, bent more or less.",
            ("unrestored/", "ideal/", "restored/"),
            ("slope_p90_deg", "relief_mm", "misses", "misses_normalised", "error_rate_percent", "dense_mean_mm"),
        ),
        Section(
            "Photographs of real documents",
            "As they are: no shape was measured, so nothing can be restored, and this is the machine's floor. Words "
            "are compared as bags: an invoice has columns, and no order of reading is the true one.",
            ("real/flat", "real/"),
            ("words", "word_recall", "word_precision"),
            absent="Absent: `ocr.real_path` names no folder of photographs.",
        ),
    ),
    versus=Versus(
        "Each method against the paper's by explicit Euler, its scan included, at every severity.",
        "paper_euler",
        ("restored", "restored/"),
        ("misses", "misses_normalised", "misses_unshaded", "dense_mean_mm"),
    ),
    pages=(
        FigurePage(
            "figure_4",
            "Experiment II: lettered pages, crumpled, restored and read (the paper's figure 4)",
            "Row I: the crumpled pages as the camera sees them in soft light. Row II: the recovered 3D models, heights "
            "three times too large. Row III: the restored pages, their shading left in. Row IV: the control, the page "
            f"photographed flat, and how many of its {_LETTERS} letters the reading machine missed.",
            (
                ("captured", "page_{column}_crumpled"),
                ("3D model", "page_{column}_model"),
                ("restored", "page_{column}_restored_{method}"),
            ),
            control=("control", "page_{column}_control"),
            numbers=Numbers(
                (("control", "control"), ("unrestored", "unrestored"), ("restored", "restored")),
                ("slope_p90_deg", "relief_mm", "misses"),
            ),
        ),
    ),
    curves=(
        Curve(
            "severity",
            "slope_p90_deg",
            "90th percentile of the slope [degrees]",
            "error_rate_percent",
            f"misses [% of {_LETTERS} letters]",
            ("unrestored", "ideal", "restored"),
            (("the paper, unrestored", 5.0, 10.0), ("the paper, restored", 1.0, 2.0)),
        ),
    ),
)

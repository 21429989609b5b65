"""How experiment III is told: a section a case, the error against the ratio, and the paper's figure 5."""

from __future__ import annotations

from data_synth import Case
from experiments.reporting import Column, Curve, FigurePage, Layout, Numbers, Section

# Ratios that the sections list; one that was not run has no line.
_LISTED = (0.0001, 0.001, 0.01, 0.1, 1.0, 10.0, 100.0, 1000.0, 10000.0)


def restored(case: Case, ratio: float) -> str:
    """Name the condition of a restoration with a ratio of stiffness."""
    return f"restored/{case}/vellum_over_paper={ratio:g}"


def freely_scaled(case: Case) -> str:
    """Name the condition of a restoration with a free scale."""
    return f"restored/{case}/free_scale"


def by_dynamics(case: Case, ratio: float) -> str:
    """Name the condition of a restoration with a ratio of stiffness by another method, as a check."""
    return f"dynamics/{case}/vellum_over_paper={ratio:g}"


_ERRORS = (
    "kept_mean_mm",
    "kept_p95_mm",
    "changed_mean_mm",
    "changed_p95_mm",
    "dense_mean_mm",
    "kept_gain_over_wrong",
    "kept_gain_over_even",
    "changed_gain_over_wrong",
    "changed_gain_over_even",
    "shrink_estimated",
    "shrink_error",
    "at_rest",
    "folded_quads",
    "max_z_mm",
    "dense_affine_mean_mm",
)


def _section(case: Case, title: str, note: str) -> Section:
    conditions = (*(restored(case, ratio) for ratio in _LISTED), freely_scaled(case), f"dynamics/{case}/")
    return Section(title, note, conditions, _ERRORS)


LAYOUT = Layout(
    "Experiment III: two materials (section 4.3, figure 5)",
    "A vellum leaf in a paper sleeve. A: the vellum shrank by about 2 %, unevenly. B: the sleeve grew by as much. N: "
    "nothing changed its size. The page lay flat when it was written, and what is measured is how far restored pixels "
    "are from where they were then. `kept` is what kept its size (of N, where all did, the vellum), and the errors of "
    "both regions are those after the rotation and translation that fit `kept` best. The gain is the error with the "
    "ratio at the other end, or with 1:1, over that of this line, trial by trial; N's is what a choice of stiffness "
    "does by itself. A and B are never pooled: a thin frame holds a page worse than a compact leaf. `free_scale` is "
    "beyond the paper: the soft material may have another size, which is found too. `dynamics` are the same springs of "
    "the same scan, settled by the paper's particle system, as a check.",
    (
        Column("kept_mean_mm", "kept mean [mm]", 3),
        Column("kept_p95_mm", "kept p95 [mm]", 3),
        Column("changed_mean_mm", "changed mean [mm]", 3),
        Column("changed_p95_mm", "changed p95 [mm]", 3),
        Column("dense_mean_mm", "rigid over all, mean [mm]", 3),
        Column("dense_p95_mm", "rigid over all, p95 [mm]", 3),
        Column("dense_max_mm", "rigid over all, max [mm]", 3),
        Column("kept_gain_over_wrong", "kept gain over the other end", 1),
        Column("kept_gain_over_even", "kept gain over 1:1", 1),
        Column("changed_gain_over_wrong", "changed gain over the other end", 1),
        Column("changed_gain_over_even", "changed gain over 1:1", 1),
        Column("shrink_estimated", "shrink estimated [%]", 2),
        Column("shrink_true", "shrink true [%]", 2),
        Column("shrink_error", "shrink off by [points]", 2),
        Column("difference_rms_grey", "difference RMS [grey levels]", 1),
        Column("at_rest", "at rest", share=True),
        Column("folded_quads", "folded quads", 0),
        Column("max_z_mm", "max z [mm]", 3),
        Column("page_coverage", "coverage", 4),
        Column("slope_p90_deg", "p90 slope [deg]", 1),
        Column("relief_mm", "relief [mm]", 1),
        Column("depth_rms_mm", "depth RMS [mm]", 3),
        Column("depth_coverage", "depth coverage", 4),
        Column("materials_wrong", "material wrong, share", 4),
        Column("materials_border_mm", "its border off by, mean [mm]", 2),
        Column("registration_error_px", "registration error [texture px]", 3),
        Column("registration_residual_px", "stated residual [texture px]", 3),
        Column("dense_affine_mean_mm", "affine over all, hides the effect, mean [mm]", 3),
    ),
    curves=tuple(
        Curve(
            f"{region}_against_ratio",
            "vellum_over_paper",
            "stiffness of the vellum over that of the paper",
            f"{region}_mean_mm",
            f"{text}: mean error [mm]",
            tuple(f"restored/{case}" for case in Case),
            log=True,
        )
        for region, text in (("kept", "what kept its size"), ("changed", "what changed its size"))
    ),
    sections=(
        Section(
            "The pages",
            "Each case's sheets and how they were scanned; the true shrinkage of what changed, negative where it grew; "
            "how well the materials were told apart, and the 1996 x 1450 picture registered to the scan, whose bar is "
            "0.3 texture pixels; and the difference of the restorations with the vellum and with the paper the stiffer "
            "one, after a rigid fit.",
            tuple(f"{kind}/{case}" for case in Case for kind in ("unrestored", "difference")),
            (
                "slope_p90_deg",
                "relief_mm",
                "shrink_true",
                "difference_rms_grey",
                "materials_wrong",
                "materials_border_mm",
                "registration_error_px",
                "depth_rms_mm",
                "depth_coverage",
            ),
        ),
        _section(Case.A, "A: the vellum shrank", "The paper kept its size: it should be the stiffer one."),
        _section(Case.B, "B: the sleeve grew", "The vellum kept its size: it should be the stiffer one."),
        _section(Case.N, "N: nothing changed its size", "Neither is right or wrong: gains should be 1."),
    ),
    pages=(
        FigurePage(
            "figure_5",
            "Experiment III: a vellum leaf in a paper sleeve (the paper's figure 5)",
            "Row I: the manuscripts as the camera sees them. Row II: the recovered 3D models, heights three times too "
            "large. Rows III and IV: the photograph of 1996 x 1450 pixels, restored with the vellum and with the paper "
            "a hundred times as stiff as the other. Row V: their difference after a rigid fit, white where there is "
            "none. The numbers are means over all trials.",
            (
                ("captured", "{column}_captured"),
                ("3D model", "{column}_model"),
                ("vellum stiffer", "{column}_vellum"),
                ("paper stiffer", "{column}_paper"),
                ("difference", "{column}_difference"),
            ),
            columns=(("A: the vellum shrank", "A"), ("B: the sleeve grew", "B"), ("N: nothing changed", "N")),
            numbers=Numbers(
                (
                    ("vellum 100:1", "restored/{column}/vellum_over_paper=100"),
                    ("1:1", "restored/{column}/vellum_over_paper=1"),
                    ("paper 100:1", "restored/{column}/vellum_over_paper=0.01"),
                    ("free scale", "restored/{column}/free_scale"),
                ),
                ("kept_mean_mm", "changed_mean_mm"),
            ),
        ),
    ),
)

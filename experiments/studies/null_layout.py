"""How the table of null controls looks: a part for each family of metrics."""

from __future__ import annotations

from experiments.reporting import Column, Layout, Section

_CORNERS = ("corner_mean_px", "corner_mean_mm", "corner_rigid_mean_mm", "corner_rigid_max_mm", "corners_missing")
_DENSE = ("dense_mean_mm", "dense_p95_mm", "page_coverage")
_DEPTH = ("depth_rms_mm", "depth_p95_mm", "depth_bias_mm", "depth_coverage")
_FLAT = ("flat_mean_mm", "flat_rigid_mean_mm", "flat_rigid_max_mm", "strain_rms", "stretch_l2", "area_error", "flips")
_LETTERS = ("misses", "misses_paper", "error_rate_percent", "word_recall", "word_precision")
_PICTURES = (
    "ms_ssim_docunet",
    "ms_ssim_wang",
    "ld_dis_px",
    "ad_dis",
    "lid_dis_px",
    "line_straightness_px",
    "text_lines",
)


def _null(*names: str) -> tuple[str, ...]:
    return tuple(f"null/{name}" for name in names)


LAYOUT = Layout(
    "Null controls: what a metric reads when nothing is right",
    "Each metric is given the truth, which must score best, and truths spoilt by a stated amount, as if a method had "
    "brought them. Geometry is judged through the true camera. What an alignment takes out a metric cannot see: that, "
    "too, is shown. Figures of calibration and length have their nulls in `plane_accuracy` (`fault/...`, a calibration "
    "made wrong on purpose), hidden writing in `textures` (lights that do not show it), two materials in `stiffness` "
    "(case N, a sheet of which nothing changed its size).",
    (
        Column("corner_mean_px", "corners, affine mean [px]", 3),
        Column("corner_mean_mm", "affine mean [mm]", 3),
        Column("corner_rigid_mean_mm", "rigid mean [mm]", 3),
        Column("corner_rigid_max_mm", "rigid max [mm]", 3),
        Column("corners_missing", "missing", 1),
        Column("dense_mean_mm", "dense mean [mm]", 3),
        Column("dense_p95_mm", "dense p95 [mm]", 3),
        Column("page_coverage", "coverage", 4),
        Column("depth_rms_mm", "RMS [mm]", 3, rms=True),
        Column("depth_p95_mm", "p95 [mm]", 3),
        Column("depth_bias_mm", "bias [mm]", 3),
        Column("depth_coverage", "coverage", 4),
        Column("flat_mean_mm", "affine mean [mm]", 4),
        Column("flat_rigid_mean_mm", "rigid mean [mm]", 4),
        Column("flat_rigid_max_mm", "rigid max [mm]", 3),
        Column("strain_rms", "strain RMS", 5),
        Column("stretch_l2", "stretch L2", 5),
        Column("area_error", "area error", 5),
        Column("flips", "flips", 1),
        Column("misses", "misses", 1),
        Column("misses_paper", "as the paper counts", 1),
        Column("error_rate_percent", "error rate [%]", 1),
        Column("word_recall", "true words read", 3),
        Column("word_precision", "words read that are true", 3),
        Column("ms_ssim_docunet", "MS-SSIM (DocUNet's sum)", 4),
        Column("ms_ssim_wang", "MS-SSIM (Wang's product)", 4),
        Column("ld_dis_px", "LD, DIS flow [px]", 3),
        Column("ad_dis", "AD, DIS flow", 4),
        Column("lid_dis_px", "Li-D, DIS flow [px]", 3),
        Column("line_straightness_px", "lines bend by [px]", 3),
        Column("text_lines", "lines found", 1),
        Column("slope_p90_deg", "p90 slope [deg]", 1),
        Column("relief_mm", "relief [mm]", 1),
    ),
    sections=(
        Section("The pages", "How bent they are.", ("page",), ("slope_p90_deg", "relief_mm")),
        Section(
            "Restored pages",
            "A checkered page restored by its true shape (`itself`), that moved by 1 mm or 1 % longer, restored by "
            "another page's shape, and as it lies. Corners are found in the pictures and compared with the flat "
            "page's. Rigid figures, and no affine one, see a wrong scale; no figure sees where the page lies.",
            _null("itself", "shifted", "stretched", "unflattened", "another"),
            (*_CORNERS, *_DENSE),
        ),
        Section(
            "Depth",
            "The page's true depth, the same 1 mm farther away, another page's, and that of an empty bed.",
            _null("itself", "shifted", "another", "bed"),
            _DEPTH,
        ),
        Section(
            "Flattened meshes",
            "The true flat places, moved by 1 mm, 1 % longer, and the bent mesh seen from above. Strain and stretch "
            "compare with the mesh and not with the truth, and the mesh's chords are a little shorter than the paper.",
            _null("itself", "shifted", "stretched", "unflattened"),
            _FLAT,
        ),
        Section(
            "Letters",
            "The true text, another page's, the true letters in random order, and no text at all, which the paper's "
            "count, without deletions, takes for perfect: `misses` decides.",
            _null("itself", "another", "shuffled", "nothing"),
            _LETTERS,
        ),
        Section(
            "Pictures",
            "The flat page's picture, the same one pixel aside, another page's, and bare paper, which is far from the "
            "worst: MS-SSIM rewards bright paper, and a flow that finds no ink moves little.",
            _null("itself", "shifted", "another", "nothing"),
            _PICTURES,
        ),
    ),
)

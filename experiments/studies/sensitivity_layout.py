"""How the sensitivity study's tables and curves look."""

from __future__ import annotations

from experiments.reporting import Changes, Column, Curve, Layout, Section, Versus
from experiments.studies.checkered import PAPER_MM, PAPER_PX

_ERRORS = (
    "corner_mean_px",
    "corner_mean_mm",
    "corner_rigid_mean_mm",
    "dense_mean_mm",
    "dense_p95_mm",
    "depth_rms_mm",
    "depth_coverage",
    "page_coverage",
    "at_rest",
    "folded_quads",
)
_COMPARED = ("dense_mean_mm", "corner_rigid_mean_mm", "corner_mean_mm")
_WRONG = ("restored/projector_yaw_deg=", "restored/baseline_percent=", "restored/focal_percent=")
_SLOPE, _NOISE, _MESH = "restored/slope_p90_deg=", "restored/noise_scale=", "restored/mesh="
_FILTERS, _RESTS = ("restored/denoise=false", "restored/denoise=true"), ("restored/rest=chord", "restored/rest=section")


def _with_more(conditions: tuple[str, ...]) -> tuple[str, ...]:
    """Each condition, and those that go on after it."""
    return tuple(name for condition in conditions for name in (condition, f"{condition}/"))


def _switched(conditions: tuple[str, ...]) -> tuple[tuple[str, str], ...]:
    """Pair what is switched with what is not, under whatever else is changed."""
    return tuple(pair for name in conditions for pair in ((name, "restored"), (f"{name}/", "restored/")))


def _curve(name: str, x: str, x_label: str, conditions: tuple[str, ...], *, log: bool) -> Curve:
    return Curve(name, x, x_label, "dense_mean_mm", "mean error of all pixels, rigid [mm]", conditions, log=log)


LAYOUT = Layout(
    "Sensitivity of the restoration",
    "The pages of experiment I, restored by the paper's method and by the best one while one thing is changed at a "
    "time. Page i is the same sheet in the same noise under every condition, so that differences are taken page by "
    "page. How the rig's own properties tell on the accuracy of planes is the experiment `ablations`.",
    (
        Column("corner_mean_px", "mean [px]", 3, {"restored": f"< {PAPER_PX}"}),
        Column("corner_mean_mm", "mean [mm]", 3, {"restored": f"< {PAPER_MM}"}),
        Column("corner_rigid_mean_mm", "rigid mean [mm]", 3),
        Column("dense_mean_mm", "dense mean [mm]", 3),
        Column("dense_p95_mm", "dense p95 [mm]", 3),
        Column("depth_rms_mm", "depth RMS [mm]", 3),
        Column("depth_coverage", "depth coverage", 4),
        Column("page_coverage", "coverage", 4),
        Column("at_rest", "at rest", share=True),
        Column("folded_quads", "folded quads", 0),
        Column("slope_p90_deg", "p90 slope [deg]", 1),
        Column("relief_mm", "relief [mm]", 1),
    ),
    sections=(
        Section(
            "Severity",
            "The same folds, bent more or less.",
            ("control", "unrestored", "unrestored/slope_p90_deg=", "restored", _SLOPE),
            (*_ERRORS, "slope_p90_deg", "relief_mm"),
        ),
        Section(
            "Noise and filter",
            "The camera's noise, in which the rig is calibrated too; and each method with the depth filter that it "
            "does not have, or without its own.",
            ("restored", _NOISE, *_with_more(_FILTERS)),
            _ERRORS,
        ),
        Section(
            "Mesh and rest lengths",
            "Vertices a side, and each method with the other's rest lengths: chords, or sections along the surface. "
            "Where noise would lengthen sections the chords stay (docs/adr/0016): on unfiltered depth as a rule.",
            ("restored", _MESH, *_with_more(_RESTS)),
            _ERRORS,
        ),
        Section(
            "Calibration",
            "The page scanned with a calibration that is wrong by so much: the projector turned about its upright "
            "axis, its distance from the camera or the camera's focal length longer. A wrong size does not show in an "
            "affine alignment. Epipolar culling refuses what such a calibration makes of a page, once it is wrong "
            "enough; a page with holes that no mesh can bridge has failed.",
            ("restored", *_WRONG),
            _ERRORS,
        ),
    ),
    versus=Versus(
        "Each method against the paper's by explicit Euler, under every change.",
        "paper_euler",
        ("restored", _SLOPE, _NOISE, _MESH, *_WRONG),
        ("dense_mean_mm", "corner_rigid_mean_mm"),
    ),
    changes=(
        Changes(
            "Changed against unchanged",
            "Each method against itself on the page as it is; a negative difference is an improvement.",
            tuple((condition, "restored") for condition in (_SLOPE, _NOISE, _MESH, *_WRONG)),
            _COMPARED,
        ),
        Changes(
            "Filter and rest lengths switched",
            "Each method against itself, nothing else being different.",
            (*_switched(_FILTERS), *_switched(_RESTS)),
            _COMPARED,
        ),
    ),
    curves=(
        _curve(
            "severity",
            "slope_p90_deg",
            "90th percentile of the slope [degrees]",
            ("unrestored", "restored"),
            log=True,
        ),
        _curve("noise", "noise_scale", "noise [times the rig's own]", ("unrestored", "restored", *_FILTERS), log=True),
        _curve("mesh", "mesh", "vertices a side", ("unrestored", "restored", *_RESTS), log=True),
        _curve("yaw", "projector_yaw_deg", "projector turned by [degrees]", ("unrestored", "restored"), log=False),
        _curve("baseline", "baseline_percent", "baseline too long by [%]", ("unrestored", "restored"), log=False),
        _curve("focal", "focal_percent", "focal length too long by [%]", ("unrestored", "restored"), log=False),
    ),
)

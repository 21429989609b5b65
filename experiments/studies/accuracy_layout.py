"""How the accuracy experiment's tables and figures look."""

from __future__ import annotations

from experiments.reporting import Column, Layout, Montage, Plot, Section
from experiments.studies.depth_picture import FULL_COLOUR_MM

# The paper states one kind of figure, the mean deviation from a plane: 0.25 to 0.5 mm for its setups, 0.31 mm for the
# one of experiments I and II. It stands beside every length as the yardstick that it is.
_TARGETS = ("white", "checkered", "sphere", "fault")
_STATED = dict.fromkeys(_TARGETS, "0.25..0.5")
_MEAN = dict.fromkeys(_TARGETS, "0.31 (0.25..0.5)")

FIGURES = (
    Column("plane_mean_abs_mm", "plane, mean deviation [mm]", 3, _MEAN),
    Column("plane_rms_mm", "plane, RMS [mm]", 3, _STATED),
    Column("flatness_mm", "flatness [mm]", 3, _STATED),
    Column("probing_form_mm", "probing error, form [mm]", 3, _STATED),
    Column("probing_size_mm", "probing error, size [mm]", 3, _STATED),
    Column("sphere_spacing_error_mm", "sphere spacing error [mm]", 3, _STATED),
    Column("length_error_mm", "error of 300 mm, RMS [mm]", 3, _STATED, rms=True),
    Column("depth_raw_rms_mm", "depth RMS [mm]", 3, _STATED),
    Column("depth_raw_bias_mm", "depth bias [mm]", 4, _STATED),
    Column("depth_coverage", "coverage", 4),
)
_RATIOS = (
    Column("bound_depth_mm", "depth RMS by noise alone [mm]", 3),
    Column("depth_rms_ratio", "depth RMS / bound", 2),
    Column("plane_rms_ratio", "plane RMS / bound", 2),
    Column("flatness_ratio", "flatness / bound", 2),
    Column("probing_form_ratio", "form / bound", 2),
    Column("probing_size_ratio", "size / bound, RMS", 1, rms=True),
    Column("sphere_spacing_ratio", "spacing / bound, RMS", 1, rms=True),
    Column("length_error_ratio", "length / bound, RMS", 1, rms=True),
)
_CALIBRATION = (
    Column("calib_camera_centre_error_mm", "camera along its axis [mm]", 3),
    Column("calib_camera_focal_error_px", "focal length [px]", 2),
)
_REST = (
    Column("plane_max_mm", "plane, max [mm]", 3),
    Column("length_error_max_mm", "error of 300 mm, max [mm]", 3),
    Column("lengths", "lengths", 0),
    Column("probed_points", "probed points", 0),
    Column("depth_raw_p95_mm", "depth p95 [mm]", 3),
    Column("depth_raw_max_mm", "depth max [mm]", 3),
    Column("tilt_deg", "tilt [deg]", 1),
    Column("slope_p90_deg", "p90 slope [deg]", 1),
    Column("relief_mm", "relief [mm]", 1),
    Column("calib_camera_rms_px", "camera RMS [px]", 3),
    Column("calib_projector_rms_px", "projector RMS [px]", 3),
)


def _metrics(*groups: tuple[Column, ...]) -> tuple[str, ...]:
    return tuple(column.metric for columns in groups for column in columns)


_BODIES = ("white", "checkered", "sphere", "sphere/checkered")

LAYOUT = Layout(
    "Accuracy of the reconstruction (section 2.5)",
    "Bodies of known shape in several poses, scanned through the estimated calibration: a plane and a plate with two "
    "balls, blank (`white`, `sphere`) and printed with a checkerboard. n counts poses. The paper's only measure is the "
    "mean deviation from a best-fit plane, 0.25 to 0.5 mm for its setups and 0.31 mm for this one: it stands beside "
    "every figure as a yardstick. Flatness, probing error and sphere spacing follow VDI/VDE 2634-2.",
    (*FIGURES, *_RATIOS, *_CALIBRATION, *_REST),
    (
        Plot("plane_mean_abs_mm", "plane_mean_abs_mm", "mean deviation from the best-fit plane [mm]", 0.31),
        Plot("length_error_mm", "length_error_mm", "error of 300 mm, RMS [mm]"),
    ),
    (
        Montage(
            "depth_error",
            (
                ("blank plane", "white_{trial}"),
                ("printed plane", "checkered_{trial}"),
                ("blank balls", "sphere_{trial}"),
                ("printed balls", "sphere_checkered_{trial}"),
            ),
            "pose",
            "Depth error along the line of sight: red too far, blue too near, full colour from "
            f"{FULL_COLOUR_MM:g} mm on, white exact, grey not measured.",
        ),
    ),
    (
        Section(
            "Figures",
            "Flatness and form are ranges over all points but the worst 3 per mille, so they grow with the number of "
            "points; size, spacing and bias are signed. Of the two balls the worse one counts. Lengths run between "
            "printed corners that no calibration has seen.",
            _BODIES,
            _metrics(FIGURES),
        ),
        Section(
            "Over what noise alone would make",
            "Each figure over the same figure of a perfect reading through a perfect calibration (Cramer-Rao bound of "
            "every pixel's stripe; for lengths, of a corner in one frame). About 1: only noise is left. Far above: "
            "ink, the target's border or the calibration.",
            _BODIES,
            _metrics(_RATIOS),
        ),
        Section(
            "What each figure sees of a wrong calibration",
            "The photographs of the first three poses again (blank plane, corners of the printed plane, blank balls) "
            "through a calibration made wrong on purpose: baseline + 1 %, camera's focal lengths + 1 %, projector "
            "turned by 0.1 degrees. A figure that stays is blind to that fault. All pixels are used, whatever "
            "culling says; what it would have kept is the coverage. The last columns are the calibration's own "
            "errors: a camera that is thought too far away (negative) with too long a lens sees the same, so its z "
            "changes and next to nothing in the world does.",
            ("fault/none", "fault/baseline", "fault/focal", "fault/yaw"),
            _metrics(FIGURES, _CALIBRATION),
        ),
    ),
)

"""Claims of section 2 and of its devices: corners, culling, textures, accuracy."""

from __future__ import annotations

from experiments.reporting.claims.claim import BEST, Claim, Line, mean
from experiments.reporting.claims.measures import Compared, Values
from experiments.reporting.claims.rules import Above, Between, stated, within

DETECTOR = Claim(
    "Accuracy of the corner detector",
    "2.2",
    "We use a Kitchen-Rosenfeld [10] corner detector to obtain sub-pixel feature measurements (0.1 pixel accuracy).",
    "Corners of a flat checkerboard of 300 corners, found in its picture, against where they are: root mean square of "
    "the distance, without any alignment. Best: saddle points.",
    (
        Line(
            "corners of the flat page",
            "0.1 px",
            mean("corner_distance", "control", "detector_rms_px", unit="px"),
            stated(0.1),
            mean("corner_distance", "control/saddle", "detector_rms_px", unit="px"),
        ),
    ),
    "Of Kitchen and Rosenfeld's response the centroid of its magnitude about the corner is taken: where four squares "
    "meet the response itself has four lobes and its maximum stands beside the corner.",
)


_WILD = "unguarded/culled/noise=4/tolerance=2"

CULLING = Claim(
    "Outliers are culled by epipolar constraints",
    "2.3",
    "Outliers are culled using epipolar constraints for the two devices.",
    "Crumpled checkerboards, photographed with four times the rig's noise and read without any guard: the brightest "
    "frame of each pixel, whatever it is. An outlier is off by more than 3 mm. Culled is what lies more than two "
    "projector pixels from its epipolar line, which takes both sweeps: with one alone a ray always meets the "
    "projector's plane.",
    (
        Line(
            "outliers that are culled",
            "no figure",
            mean("culling", _WILD, "recall_percent", unit="%", digits=1),
            Above(50.0),
        ),
        Line(
            "culled pixels that are outliers",
            "no figure",
            mean("culling", _WILD, "precision_percent", unit="%", digits=1),
            Above(50.0),
        ),
        Line(
            "depth RMS before over after",
            "no figure",
            Compared(
                Values("culling", "unguarded/gated/noise=4/no_gate", "depth_raw_rms_mm"),
                Values("culling", "unguarded/gated/noise=4/epipolar", "depth_raw_rms_mm"),
                digits=0,
            ),
            Above(1.0),
        ),
    ),
    "Of the decoded pixels {share} are outliers then, and {lost} of the good ones are lost with them. What survives "
    "are errors along the epipolar line: depth is still off by up to {left} on a page, and by up to {all} once the "
    "working volume and the neighbours have been asked too. At the rig's own noise {guarded} of the decoded pixels "
    "are outliers in the paper's reading, guarded by what this project asks of a peak, and {unguarded} in the "
    "unguarded one.",
    {
        "share": mean("culling", _WILD, "outliers_percent", unit="%", digits=1),
        "lost": mean("culling", _WILD, "good_lost_percent", unit="%", digits=2),
        "left": mean("culling", "unguarded/gated/noise=4/epipolar", "depth_raw_max_mm", unit="mm", digits=0),
        "all": mean("culling", "unguarded/gated/noise=4/all", "depth_raw_max_mm", unit="mm", digits=1),
        "guarded": mean("culling", "guarded/culled/noise=1/tolerance=2", "outliers_percent", unit="%", digits=3),
        "unguarded": mean("culling", "unguarded/culled/noise=1/tolerance=2", "outliers_percent", unit="%", digits=3),
    },
)


def _gain(light: str, text: str) -> Compared:
    metric = f"{text}_text_read"
    return Compared(
        Values("textures", f"restored/{light}", metric, BEST),
        Values("textures", f"unrestored/{light}", metric),
        difference=True,
    )


TEXTURES = Claim(
    "Textures under other lights register by themselves",
    "2.4",
    "Because the imaging device is the same optical path as the depth reconstruction device, all images captured will "
    "be registered to the 3D model (assuming that the manuscript and camera do not move).",
    "Crumpled manuscripts with three hidden texts, each of which one light alone shows. One scan and one flattening "
    "under the projector's light serve the pictures under all others, without any alignment. The share of hidden "
    "letters that read, restored minus as the page lies, and how far restored pixels are from their true places. Best "
    "method alone.",
    (
        Line("letters that read, ultra-violet: gain", "no figure", _gain("uv", "uv"), Above(0.0)),
        Line("letters that read, back-light: gain", "no figure", _gain("backlight", "backlight"), Above(0.0)),
        Line("letters that read, raking light: gain", "no figure", _gain("raking", "raking"), Above(0.0)),
        Line(
            "places of all pixels, under every light",
            "within 0.25 mm",
            mean("textures", "restored", "dense_mean_mm", BEST, "mm"),
            within(0.25),
        ),
    ),
    "Restored, {uv} of the letters read under ultra-violet light and {backlight} against the light (1 is all of them; "
    "guessing gives 0.05). Raking light reads {raking}: what it shows is relief, and on a crumpled page its own "
    "shadows are stronger.",
    {
        "uv": mean("textures", "restored/uv", "uv_text_read", BEST, digits=2),
        "backlight": mean("textures", "restored/backlight", "backlight_text_read", BEST, digits=2),
        "raking": mean("textures", "restored/raking", "raking_text_read", BEST, digits=2),
    },
)

HIGH_RESOLUTION = Claim(
    "The high-resolution picture registers easily",
    "4",
    "The high resolution and PAL signal use the same optical pathway, and the two images are easily registered. Thus "
    "the high-resolution imagery is used for the texturing.",
    "Pictures of 1996 x 1450 pixels with an unknown scale, aspect and crop are registered to the scan's own picture "
    "from the images alone; the map that is found against the true one, in pixels of the high-resolution picture. The "
    "bar, 0.3 of them, is this project's.",
    (
        Line(
            "crumpled manuscript, light from above",
            "no figure",
            mean("textures", "registration/above_fine", "registration_error_px", unit="px"),
            within(0.3),
        ),
        Line(
            "crumpled manuscript, ultra-violet",
            "no figure",
            mean("textures", "registration/uv_fine", "registration_error_px", unit="px"),
            within(0.3),
        ),
        Line(
            "vellum and paper (Experiment III)",
            "no figure",
            mean("stiffness", "unrestored/A", "registration_error_px", unit="px"),
            within(0.3),
        ),
    ),
    "One scale for each axis and one shift are all that two readouts of one sensor differ by, so a whole picture "
    "decides four numbers. The residual that the registration states of itself, {residual}, is the noise of single "
    "places, over which the map averages.",
    {"residual": mean("textures", "registration/above_fine", "registration_residual_px", unit="px")},
)

ACCURACY = Claim(
    "Accuracy of the 3D scan",
    "2.5, 4",
    "We estimate accuracies of 0.25mm to 0.5mm for our setups using this estimation approach. [...] The accuracy "
    "estimation of this setup (described in Section 2.5) is 0.31mm. [...] yields an accuracy in the field of "
    "approximately 0.25mm.",
    "The paper's own measure: a plane is scanned in several poses, a plane is fitted to the points, and their mean "
    "distance from it is the accuracy. A blank plane is what the paper describes; the printed one carries the "
    "checkerboard of Experiment I.",
    (
        Line(
            "blank plane",
            "0.25 to 0.5 mm",
            mean("plane_accuracy", "white", "plane_mean_abs_mm", unit="mm"),
            Between(0.25, 0.5),
        ),
        Line(
            "printed plane",
            "0.25 to 0.5 mm",
            mean("plane_accuracy", "checkered", "plane_mean_abs_mm", unit="mm"),
            Between(0.25, 0.5),
        ),
        Line(
            "printed plane against the figure of this setup",
            "0.31 mm",
            mean("plane_accuracy", "checkered", "plane_mean_abs_mm", unit="mm"),
            stated(0.31),
        ),
        Line(
            "printed plane against the figure of the conclusions",
            "0.25 mm",
            mean("plane_accuracy", "checkered", "plane_mean_abs_mm", unit="mm"),
            stated(0.25),
        ),
    ),
    "The synthetic rig has the paper's cameras and projector, but its noise is what its configuration says, not "
    "theirs, and every stripe's peak is fitted to a fraction of a pixel. The measure flatters, too: with a "
    "calibration whose baseline is wrong by one per cent the blank plane still reads {fault_plane}, while held-out "
    "lengths of about 300 mm are off by {fault_length} and depth by {fault_depth}. On the printed plane depth itself "
    "is off by {depth} in the root mean square.",
    {
        "fault_plane": mean("plane_accuracy", "fault/baseline", "plane_mean_abs_mm", unit="mm"),
        "fault_length": mean("plane_accuracy", "fault/baseline", "length_error_mm", unit="mm"),
        "fault_depth": mean("plane_accuracy", "fault/baseline", "depth_raw_rms_mm", unit="mm"),
        "depth": mean("plane_accuracy", "checkered", "depth_raw_rms_mm", unit="mm"),
    },
)

"""How the tables and figures of epipolar culling look."""

from __future__ import annotations

from experiments.reporting import Column, Layout, Montage, Section

FULL_COLOUR_MM = 1.0
PICTURED_NOISE = 4.0
PICTURED_GATES = {"no_gate": "as decoded", "epipolar": "epipolar culling", "all": "all gates"}

_SHARES = ("outliers_percent", "culled_percent", "recall_percent", "precision_percent", "good_lost_percent")

LAYOUT = Layout(
    "Epipolar culling (section 2.3)",
    "A decoded projector point must lie on the epipolar line of its camera pixel. That takes both sweeps: with one a "
    "ray always meets the projector's plane, and nothing can be culled. Here crumpled checkerboards, whose truth is "
    "known, are read in two ways: `guarded` as the paper reads, with what this project asks of a peak; `unguarded` "
    "takes the brightest frame of each pixel, whatever it is. `noise` multiplies that of the page's frames. An outlier "
    "is a decoded pixel of the page with a depth that is farther off than the limit; where there is none, there is no "
    "share of them, and the place is empty.",
    (
        Column("outlier_limit_mm", "outliers are off by more than [mm]", 1),
        Column("decoded_percent", "decoded [% of the page]", 1),
        Column("outliers_percent", "outliers [% of the decoded]", 3),
        Column("culled_percent", "culled [% of the decoded]", 3),
        Column("recall_percent", "culled of the outliers [%]", 1),
        Column("precision_percent", "outliers among the culled [%]", 1),
        Column("good_lost_percent", "good pixels lost [%]", 3),
        Column("depth_raw_rms_mm", "depth RMS [mm]", 3),
        Column("depth_raw_p95_mm", "depth p95 [mm]", 3),
        Column("depth_raw_max_mm", "depth max [mm]", 2),
        Column("depth_coverage", "coverage", 4),
        Column("slope_p90_deg", "p90 slope [deg]", 1),
        Column("relief_mm", "relief [mm]", 1),
    ),
    montages=(
        Montage(
            "depth_error",
            tuple((heading, f"page_{{trial}}_{gates}") for gates, heading in PICTURED_GATES.items()),
            caption=f"Depth error of the unguarded reading at {PICTURED_NOISE:g} times the noise: red too far, blue "
            f"too near, full colour from {FULL_COLOUR_MM:g} mm on, white exact, grey not measured.",
        ),
    ),
    sections=(
        Section("The pages", "Crumpled checkerboards.", ("page",), ("outlier_limit_mm", "slope_p90_deg", "relief_mm")),
        Section(
            "What is culled",
            "By the distance from the epipolar line, in projector pixels; the usual tolerance is 2.",
            ("guarded/culled/", "unguarded/culled/"),
            ("decoded_percent", *_SHARES),
        ),
        Section(
            "What that does to the depth map",
            "After no gate, after epipolar culling alone, after the other gates alone (working volume, neighbours, "
            "depth jumps), and after all of them.",
            ("guarded/gated/", "unguarded/gated/"),
            ("depth_raw_rms_mm", "depth_raw_p95_mm", "depth_raw_max_mm", "depth_coverage"),
        ),
    ),
)

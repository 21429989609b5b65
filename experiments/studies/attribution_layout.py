"""The steps between the paper's method and the best one: which variants there are, and how they are shown."""

from __future__ import annotations

from experiments.reporting import Changes, Column, Ladder, Layout, Section
from experiments.studies.checkered import PAPER_MM, PAPER_PX

STEPS = {
    "decoding": "sweeps read per pixel",
    "ink": "ink's shift taken out",
    "filter": "depth map filtered",
    "rests": "rest lengths along the surface",
    "solver": "static solver",
    "texture": "texture follows the surface",
}
"""What each step puts in the paper's place, in the order of the chain."""

START, END = "paper", "best"


def alone(step: str) -> str:
    """Name the paper's method with one step."""
    return f"alone/{step}"


def without(step: str) -> str:
    """Name the best method without one step."""
    return f"without/{step}"


PATH = tuple(f"path/{number}_{step}" for number, step in enumerate(STEPS, start=1))
"""The paper's method with the first step, with the first two, and so on to the best one."""


def variants() -> dict[frozenset[str], list[str]]:
    """Return every variant by the steps that are switched on in it, with the names of its conditions."""
    every, steps = frozenset(STEPS), list(STEPS)
    named = [(frozenset(), START), (every, END)]
    named += [(frozenset({step}), alone(step)) for step in steps]
    named += [(every - {step}, without(step)) for step in steps]
    named += [(frozenset(steps[: number + 1]), condition) for number, condition in enumerate(PATH)]
    found: dict[frozenset[str], list[str]] = {}
    for switched, condition in named:
        found.setdefault(switched, []).append(condition)
    return found


_SHOWN = (
    "corner_mean_px",
    "corner_mean_mm",
    "corner_max_mm",
    "meets_paper",
    "corner_rigid_mean_mm",
    "dense_mean_mm",
    "depth_rms_mm",
    "depth_coverage",
    "page_coverage",
    "at_rest",
    "folded_quads",
)
_COMPARED = ("dense_mean_mm", "corner_rigid_mean_mm", "corner_mean_mm", "corner_max_mm")
_RUNGS = (("the paper's method", START), *((f"+ {text}", PATH[i]) for i, text in enumerate(STEPS.values())))
_WORTH = (
    ("added to the paper's method", tuple((alone(step), START) for step in STEPS)),
    ("left out of the best", tuple((END, without(step)) for step in STEPS)),
)


def _saddle(conditions: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(f"{condition}/saddle" for condition in conditions)


def _ladder(metric: str, label: str, title: str, paper: float | None = None) -> Ladder:
    return Ladder(f"attribution_{metric}", title, metric, label, _RUNGS, _WORTH, paper)


LAYOUT = Layout(
    "Attribution: every step between the paper's method and the best one",
    "The pages of experiment I, restored by the paper's method (`paper`: a sweep read per frame, no ink correction, no "
    "filter, chords for rest lengths, the particle system, each quad's texture stretched evenly), by the best one "
    "(`best`) and by what lies between: the paper's with one step (`alone/STEP`), the best without one "
    "(`without/STEP`), and the steps added one after another in the order of the chain (`path/K_STEP`). Steps: "
    + "; ".join(f"`{step}`, {text}" for step, text in STEPS.items())
    + ". Mesh (45 x 45 unless set otherwise) and calibration are the same in all. Corners are the paper's "
    "Kitchen-Rosenfeld ones; the last section measures the same pictures with saddle corners.",
    (
        Column("corner_mean_px", "mean [px]", 3, {START: f"< {PAPER_PX}"}),
        Column("corner_mean_mm", "mean [mm]", 3, {START: f"< {PAPER_MM}"}),
        Column("corner_max_mm", "max [mm]", 3),
        Column("meets_paper", "within the paper's", share=True),
        Column("corner_rigid_mean_mm", "rigid mean [mm]", 3),
        Column("dense_mean_mm", "dense mean [mm]", 3),
        Column("dense_p95_mm", "dense p95 [mm]", 3),
        Column("depth_rms_mm", "depth RMS [mm]", 3),
        Column("depth_coverage", "depth coverage", 4),
        Column("page_coverage", "coverage", 4),
        Column("at_rest", "at rest", share=True),
        Column("folded_quads", "folded quads", 0),
        Column("detector_rms_px", "detector RMS [px]", 3),
        Column("slope_p90_deg", "p90 slope [deg]", 1),
        Column("relief_mm", "relief [mm]", 1),
    ),
    sections=(
        Section(
            "The path",
            "One step after another, in the order of the chain.",
            (START, *PATH),
            _SHOWN,
        ),
        Section("One step alone", "The paper's method with one step.", tuple(map(alone, STEPS)), _SHOWN),
        Section("One step left out", "The best method without one step.", tuple(map(without, STEPS)), _SHOWN),
        Section("The pages", "As they lay.", ("control", "unrestored"), (*_SHOWN, "slope_p90_deg", "relief_mm")),
        Section(
            "By saddle corners",
            "The same pictures; the detector is a step of the measurement, not of the method.",
            _saddle(("control", START, *PATH)),
            ("corner_mean_px", "corner_mean_mm", "corner_max_mm", "corner_rigid_mean_mm", "detector_rms_px"),
        ),
    ),
    changes=(
        Changes(
            "What each step does to the paper's method",
            "The paper's method with the step, against the paper's.",
            tuple((alone(step), START) for step in STEPS),
            _COMPARED,
        ),
        Changes(
            "What each step is worth at the end",
            "The best method without the step, against the best: positive is what its lack costs.",
            tuple((without(step), END) for step in STEPS),
            _COMPARED,
        ),
        Changes(
            "Along the path",
            "Each step against what stood before it, and the end against the start.",
            (*zip(PATH, (START, *PATH), strict=False), (END, START)),
            _COMPARED,
        ),
    ),
    ladders=(
        _ladder("dense_mean_mm", "mean error of all pixels, rigid [mm]", "Where the accuracy comes from: all pixels"),
        _ladder(
            "corner_mean_mm",
            "mean corner distance, affine [mm]",
            "Where the accuracy comes from: the paper's figure",
            PAPER_MM,
        ),
    ),
)

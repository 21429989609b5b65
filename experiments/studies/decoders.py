"""Every pattern on the same pages at equal numbers of frames: what a frame is worth."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

import data_synth
from data_synth import Blank, Checkerboard, Page, Rig, TrueSheet
from deskew import acquisition, metrics, pipeline, restoration
from deskew.errors import require
from deskew.types import Fringe, Fringes, PatternKind, Size, half_periods, n_planes
from experiments.reporting import Column, Layout
from experiments.settings import Config
from experiments.studies.bench import Bench, calibrated_bench
from experiments.studies.methods import require_methods
from experiments.studies.recipes import configured
from experiments.studies.study import Study
from experiments.studies.trial_sheets import require_sheets, severity, sheet_inputs, trial_sheet
from experiments.trials import Outcome, Recorder, TrialKey

_PERIOD_PX = 16.0
_STEPS_MAX = 128  # beyond them a frame is exposed more than once instead
_COARSE_SHARE = 8  # each longer fringe gets one frame in so many


@dataclass(frozen=True, slots=True)
class Plan:
    """How a pattern spends its frames.

    Attributes
    ----------
    pattern : PatternKind
        Kind.
    fringes : tuple of Fringe
        Of a phase pattern.
    exposures : int
        That are averaged into one frame, each counted as a frame.
    frames : int
        Spent, columns and rows together; white and black come on top for every pattern alike.
    """

    pattern: PatternKind
    fringes: Fringes
    exposures: int
    frames: int


class Decoders(Study):
    """The same crumpled sheet under every pattern; a trial is one sheet.

    A Gray code repeats its frames and averages them. Fringes take more steps, and are exposed repeatedly from 128
    frames an axis on; white and black are then averaged as well, which also helps the correction of ink. A line sweep
    can neither be cut nor spread: it takes one frame a projector line, 1792 of the default rig, and stands beside the
    others at their largest number of frames only.

    Conditions
    ----------
    `PAGE/PATTERN/FRAMES`
        PAGE is `white` or `checkered`, PATTERN a kind of pattern, FRAMES the number that was allowed: those of
        `decoders.frames`, and of a line sweep its own.
    """

    layout: ClassVar[Layout] = Layout(
        "Decoders at equal numbers of frames",
        "Depth of a crumpled page against the truth, through the estimated calibration. White and black frames come on "
        "top for every pattern alike.",
        (
            Column("frames", "frames", 0, headline=True),
            Column("depth_raw_rms_mm", "depth RMS [mm]", 3, headline=True, rms=True),
            Column("depth_raw_p95_mm", "depth p95 [mm]", 3, headline=True),
            Column("depth_raw_max_mm", "depth max [mm]", 2, headline=True),
            Column("depth_coverage", "coverage", 4, headline=True),
            Column("slope_p90_deg", "p90 slope [deg]", 1, headline=True),
            Column("relief_mm", "relief [mm]", 1, headline=True),
        ),
    )

    def plan(self, config: Config) -> list[TrialKey]:
        """Plan one trial a sheet."""
        require_methods(config)
        require_sheets(config)
        return Study.plan(self, config)

    def inputs(self, config: Config) -> dict[str, Path]:
        """Name the given sheets."""
        return sheet_inputs(config)

    def prepare(self, config: Config) -> Bench:
        """Calibrate once for all trials and all patterns, with line sweeps."""
        return calibrated_bench(config, configured(config.scan).mode)

    def run(self, config: Config, shared: Any, key: TrialKey) -> Outcome:
        """Scan one sheet, blank and checkered, by every pattern at every number of frames."""
        bench: Bench = shared
        record, rng = Recorder(key), key.generator()
        sheet = trial_sheet(config, key, rng)
        for name, page in (("white", Blank()), ("checkered", Checkerboard())):
            for allowed, plan in plans(bench.rig.projector.size, config.decoders.frames):
                condition = f"{name}/{plan.pattern}/{allowed}"
                with record.attempt(condition), record.stage("scan", condition):
                    figures = _depth_figures(config, bench, sheet, page, plan, rng)
                    record.add(condition, "-", {"frames": plan.frames} | severity(sheet) | figures)
        return record.outcome()


def plans(projector_size: Size, budgets: list[int]) -> list[tuple[int, Plan]]:
    """Spend each number of frames on each pattern; the line sweep comes once, with its own number.

    Parameters
    ----------
    projector_size : (width, height)
        Pixels.
    budgets : list of int
        Frames allowed, columns and rows together.
    """
    sweep = sum(projector_size)
    found = [(sweep, Plan(PatternKind.LINE_SWEEP, (), 1, sweep))]
    for allowed in budgets:
        found += [(allowed, plan) for plan in (_gray(projector_size, allowed), *_phases(projector_size, allowed))]
    return found


def _gray(projector_size: Size, allowed: int) -> Plan:
    once = sum(n_planes(extent) for extent in projector_size)
    require(allowed >= once, "decoders.frames", f"hold at least the {once} frames of a Gray code", allowed)
    return Plan(PatternKind.GRAY_CODE, (), allowed // once, allowed // once * once)


def _phases(projector_size: Size, allowed: int) -> tuple[Plan, Plan]:
    planes = n_planes(half_periods(Fringe(_PERIOD_PX, 4), max(projector_size)))
    exposures = -(-allowed // (2 * (_STEPS_MAX + planes)))
    axis = allowed // (2 * exposures)
    coded = (Fringe(_PERIOD_PX, axis - planes),)
    periods = [fringe.period_px for fringe in data_synth.default_fringes(PatternKind.MULTI_PHASE, projector_size)]
    coarse = max(4, axis // _COARSE_SHARE)
    steps = [coarse] * (len(periods) - 1)
    several = tuple(Fringe(p, n) for p, n in zip(periods, [*steps, axis - sum(steps)], strict=True))
    spent = 2 * axis * exposures
    return (
        Plan(PatternKind.GRAY_PHASE, coded, exposures, spent),
        Plan(PatternKind.MULTI_PHASE, several, exposures, spent),
    )


def _depth_figures(
    config: Config, bench: Bench, sheet: TrueSheet, page: Page, plan: Plan, rng: np.random.Generator
) -> dict[str, float]:
    rig = Rig(bench.rig.camera, bench.rig.projector, replace(bench.rig.config, exposures=plan.exposures))
    capture, truth = data_synth.render(rig, sheet, page, rng, plan.pattern, plan.fringes)
    how = configured(config.scan)
    decoded = pipeline.decode(capture, pipeline.decoder_for(how, plan.pattern))
    if how.ink:
        decoded = acquisition.correct_ink(bench.calibration, decoded, capture)
    true_points = truth.points_at(restoration.undistortion_map(bench.calibration.camera).astype(np.float64))
    return metrics.depth_error(acquisition.depth_map(bench.calibration, decoded), true_points)

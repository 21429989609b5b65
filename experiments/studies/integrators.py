"""Which integrator, and how: what "comparing integrators" asks of the paper's claim that Euler proved the fastest."""

from __future__ import annotations

from typing import Any, ClassVar

from deskew import flattening
from deskew.errors import require
from experiments.reporting import Column, Diagram, Layout, Panel, Section, Shares, Times
from experiments.settings import Config
from experiments.studies import courses, integrator_tests
from experiments.studies.study import Study
from experiments.trials import Outcome, Recorder, TrialKey

# Of the sheets in the map of outcomes so many are also timed, thrown and let bounce.
_N_FLOWN = 3
_N_FLATTENED = {"smoke": 5, "paper": 5, "full": 20}
_DEFAULT_DAMPING = 0.8
_EQUAL = (("free_flight/dt=", ""),)
_FLOWN = (*_EQUAL, ("free_flight/tolerance=", ", its own steps"))
_FLOOR = (("reference", "free_flight", "reference_floor_mm"),)


class Integrators(Study):
    """The paper's particle system by every integrator: where the answer is known, and on crumpled pages.

    `method` names integrators here. Trial i is sheet i; the first ones serve every part. A part that fails is listed.

    Conditions
    ----------
    `free_flight`
        A sheet thrown into the air, with all forces and no plane: the observed `order`, that of theory, and under "-"
        the reference's own floor (scipy's DOP853 at 1e-13 against 1e-11). `free_flight/dt=STEP`: each run, steps in
        units of 2 / omega of the stiffest mode. `free_flight/tolerance=MM`: the embedded pair choosing its steps.
    `contact/bounce`, `contact/bounce/steps=N`
        Balls that bounce once, against the closed form.
    `contact/ks=K`
        Crumpled pages of one mass, flattened under one weight with springs of k_s = K.
    `energy/dt=STEP`
        Drift of the energy that an undamped flight should keep.
    `stability/zeta=Z`, `stability/ks=K`
        The longest step at which nothing grows, found by bisection, beside linear theory.
    `flattening/zeta=Z`
        Crumpled pages to rest, at each damping ratio: cost, distance to the static solution, cost of one and the same
        residual. Under "-" the page, and how far the static solution of its chords is from the truth.
    `outcomes/push=P`
        Crumpled pages of 15 to 40 degrees, pushed with m g = P k r: flat, locked, folded or diverged.
    """

    layout: ClassVar[Layout] = Layout(
        "Comparing integrators (section 3.4)",
        "Steps are in units of 2 / omega of the stiffest mode, the longest that an undamped leapfrog may make; "
        "evaluations count rejected and halved steps, and products with the stiffness matrix of implicit Euler. Where "
        "steps are halved at contact a method of equal steps has become an adaptive one.",
        (
            Column("order", "observed order", 2),
            Column("order_theory", "theory", 0),
            Column("reference_floor_mm", "reference's floor [mm]", 16),
            Column("way_mm", "way [mm]", 1),
            Column("error_mm", "error [mm]", 6),
            Column("energy_drift", "energy drift", 5),
            Column("stable_dt", "longest stable step [2/omega]", 3),
            Column("stable_dt_theory", "theory [2/omega]", 3),
            Column("stable_dt_ratio", "measured / theory", 3),
            Column("stable_dt_s", "longest stable step [s]", 6),
            Column("stable_dt_theory_s", "theory [s]", 6),
            Column("unlimited", "unlimited", share=True),
            Column("at_rest", "at rest", share=True),
            Column("steps", "steps", 0),
            Column("steps_rejected", "rejected", 0),
            Column("force_evaluations", "evaluations", 0),
            Column("evaluations_to_residual", "to the residual", 0),
            Column("contacts", "contacts", 0),
            Column("folded_quads", "folded quads", 0),
            Column("flat", "flat", share=True),
            Column("locked", "locked", share=True),
            Column("folded", "folded", share=True),
            Column("diverged", "diverged", share=True),
            Column("discretisation_mm", "chords' own error [mm]", 4),
            Column("slope_p90_deg", "p90 slope [deg]", 1),
            Column("relief_mm", "relief [mm]", 1),
        ),
        sections=(
            Section(
                "Order in free flight",
                "The error's power of the step. The reference is scipy's DOP853; its floor is what it changes by when "
                "its tolerance does.",
                ("free_flight",),
                ("order", "order_theory", "reference_floor_mm", "way_mm"),
            ),
            Section(
                "Order through contact", "A bounce leaves every method of order one.", ("contact/bounce",), ("order",)
            ),
            Section(
                "Longest stable step",
                "By bisection, and by linear theory from the integrator's own table.",
                ("stability/",),
                ("stable_dt", "stable_dt_theory", "stable_dt_ratio", "stable_dt_s", "stable_dt_theory_s", "unlimited"),
            ),
            Section("Energy", "Largest change in an undamped flight.", ("energy/",), ("energy_drift",)),
            Section(
                "Flattening",
                "Crumpled pages of 45 x 45 vertices to rest, each integrator at .9 of its longest stable step, "
                "implicit Euler at 4. `error` is the mean distance to the static solution of the same springs; the "
                "error of the chords themselves, under `-`, dwarfs it. `to the residual`: evaluations until the page "
                "lies flat with an energy within 1 % of the least.",
                ("flattening/",),
                (
                    "at_rest",
                    "steps",
                    "steps_rejected",
                    "force_evaluations",
                    "evaluations_to_residual",
                    "contacts",
                    "error_mm",
                    "discretisation_mm",
                    "slope_p90_deg",
                    "relief_mm",
                ),
            ),
            Section(
                "Stiffer springs under the same weight",
                "The paper: it is easy to make k_s too high, and Euler must then take smaller steps.",
                ("contact/ks=",),
                ("at_rest", "steps", "force_evaluations", "evaluations_to_residual", "error_mm"),
            ),
            Section(
                "Outcomes by push",
                "Pages of 15 to 40 degrees; the push is m g over k r.",
                ("outcomes/",),
                ("flat", "locked", "folded", "diverged", "error_mm", "slope_p90_deg", "relief_mm"),
            ),
        ),
        times=(
            Times(
                "Time",
                "Wall-clock seconds of one flattening after a warm-up, median of the pages.",
                (
                    Column("seconds_flatten", "to rest [s]", 4),
                    Column("seconds_to_residual", "to the residual [s]", 4),
                ),
            ),
        ),
        diagrams=(
            Diagram(
                "work_precision",
                "A thrown sheet in free flight: error against what it costs; dotted: the reference's own error",
                (
                    Panel(_EQUAL, "", "error_mm", "step [2 / omega]", "error [mm]", levels=_FLOOR),
                    Panel(_FLOWN, "force_evaluations", "error_mm", "force evaluations", "error [mm]", levels=_FLOOR),
                    Panel(_FLOWN, "seconds_fly", "error_mm", "seconds", "error [mm]", levels=_FLOOR),
                ),
            ),
            Diagram(
                "stable_steps",
                "Longest stable step: measured (markers) and by linear theory (broken)",
                (
                    Panel(
                        (("stability/zeta=", ""),),
                        "",
                        "stable_dt",
                        "damping ratio of the stiffest mode",
                        "step [2 / omega]",
                        theory="stable_dt_theory",
                        linear=True,
                    ),
                    Panel(
                        (("stability/ks=", ""),),
                        "",
                        "stable_dt_s",
                        "k_s [kg/s^2]",
                        "step [s]",
                        theory="stable_dt_theory_s",
                    ),
                ),
            ),
            Diagram(
                "flattening",
                "Crumpled pages to the same residual, and how far from the static solution they end; "
                "dotted: error of the chords themselves",
                (
                    Panel(
                        (("flattening/", ""),),
                        "",
                        "evaluations_to_residual",
                        "damping ratio",
                        "force evaluations to the residual",
                    ),
                    Panel(
                        (("flattening/", ""),), "", "seconds_to_residual", "damping ratio", "seconds to the residual"
                    ),
                    Panel(
                        (("flattening/", ""),),
                        "seconds_flatten",
                        "error_mm",
                        "seconds to rest",
                        "distance to the static solution [mm]",
                        levels=(("chords", "flattening/zeta=0.8", "discretisation_mm"),),
                    ),
                ),
            ),
        ),
        shares=(
            Shares(
                "outcomes",
                "How crumpled pages of 15 to 40 degrees end, by the strength of the push",
                "push: m g / (k r)",
                "outcomes/push=",
                (("flat", "tab:green"), ("locked", "tab:orange"), ("folded", "tab:red"), ("diverged", "black")),
            ),
        ),
    )

    def plan(self, config: Config) -> list[TrialKey]:
        """Plan the parts: each a trial by itself, and a trial a sheet where sheets differ."""
        for name in (*config.methods, *config.integrators.mapped):
            flattening.find_integrator(name)
        require(not config.sheet.paths, "sheet.paths", "be left out of this experiment", config.sheet.paths)
        own = config.integrators
        n_flattened = _N_FLATTENED[config.budget.name]
        damped = [f"stability/zeta={ratio:g}" for ratio in own.damping_ratios]
        parts = {
            "free_flight": min(config.trials, _N_FLOWN),
            "contact/bounce": 1,
            "energy": min(config.trials, _N_FLOWN),
            **dict.fromkeys([*damped, *(f"stability/ks={k_s:g}" for k_s in own.stiffness)], 1),
            "flattening": min(config.trials, n_flattened),
            "contact/ks": min(config.trials, n_flattened),
            "outcomes": config.trials,
        }
        return [
            TrialKey(config.experiment, part, "-", trial, config.seed)
            for part, n in parts.items()
            for trial in range(n)
        ]

    def run(self, config: Config, shared: Any, key: TrialKey) -> Outcome:
        """Carry one part out."""
        record, rng, own = Recorder(key), key.generator(), config.integrators
        part, _, value = key.condition.partition("=")
        if part == "free_flight":
            integrator_tests.measure_free_flight(record, rng, config.methods)
        elif part == "contact/bounce":
            integrator_tests.measure_bounce(record, config.methods)
        elif part == "energy":
            integrator_tests.measure_drift(record, rng, config.methods)
        elif part.startswith("stability"):
            damping, k_s = (float(value), 1.0) if part.endswith("zeta") else (_DEFAULT_DAMPING, float(value))
            integrator_tests.measure_stable_step(record, key.condition, rng, config.methods, damping, k_s)
        elif part == "outcomes":
            slope = courses.spread_slope(key.trial)
            page = courses.crumpled_page(rng, (config.mesh.rows, config.mesh.columns), slope)
            courses.map_outcomes(record, page, own.pushes, own.mapped)
        else:
            page = courses.crumpled_page(rng, (config.mesh.rows, config.mesh.columns), config.sheet.slope_p90_deg)
            _flatten(record, page, part, config)
        return record.outcome()


def _flatten(record: Recorder, page: courses.Page, part: str, config: Config) -> None:
    about = {
        "slope_p90_deg": page.slope_p90_deg,
        "relief_mm": page.relief_mm,
        "discretisation_mm": courses.rigid_mean(page.rest, page.flat),
    }
    if part == "flattening":
        runs = {f"flattening/zeta={ratio:g}": {"damping_ratio": ratio} for ratio in config.integrators.damping_ratios}
    else:
        # The weight is that of the default push at k_s = 1, whatever the stiffness.
        runs = {f"contact/ks={k_s:g}": {"k_s": k_s, "push": 0.5 / k_s} for k_s in config.integrators.stiffness}
    for condition, settings in runs.items():
        record.add(condition, "-", about)
        for method in config.methods:
            courses.measure_flattening(record, condition, page, method, **settings)

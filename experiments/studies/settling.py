"""Sections 3.3.2 and 3.4: what k_r, step halving, stiffness and the push do, and whether least energy means done."""

from __future__ import annotations

from typing import Any, ClassVar

from deskew import flattening
from deskew.errors import require
from deskew.types import Flattened
from experiments.reporting import Layout
from experiments.settings import Config
from experiments.studies import courses
from experiments.studies.endings import ENDS, STOPS, EnergyStop, ending, energy_stop
from experiments.studies.settling_layout import LAYOUT
from experiments.studies.study import Study
from experiments.studies.trial_sheets import refuse_sheets
from experiments.trials import Outcome, Recorder, TrialKey

_METHODS = ("paper_euler", "paper_rk4")
_COUNTED = ("steps", "steps_rejected", "contacts", "penetration_mm")
_LONG_STEP = 2.0


class Settling(Study):
    """Crumpled pages of 15 to 40 degrees under the paper's particle system, one of its constants changed at a time.

    Conditions
    ----------
    `page`
        How bent the pages are, and how far the paper's chords are from the truth whatever flattens them.
    `restitution/k_r=K`
        Pages at one coefficient of restitution.
    `halving/working`, `halving/literal`, `halving/none`
        Steps halved as this project reads the paper, as the paper prints it, and not at all; `halving/long_step` is the
        first with a step twice the chosen one, which is .9 of the longest stable one.
    `stiffer/same_step/times=K`, `stiffer/own_step/times=K`
        Springs K times as stiff under K times the push: with the step that suits k_s = 1, and with their own.
    `energy/push=P`
        Pages pushed with m g = P k r: how they end, and where they would if energy alone said when.
    """

    layout: ClassVar[Layout] = LAYOUT

    def plan(self, config: Config) -> list[TrialKey]:
        """Plan one trial a page."""
        for name in config.methods:
            require(name in _METHODS, "method", f"be of {', '.join(_METHODS)} in this experiment", name)
        refuse_sheets(config, "this experiment has its own sheets, of 15 to 40 degrees")
        return Study.plan(self, config)

    def run(self, config: Config, shared: Any, key: TrialKey) -> Outcome:
        """Flatten one page under every setting."""
        record, rng = Recorder(key), key.generator()
        shape = config.mesh.rows, config.mesh.columns
        page = courses.crumpled_page(rng, shape, courses.spread_slope(key.trial))
        chords = courses.rigid_mean(page.rest, page.flat)
        about = {"slope_p90_deg": page.slope_p90_deg, "relief_mm": page.relief_mm, "discretisation_mm": chords}
        record.add("page", "-", about)
        for method in config.methods:
            _Runs(record, page, method, config).carry_out()
        return record.outcome()


class _Runs:
    """One page by one method under every setting."""

    def __init__(self, record: Recorder, page: courses.Page, method: str, config: Config) -> None:
        self.record, self.page, self.method, self.own = record, page, method, config.settling

    def carry_out(self) -> None:
        """Change one constant after the other."""
        for k_r in self.own.restitutions:
            self._add(f"restitution/k_r={k_r:g}", k_r=k_r)
        step = 0.0
        for halving in ("working", "literal", "none"):
            result = self._add(f"halving/{halving}", halving=halving)
            step = result.counters["dt"]
        self._add("halving/long_step", dt=_LONG_STEP * step)
        for times in self.own.stiffer:
            for name, settings in (("same_step", {"dt": step}), ("own_step", {})):
                self._add(f"stiffer/{name}/times={times:g}", k_s=times, **settings)
        for push in self.own.pushes:
            condition = f"energy/push={push:g}"
            stop = energy_stop(self._add(condition, push=push), self.page.energy)
            self.record.add(condition, self.method, _stop_figures(stop))

    def _add(self, condition: str, **settings: object) -> Flattened:
        """Flatten and record how it ended and what it cost."""
        most = self.own.max_steps
        result = flattening.flatten(self.page.sheet, method=self.method, max_steps=most, **settings)
        ended = ending(result, most)
        figures = {name: float(name == ended) for name in ENDS}
        if ended != "diverged":  # nothing that counts as a length is left of such a sheet
            figures |= {name: result.counters[name] for name in _COUNTED}
            figures["time_s"] = result.counters["time"]
            figures["error_mm"] = courses.rigid_mean(result.vertices, self.page.rest)
        if ended == "flat":
            k_s = float(str(settings.get("k_s", 1.0)))
            figures["energy_over_flat"] = result.counters["spring_energy"] / (k_s * self.page.energy)
            figures["steps_to_rest"] = result.counters["steps"]
        self.record.add(condition, self.method, figures)
        return result


def _stop_figures(stop: EnergyStop) -> dict[str, float]:
    figures = {name: float(name == stop.kind) for name in STOPS}
    return figures if stop.energy_ratio is None else figures | {"stop_energy_ratio": stop.energy_ratio}

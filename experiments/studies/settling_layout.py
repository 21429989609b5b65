"""How the tables and figures of the particle system's settling look."""

from __future__ import annotations

from experiments.reporting import Column, Layout, Section, Shares
from experiments.studies.endings import ENDS, STOPS

_COST = ("steps_to_rest", "steps_rejected", "contacts", "error_mm")

LAYOUT = Layout(
    "How the particle system settles (sections 3.3.2 and 3.4)",
    "The paper's mass-spring system on crumpled pages of 45 x 45 samples, from gently to steeply bent, one constant "
    "changed at a time. A page ends `flat` (at rest, every particle within 0.05 mm of the plane, no quad turned over), "
    "`folded`, `locked` (at rest in a buckle above the plane), `unfinished` (its steps ran out) or `diverged` (the "
    "springs tore apart). `error` is the mean distance to where the same springs have the least energy, found by "
    "another solver; how far that is from the true page, which no setting here can help, is `chords' own error`.",
    (
        Column("flat", "flat", share=True),
        Column("folded", "folded", share=True),
        Column("locked", "locked", share=True),
        Column("unfinished", "unfinished", share=True),
        Column("diverged", "diverged", share=True),
        Column("penetration_mm", "deepest below the plane [mm]", 3),
        Column("steps_to_rest", "steps until flat", 0),
        Column("time_s", "time reached [s]", 3),
        Column("steps_rejected", "halved", 0),
        Column("contacts", "bounces", 0),
        Column("error_mm", "error [mm]", 4),
        Column("energy_over_flat", "energy over the least", 5),
        Column("stop_flat", "stops: flat", share=True),
        Column("stop_folded", "stops: folded", share=True),
        Column("stop_locked_less", "stops: locked, less energy than flat", share=True),
        Column("stop_locked_more", "stops: locked, more", share=True),
        Column("stop_never", "never stops", share=True),
        Column("stop_energy_ratio", "energy there over the flat page's", 3),
        Column("discretisation_mm", "chords' own error [mm]", 4),
        Column("slope_p90_deg", "p90 slope [deg]", 1),
        Column("relief_mm", "relief [mm]", 1),
    ),
    sections=(
        Section("The pages", "Mirror folds.", ("page",), ("discretisation_mm", "slope_p90_deg", "relief_mm")),
        Section(
            "Restitution",
            "A particle that meets the plane leaves it with k_r of its speed. The paper found 0.1 to be appropriate.",
            ("restitution/k_r=",),
            (*ENDS, *_COST),
        ),
        Section(
            "Step halving",
            "The paper makes a step again, half as long, while a particle is below the plane. `working` does so beyond "
            "0.05 mm and doubles the step again later; `literal` does what is printed; `none` lifts the particle and "
            "goes on. `long_step` is `working` from twice the chosen step, beyond what is stable.",
            ("halving/working", "halving/literal", "halving/none", "halving/long_step"),
            (*ENDS, "penetration_mm", "time_s", *_COST),
        ),
        Section(
            "Stiffer springs",
            "k_s raised so many times, and the push with it: `same_step` keeps the step of k_s = 1, `own_step` takes "
            "the shorter one that suits.",
            ("stiffer/same_step/", "stiffer/own_step/"),
            (*ENDS, "steps_to_rest", "error_mm"),
        ),
        Section(
            "Energy under the usual rule",
            "How near the spring energy is to the least that the page can have, where the page came to rest flat. The "
            "push is m g over k r.",
            ("energy/push=",),
            (*ENDS, "energy_over_flat", "steps_to_rest", "error_mm"),
        ),
        Section(
            "Energy alone",
            "The paper's process is complete when the internal energy is minimised. Here the same runs stop at the "
            "first look, of one every 200 steps, since which the energy has not changed: what they stop on, and its "
            "energy over that of the flat page.",
            ("energy/push=",),
            (*STOPS, "stop_energy_ratio"),
        ),
    ),
    shares=(
        Shares(
            "energy_alone",
            "What a run is stopped on by its energy alone, by the strength of the push",
            "push: m g / (k r)",
            "energy/push=",
            (
                ("stop_flat", "tab:green"),
                ("stop_locked_less", "tab:orange"),
                ("stop_locked_more", "gold"),
                ("stop_folded", "tab:red"),
                ("stop_never", "tab:gray"),
            ),
        ),
    ),
)

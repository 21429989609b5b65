"""The sheets of two materials that experiment III photographs, one a case and trial."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

import data_synth
from data_synth import PAGE_SIZE_MM, Case, TwoMaterials, read_two_materials
from deskew.errors import require
from experiments.settings import Config
from experiments.studies.given_sheets import read_sheet
from experiments.trials import TrialKey, trial_keys


def case_keys(config: Config) -> list[TrialKey]:
    """Plan one key a case and trial; the condition of the key ends in the case.

    Raises
    ------
    InputError
        If there are fewer files than trials, or one is no sheet of two materials.
    """
    sheet, n = config.sheet, len(config.sheet.paths)
    require(sheet.kind == "mirror", "sheet.kind", "be left out: this experiment has its own sheets", sheet.kind)
    require(n == 0 or config.trials <= n, "trials", f"be at most {n}, one a file of sheet.paths", config.trials)
    require(n == 0 or not sheet.drawn, "sheet.drawn", "be false where sheet.paths gives the sheets", sheet.drawn)
    if n == 0:
        return [key for case in Case for key in trial_keys(config, f"restored/{case}")]
    keys = []
    for plain, path in zip(trial_keys(config), map(Path, sheet.paths), strict=False):
        read_sheet(path, PAGE_SIZE_MM)
        keys.append(replace(plain, condition=f"restored/{read_two_materials(path).case}"))
    return keys


def case_of(key: TrialKey) -> Case:
    """Return the case of a key that :func:`case_keys` planned."""
    return Case(key.condition.rsplit("/", 1)[-1])


def two_materials(config: Config, key: TrialKey, rng: np.random.Generator) -> TwoMaterials:
    """Return a trial's sheet, fine enough to be rendered.

    Trial i takes file i of `sheet.paths`; without any, shipped sheet i modulo 5 of its case, or with `sheet.drawn` one
    of its own.

    Parameters
    ----------
    config : Config
        Its `sheet`.
    key : TrialKey
        One that :func:`case_keys` planned.
    rng : numpy Generator
        The trial's own; only drawn sheets take from it.
    """
    case = case_of(key)
    if config.sheet.paths:
        two = read_two_materials(Path(config.sheet.paths[key.trial]))
    elif config.sheet.drawn:
        two = data_synth.draw_two_materials(rng, case)
    else:
        two = data_synth.shipped_two_materials(case, key.trial % data_synth.N_SHIPPED)
    return replace(two, sheet=data_synth.refined(two.sheet))

"""The sheet that a trial photographs: mirror folds, a physical crumple or the user's own, as `sheet.*` asks."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import data_synth
from data_synth import PAGE_SIZE_MM, TrueSheet
from deskew.errors import require
from experiments.settings import Config, SheetSettings
from experiments.studies.given_sheets import read_sheet, refined_if_short
from experiments.trials import TrialKey

_DRAWN_DEG = (3.0, 30.0)  # what a drawn physical crumple can be asked for


def require_sheets(config: Config, page_size_mm: tuple[float, float] = PAGE_SIZE_MM) -> None:
    """Refuse, while the trials are planned, sheets that they could not have; given files are read.

    Raises
    ------
    InputError
        If there are fewer files than trials or one is no sheet, or a setting is out of its kind's range.
    """
    sheet, n = config.sheet, len(config.sheet.paths)
    require(n == 0 or config.trials <= n, "trials", f"be at most {n}, one a file of sheet.paths", config.trials)
    require(n == 0 or not sheet.drawn, "sheet.drawn", "be false where sheet.paths gives the sheets", sheet.drawn)
    for path in sheet.paths[: config.trials]:
        read_sheet(Path(path), page_size_mm)
    if sheet.kind == "physical" and sheet.drawn:
        low, high = _DRAWN_DEG
        wanted = f"lie in [{low:g}, {high:g}] degrees for drawn physical sheets"
        require(low <= sheet.slope_p90_deg <= high, "sheet.slope_p90_deg", wanted, sheet.slope_p90_deg)


def refuse_sheets(config: Config, reason: str) -> None:
    """Refuse a choice of sheets where an experiment has its own bodies."""
    plain = SheetSettings()
    for name in ("paths", "kind", "drawn"):
        given = getattr(config.sheet, name)
        require(given == getattr(plain, name), f"sheet.{name}", f"be left out: {reason}", given)


def sheet_inputs(config: Config) -> dict[str, Path]:
    """Name the given sheets, for `Study.inputs`."""
    return {f"sheet.paths[{i}]": Path(path) for i, path in enumerate(config.sheet.paths)}


def trial_sheet(
    config: Config, key: TrialKey, rng: np.random.Generator, page_size_mm: tuple[float, float] = PAGE_SIZE_MM
) -> TrueSheet:
    """Return a trial's sheet, refined for rendering where that helps.

    Trial i takes file i of `sheet.paths`; without any, mirror folds are drawn, and of `sheet.kind=physical` trial i
    takes shipped crumple i modulo 8, so that its seed decides the noise alone, or with `sheet.drawn` one of its own.

    Parameters
    ----------
    config : Config
        Its `sheet`, which :func:`require_sheets` has passed.
    key : TrialKey
        The trial.
    rng : numpy Generator
        The trial's own; only drawn sheets take from it.
    page_size_mm : (width, height)
        Page printed on the sheet [mm].
    """
    sheet = config.sheet
    if sheet.paths:
        return refined_if_short(read_sheet(Path(sheet.paths[key.trial]), page_size_mm))
    if sheet.kind == "mirror":
        return data_synth.crumpled(rng, page_size_mm, sheet.slope_p90_deg)
    if sheet.drawn:
        return data_synth.drawn_crumple(rng, sheet.slope_p90_deg)
    return data_synth.shipped_crumple(key.trial % data_synth.N_CRUMPLES)


def severity(sheet: TrueSheet) -> dict[str, float]:
    """Return how bent a sheet is, `slope_p90_deg` and `relief_mm`: every table of rendered sheets has both."""
    return {"slope_p90_deg": sheet.slope_p90_deg, "relief_mm": sheet.relief_mm}

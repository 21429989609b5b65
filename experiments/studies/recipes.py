"""How each method's pages are scanned: by the recipe that belongs to the method, unless the configuration says else."""

from __future__ import annotations

from deskew.plugins import Kind
from deskew.recipes import PAPER, Recipe, recipe_for
from deskew.types import PatternKind
from experiments.settings import Config, ScanSettings
from experiments.studies.methods import kind_of


def configured(settings: ScanSettings, own: Recipe = PAPER) -> Recipe:
    """Return `own` with whatever the configuration sets in its place."""
    return Recipe(
        own.mode if settings.mode is None else settings.mode,
        own.ink if settings.ink is None else settings.ink,
        own.denoise if settings.denoise is None else settings.denoise,
    )


def calibration_mode(config: Config) -> str:
    """Return how boards' sweeps are read before pages are scanned for the methods under test: one way for all."""
    modes = {recipe.mode for recipe in methods_by_recipe(config)}
    return "spatial" if modes == {"spatial"} else "temporal"


def methods_by_recipe(config: Config, pattern: PatternKind = PatternKind.LINE_SWEEP) -> dict[Recipe, list[str]]:
    """Return the methods under test that need a scan, together where one of captures of a pattern serves them."""
    grouped: dict[Recipe, list[str]] = {}
    for method in [name for name in config.methods if kind_of(config, name) is not Kind.DEWARPER]:
        grouped.setdefault(configured(config.scan, recipe_for(method, pattern)), []).append(method)
    return grouped

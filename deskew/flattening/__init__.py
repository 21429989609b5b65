"""Flattening: the paper's mass-spring particle system (section 3), and the same springs solved for rest at once."""

from deskew.flattening.inside import flat_surface
from deskew.flattening.materials import middles, with_stiffness
from deskew.flattening.methods import DEFAULT, METHODS, Flattener, find_integrator, find_method, flatten
from deskew.flattening.schemes import INTEGRATORS
from deskew.flattening.settings import ParticleSettings, StaticSettings

__all__ = [
    "DEFAULT",
    "INTEGRATORS",
    "METHODS",
    "Flattener",
    "ParticleSettings",
    "StaticSettings",
    "find_integrator",
    "find_method",
    "flat_surface",
    "flatten",
    "middles",
    "with_stiffness",
]

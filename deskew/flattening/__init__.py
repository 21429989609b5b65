"""Flattening: the paper's mass-spring particle system (section 3)."""

from deskew.flattening.methods import METHODS, Flattener, find_method, flatten
from deskew.flattening.settings import ParticleSettings

__all__ = ["METHODS", "Flattener", "ParticleSettings", "find_method", "flatten"]

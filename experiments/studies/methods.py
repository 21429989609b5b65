"""The methods under test, by name."""

from __future__ import annotations

from deskew.flattening import find_method
from experiments.settings import Config


def require_methods(config: Config) -> None:
    """Raise an InputError unless every method under test is a known one."""
    for name in config.methods:
        find_method(name)

"""The values of a parsed TOML or JSON table, each checked as it is taken."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from deskew.errors import require
from deskew.io.files import shown
from deskew.types import Floats, Size

MAX_SIDE = 1 << 16
"""Largest width or height that is believed [px]."""


def _is_integer(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)  # True is an int to Python, not to a reader


def _is_number(value: object) -> bool:
    if isinstance(value, int) and not isinstance(value, bool):
        return abs(value) < 1 << 53  # beyond it a float would be another number
    return isinstance(value, float) and math.isfinite(value)


@dataclass(frozen=True, slots=True)
class Fields:
    """One table of a file.

    Attributes
    ----------
    values : mapping
        As parsed.
    name : str
        File, and table within it, for messages.
    """

    values: Mapping[str, Any]
    name: str

    def _at(self, key: str) -> str:
        return f"{self.name}: {key}"

    def only(self, required: Iterable[str], optional: Iterable[str] = ()) -> None:
        """Require every key of `required` and none beyond `optional`: a misspelt key must not pass silently."""
        wanted, known = set(required), {*required, *optional}
        missing, unknown = sorted(wanted - self.values.keys()), sorted(self.values.keys() - known)
        got = f"none named {missing[0]}" if missing else f"also {shown(unknown[0]) if unknown else ''}"
        require(not missing and not unknown, self.name, f"have the keys {', '.join(sorted(known))}", got)

    def version(self, key: str, known: int) -> None:
        """Require the file's schema version to be the one this program writes."""
        value = self.values[key]
        require(_is_integer(value) and value == known, self._at(key), f"be {known}", shown(value))

    def integer(self, key: str, low: int, high: int) -> int:
        """Return an integer in [low, high]."""
        value = self.values[key]
        require(
            _is_integer(value) and low <= value <= high,
            self._at(key),
            f"be an integer in [{low}, {high}]",
            shown(value),
        )
        return int(value)

    def positive(self, key: str) -> float:
        """Return a finite number above 0."""
        value = self.values[key]
        require(_is_number(value) and value > 0, self._at(key), "be a finite number above 0", shown(value))
        return float(value)

    def pair(self, key: str, low: int = 1, high: int = MAX_SIDE) -> Size:
        """Return two integers in [low, high]."""
        value = self.values[key]
        good = isinstance(value, list) and len(value) == 2 and all(_is_integer(v) and low <= v <= high for v in value)
        require(good, self._at(key), f"be two integers in [{low}, {high}]", shown(value))
        return int(value[0]), int(value[1])

    def word(self, key: str, allowed: tuple[str, ...] = ()) -> str:
        """Return a short printable string, one of `allowed` if given."""
        value = self.values[key]
        if allowed:
            require(value in allowed, self._at(key), f"be one of {', '.join(allowed)}", shown(value))
        good = isinstance(value, str) and value.isprintable() and 1 <= len(value) <= 64
        require(good, self._at(key), "be 1 to 64 printable characters", shown(value))
        return str(value)

    def array(self, key: str, shape: tuple[int, ...]) -> Floats:
        """Return nested lists of finite numbers as an array of exactly `shape`."""
        value = self.values[key]

        def fits(part: object, extents: tuple[int, ...]) -> bool:
            if not extents:
                return _is_number(part)
            return isinstance(part, list) and len(part) == extents[0] and all(fits(p, extents[1:]) for p in part)

        extents = " x ".join(map(str, shape))
        require(fits(value, shape), self._at(key), f"hold {extents} finite numbers", shown(value))
        return np.array(value, dtype=np.float64)

    def numbers(self, key: str, most: int) -> list[int | float]:
        """Return a list of 1 to `most` finite numbers, each as it was written."""
        value = self.values.get(key)
        good = isinstance(value, list) and 1 <= len(value) <= most and all(_is_number(v) for v in value)
        require(good, self._at(key), f"be a list of 1 to {most} finite numbers", shown(value))
        return list(value or ())

    def table(self, key: str) -> Fields:
        """Return a table within this one."""
        value = self.values.get(key)
        require(isinstance(value, dict), self._at(key), "be a table", shown(value))
        return Fields(dict(value or {}), self._at(key))

    def deviations(self) -> dict[str, float]:
        """Return the whole table as finite numbers of at least 0."""
        for key, value in self.values.items():
            good = _is_number(value) and value >= 0
            require(good, self._at(shown(key)), "be a finite number of at least 0", shown(value))
        return {key: float(value) for key, value in self.values.items()}

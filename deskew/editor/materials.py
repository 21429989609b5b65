"""Materials of a page: what the editor calls them, how stiff they are, and the map that says where they lie."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from deskew.errors import require, require_positive
from deskew.io import StiffnessMap
from deskew.io.stiffness import MAX_STIFFNESS
from deskew.types import Array, Size

STIFFNESS = 30.0
"""Spring constant k_s of a material that nobody has judged yet [kg/s^2]: the paper's sheets have it."""

MAX_MATERIALS = 8
"""Most materials that can be added: as many as there are colours that stay apart."""

_NAME_LENGTH = 40


@dataclass(frozen=True, slots=True)
class Material:
    """One material.

    Attributes
    ----------
    label : int
        Its label in the map.
    name : str
        For people; 1 to 40 printable characters.
    stiffness : float
        Spring constant k_s [kg/s^2].
    """

    label: int
    name: str
    stiffness: float

    def __post_init__(self) -> None:
        named = isinstance(self.name, str) and self.name.isprintable() and bool(self.name.strip())
        sound = named and len(self.name) <= _NAME_LENGTH
        require(sound, "name", f"be 1 to {_NAME_LENGTH} printable characters", repr(self.name)[:60])
        require_positive("stiffness", self.stiffness, MAX_STIFFNESS, "kg/s^2")


@dataclass(frozen=True, slots=True)
class Painting:
    """What is edited: a label for every pixel of the photograph, and the materials. It never changes; it is replaced.

    Attributes
    ----------
    labels : (height, width) uint16 array
        In the frame of the raw white image.
    materials : tuple of Material
        The first one is the page's own: it lies wherever nothing else was painted.
    """

    labels: Array
    materials: tuple[Material, ...]

    def __post_init__(self) -> None:
        sound = self.labels.ndim == 2 and self.labels.size > 0 and self.labels.dtype == np.uint16
        require(sound, "labels", "be a non-empty (height, width) array of uint16", self.labels.shape)
        known = [material.label for material in self.materials]
        once = len(known) > 0 and len(set(known)) == len(known)
        require(once, "materials", "be one or more, each with a label of its own", known)
        lying = np.flatnonzero(np.bincount(self.labels.ravel())).tolist()
        require(set(lying) <= set(known), "labels", f"be of {', '.join(map(str, known))}", lying[:8])

    @classmethod
    def blank(cls, size: Size) -> Painting:
        """Return a page of one material; `size` is (width, height) [px]."""
        return cls(np.zeros(size[::-1], np.uint16), (Material(0, "page", STIFFNESS),))

    @classmethod
    def of(cls, found: StiffnessMap, names: Mapping[int, str]) -> Painting:
        """Take a map from a file; a material without a name is called by its label."""
        materials = [
            Material(label, names.get(label, f"material {label}"), float(constant))
            for label, constant in sorted(found.constants.items())
        ]
        return cls(found.labels.astype(np.uint16), tuple(materials))

    @property
    def size(self) -> Size:
        """(width, height) [px]."""
        return (self.labels.shape[1], self.labels.shape[0])

    @property
    def map(self) -> StiffnessMap:
        """The map that `deskew restore --stiffness` takes."""
        return StiffnessMap(self.labels, {material.label: float(material.stiffness) for material in self.materials})

    @property
    def names(self) -> dict[int, str]:
        """What each label is called."""
        return {material.label: material.name for material in self.materials}

    def at(self, label: int) -> int:
        """Return the place of a label among the materials; refuse one that is none of them."""
        labels = [material.label for material in self.materials]
        require(label in labels, "label", f"be one of {', '.join(map(str, labels))}", repr(label)[:60])
        return labels.index(label)

    def painted(self, covered: Array, label: int) -> Painting:
        """Lay a material on the pixels that are covered, (height, width) bool."""
        self.at(label)
        return replace(self, labels=np.where(covered, np.uint16(label), self.labels))

    def with_new(self) -> Painting:
        """Add a material, named after its number and as stiff as the page until somebody says otherwise."""
        full = len(self.materials) < MAX_MATERIALS
        require(full, "materials", f"be at most {MAX_MATERIALS}", len(self.materials) + 1)
        label = next(n for n in range(1 << 16) if n not in self.names)
        new = Material(label, f"material {len(self.materials) + 1}", self.materials[0].stiffness)
        return replace(self, materials=(*self.materials, new))

    def changed(self, label: int, name: str | None = None, stiffness: float | None = None) -> Painting:
        """Rename a material or set how stiff it is [kg/s^2]."""
        at = self.at(label)
        old = self.materials[at]
        new = Material(label, old.name if name is None else name, old.stiffness if stiffness is None else stiffness)
        return replace(self, materials=(*self.materials[:at], new, *self.materials[at + 1 :]))

    def without(self, label: int) -> Painting:
        """Take a material away; where it lay, the page's own lies."""
        at = self.at(label)
        require(at > 0, "label", "be another than the page's own material, which stays", label)
        rest = (*self.materials[:at], *self.materials[at + 1 :])
        own = np.uint16(self.materials[0].label)
        return Painting(np.where(self.labels == label, own, self.labels), rest)

"""How a page is scanned for a flattening method: the paper's way, or the best one."""

from __future__ import annotations

from dataclasses import dataclass, replace

from deskew.errors import require
from deskew.types import PatternKind


@dataclass(frozen=True, slots=True)
class Recipe:
    """How a page is scanned.

    Attributes
    ----------
    mode : str
        How a line sweep is read, "spatial" (section 2.3: a curve a frame) or "temporal" (a pixel by itself).
    ink : bool
        Whether what ink does to the decoded coordinates is taken out.
    denoise : bool
        Whether the depth map is filtered.
    """

    mode: str
    ink: bool
    denoise: bool

    def __post_init__(self) -> None:
        require(self.mode in ("spatial", "temporal"), "mode", "be spatial or temporal", repr(self.mode))


PAPER = Recipe("spatial", ink=False, denoise=False)
"""As the paper scans: no ink correction, no filter."""

BEST = Recipe("temporal", ink=True, denoise=True)
"""What serves rest lengths along the surface."""


def recipe_for(method: str, pattern: PatternKind = PatternKind.LINE_SWEEP) -> Recipe:
    """Return the recipe that belongs to a flattening method: the paper's to the paper's methods, else the best.

    A Gray code is not corrected for ink: its decoder leaves the edges of ink out, which on real captures is better than
    to keep them for a correction.
    """
    own = PAPER if method.startswith("paper_") else BEST
    return replace(own, ink=own.ink and pattern is not PatternKind.GRAY_CODE)

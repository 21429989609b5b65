"""What is printed on a page: reflectance as a function of (u, v), averaged exactly over a pixel's footprint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from data_synth.sheets import PAGE_SIZE_MM
from deskew.errors import require
from deskew.types import Board, Floats

PAPER_ALBEDO = 0.85
INK_ALBEDO = 0.08


class Page(Protocol):
    """A printed page."""

    @property
    def page_size_mm(self) -> tuple[float, float]:
        """Width and height [mm]."""
        ...

    def albedo(self, u: Floats, v: Floats, du: Floats, dv: Floats) -> Floats:
        """Mean reflectance over footprints of sides `du` x `dv` centred on (u, v).

        Parameters
        ----------
        u, v : (N,) arrays
            Page coordinates [mm]; may lie a footprint outside the page.
        du, dv : (N,) arrays
            Sides of the footprint [mm], not negative.

        Returns
        -------
        (N,) array
            Reflectance in [0, 1].
        """
        ...


@dataclass(frozen=True, slots=True)
class Blank:
    """White paper.

    Attributes
    ----------
    page_size_mm : (width, height)
        Page [mm].
    """

    page_size_mm: tuple[float, float] = PAGE_SIZE_MM

    def albedo(self, u: Floats, v: Floats, du: Floats, dv: Floats) -> Floats:
        """Return the paper's reflectance everywhere."""
        return np.full(np.shape(u), PAPER_ALBEDO, dtype=np.result_type(u))


@dataclass(frozen=True, slots=True)
class Checkerboard:
    """A checkerboard centred on the page, with a white margin; its top left square is ink.

    Attributes
    ----------
    page_size_mm : (width, height)
        Page [mm].
    squares : (nx, ny)
        Squares along u and v, at least two each.
    square_mm : float
        Side of a square [mm].
    """

    page_size_mm: tuple[float, float] = PAGE_SIZE_MM
    squares: tuple[int, int] = (21, 16)
    square_mm: float = 13.0

    def __post_init__(self) -> None:
        require(min(self.squares) >= 2, "squares", "be (nx, ny) of at least 2", self.squares)
        require(self.square_mm > 0, "square_mm", "be positive", self.square_mm)
        printed = (self.squares[0] * self.square_mm, self.squares[1] * self.square_mm)
        fits = printed[0] < self.page_size_mm[0] and printed[1] < self.page_size_mm[1]
        require(fits, "squares", f"leave a margin on a page of {self.page_size_mm} mm", f"a print of {printed} mm")

    @property
    def corners(self) -> Floats:
        """Inner corners (ny - 1, nx - 1, 2): true page coordinates (u, v) [mm], row by row from the top left."""
        (u0, v0), (nx, ny) = self._origin, self.squares
        u, v = u0 + self.square_mm * np.arange(1, nx), v0 + self.square_mm * np.arange(1, ny)
        return np.stack(np.meshgrid(u, v), axis=-1)

    @property
    def _origin(self) -> tuple[float, float]:
        """Top left corner of the print [mm]."""
        width, height = self.page_size_mm
        return (width - self.squares[0] * self.square_mm) / 2, (height - self.squares[1] * self.square_mm) / 2

    def albedo(self, u: Floats, v: Floats, du: Floats, dv: Floats) -> Floats:
        """Return the exact mean over axis-parallel footprints, by the closed integrals of the two square waves."""
        (u0, v0), (nx, ny) = self._origin, self.squares
        inside_u, wave_u = _averaged_wave((u - u0) / self.square_mm, du / self.square_mm, nx)
        inside_v, wave_v = _averaged_wave((v - v0) / self.square_mm, dv / self.square_mm, ny)
        # A square is ink where both waves have the same sign: (inside + wave_u wave_v) / 2, and waves are 0 outside.
        ink = (inside_u * inside_v + wave_u * wave_v) / 2
        return np.asarray(PAPER_ALBEDO + (INK_ALBEDO - PAPER_ALBEDO) * ink)


def _averaged_wave(x: Floats, width: Floats, n: int) -> tuple[Floats, Floats]:
    """Box means over `width` of the indicator of [0, n] and of the wave that is +1, -1, +1, ... on its unit cells."""
    half = np.maximum(width, 1e-6) / 2
    low, high = np.clip(x - half, 0, n), np.clip(x + half, 0, n)
    # The wave's integral from 0 is a triangle wave of height 1.
    integral = (1 - np.abs(high % 2 - 1)) - (1 - np.abs(low % 2 - 1))
    return (high - low) / (2 * half), integral / (2 * half)


def coverage(page_size_mm: tuple[float, float], u: Floats, v: Floats, du: Floats, dv: Floats) -> Floats:
    """Share of each footprint that lies on the page: anti-aliases the page's border.

    Parameters
    ----------
    page_size_mm : (width, height)
        Page [mm].
    u, v, du, dv : (N,) arrays
        Footprints as in :meth:`Page.albedo` [mm].

    Returns
    -------
    (N,) array
        In [0, 1].
    """
    share: Floats = np.ones(np.shape(u), dtype=np.result_type(u))
    for x, width, extent in ((u, du, page_size_mm[0]), (v, dv, page_size_mm[1])):
        half = np.maximum(width, 1e-6) / 2
        share = share * np.clip((np.minimum(x + half, extent) - np.maximum(x - half, 0)) / (2 * half), 0, 1)
    return share


def board_page(board: Board, margin_mm: float) -> Checkerboard:
    """Return the print of a calibration board: one square more than inner corners each way, inside a white margin."""
    require(margin_mm > 0, "margin_mm", "be positive", margin_mm)
    nx, ny = board.shape[0] + 1, board.shape[1] + 1
    size = (nx * board.square + 2 * margin_mm, ny * board.square + 2 * margin_mm)
    return Checkerboard(size, (nx, ny), board.square)

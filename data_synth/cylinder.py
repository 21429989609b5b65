"""Bend a plane along parallel rulings, in closed form and exactly isometric: an arc-length general cylinder."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit

from deskew.errors import require
from deskew.types import Floats


@dataclass(frozen=True, slots=True)
class Bend:
    """A rounded bend: a circular arc that turns the profile.

    Attributes
    ----------
    centre_mm : float
        Arc length of the arc's middle along the profile, 0 over the world's origin.
    length_mm : float
        Arc length of the arc, positive; its radius is ``length_mm / |angle|``.
    angle : float
        Turn, upwards positive [rad].
    """

    centre_mm: float
    length_mm: float
    angle: float

    def __post_init__(self) -> None:
        require(self.length_mm > 0, "length_mm", "be positive", self.length_mm)


def roll(points: Floats, bends: Sequence[Bend], azimuth: float) -> Floats:
    """Carry points of the plane Z = 0 onto a cylinder whose rulings lie across `azimuth`.

    Along each piece of constant curvature k the profile from heading h moves ``ds sinc(k ds / 2)`` in the direction
    ``h + k ds / 2`` (sinc x = sin x / x), which is the exact arc for any k.

    Parameters
    ----------
    points : (..., 3) array
        Points with Z = 0 [mm].
    bends : sequence of Bend
        In order of `centre_mm`, not overlapping.
    azimuth : float
        Direction of the profile, counter-clockwise from +X [rad].

    Returns
    -------
    (..., 3) array
        World [mm]; the sheet left of the first bend stays in Z = 0 when that bend lies left of the origin.
    """
    across = np.array([np.cos(azimuth), np.sin(azimuth)])
    flat = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 3)
    reach = float((flat[:, 0] * across[0] + flat[:, 1] * across[1]).min())
    return np.asarray(_carry(flat, across, *_pieces(bends, reach)).reshape(points.shape))


@njit(cache=True)
def _carry(
    points: Floats, across: Floats, starts: Floats, headings: Floats, curvatures: Floats, x0: Floats, z0: Floats
) -> Floats:
    """Carry flat points (N, 3) onto the profile that :func:`_pieces` describes: (N, 3)."""
    carried = np.empty_like(points)
    for i in range(len(points)):
        s = points[i, 0] * across[0] + points[i, 1] * across[1]
        ruling = points[i, 1] * across[0] - points[i, 0] * across[1]
        piece = 0
        while piece + 1 < len(starts) and s >= starts[piece + 1]:
            piece += 1
        ds = s - starts[piece]
        half = curvatures[piece] * ds / 2
        chord = ds * (np.sin(half) / half if half != 0.0 else 1.0)
        x = x0[piece] + chord * np.cos(headings[piece] + half)
        carried[i, 0] = x * across[0] - ruling * across[1]
        carried[i, 1] = x * across[1] + ruling * across[0]
        carried[i, 2] = z0[piece] + chord * np.sin(headings[piece] + half)
    return carried


def _pieces(bends: Sequence[Bend], first: float) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Start, heading, curvature and position of each straight and each arc of the profile."""
    starts, headings, curvatures = [first], [0.0], [0.0]
    for bend in bends:
        start = bend.centre_mm - bend.length_mm / 2
        require(start > starts[-1], "bends", "be in order, inside the page and apart", [b.centre_mm for b in bends])
        starts += [start, start + bend.length_mm]
        headings += [headings[-1], headings[-1] + bend.angle]
        curvatures += [bend.angle / bend.length_mm, 0.0]
    s, h, k = np.array(starts), np.array(headings), np.array(curvatures)
    ds = np.diff(s)
    half = k[:-1] * ds / 2
    steps = ds * np.sinc(half / np.pi) * np.exp(1j * (h[:-1] + half))
    positions = s[0] + np.concatenate([[0.0], np.cumsum(steps)])
    return s, h, k, positions.real, positions.imag

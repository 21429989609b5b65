"""Bent pages of one closed form each, sampled at any grid: cylinder, cone, parallel folds; lengths stay the page's.

A surface is a map of the flat page that a single angle bends, its *severity*: zero leaves the page flat. The severity
is solved for the wanted slope, then the sheet is levelled and laid on the bed.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

from data_synth.cylinder import Bend, roll
from data_synth.folds import best_rotation
from data_synth.sheets import LEAST_CELL, PAGE_SIZE_MM, TrueSheet, laid, least_cell, page_grid_of, slopes_deg, to_world
from deskew.errors import StepError, require
from deskew.types import Floats

Surface = Callable[[Floats, float], Floats]
"""Map of flat world points (N, 3) and a severity [rad] to the bent points (N, 3)."""

SHAPE = (200, 258)
"""Default grid (rows, columns)."""

_PROBE = (109, 141)  # where the slope is measured, so that the surface does not depend on the grid asked for
_ATTEMPTS = 50


def cylinder(
    rng: np.random.Generator,
    shape: tuple[int, int] = SHAPE,
    page_size_mm: tuple[float, float] = PAGE_SIZE_MM,
    slope_p90_deg: float = 35.0,
) -> TrueSheet:
    """Draw a circular cylinder: rulings at a random azimuth, arched up or down.

    Parameters
    ----------
    rng : numpy Generator
        The only source of randomness.
    shape : (rows, columns)
        Grid.
    page_size_mm : (width, height)
        Page [mm].
    slope_p90_deg : float
        90th percentile of the slope, in [1, 50]; 35 degrees are a radius of about 200 mm on a letter page.

    Returns
    -------
    TrueSheet
        With its best-fit tilt removed, its lowest vertex on the bed, centred over the world's origin.
    """
    azimuth, sign = float(rng.uniform(0.0, np.pi)), float(rng.choice([-1.0, 1.0]))
    reach = _reach(azimuth, page_size_mm)

    def surface(points: Floats, severity: float) -> Floats:
        # One arc from corner to corner but for a thousandth: a profile starts with a straight piece.
        return roll(points, [Bend(0.0, 1.999 * reach, 2 * sign * severity)], azimuth)

    return _placed(surface, shape, page_size_mm, slope_p90_deg)


def cone(
    rng: np.random.Generator,
    shape: tuple[int, int] = SHAPE,
    page_size_mm: tuple[float, float] = PAGE_SIZE_MM,
    slope_p90_deg: float = 35.0,
) -> TrueSheet:
    r"""Draw a piece of a circular cone whose apex lies off the page.

    About the apex the page has polar coordinates :math:`(\rho, \varphi)`. On a cone of half opening
    :math:`\pi / 2 - s` the distance to the apex stays and the azimuth becomes :math:`\varphi / \cos s`, since a circle
    of radius :math:`\rho` about the apex shrinks to :math:`\rho \cos s` about the axis (do Carmo, Differential Geometry
    of Curves and Surfaces, section 4-2).

    Parameters
    ----------
    rng, shape, page_size_mm
        As for :func:`cylinder`.
    slope_p90_deg : float
        90th percentile of the slope, in [1, 50].

    Returns
    -------
    TrueSheet
        Placed as by :func:`cylinder`.
    """
    for _ in range(_ATTEMPTS):
        direction, sign = float(rng.uniform(0.0, 2 * np.pi)), float(rng.choice([-1.0, 1.0]))
        toward = np.array([np.cos(direction), np.sin(direction)])
        # From the centre to the page's border in this direction, then the apex's distance beyond it.
        border = min(half / max(abs(t), 1e-9) for half, t in zip(np.array(page_size_mm) / 2, toward, strict=True))
        apex = toward * (border + float(rng.uniform(0.15, 0.6)) * min(page_size_mm))
        surface = _cone(apex, sign)
        try:
            return _placed(surface, shape, page_size_mm, slope_p90_deg)
        except StepError:  # the apex is too far for such a slope
            continue
    raise StepError(f"cone: {_ATTEMPTS} apices gave no height field; lower `slope_p90_deg`.")


def _cone(apex: Floats, sign: float) -> Surface:
    axis = -apex / np.hypot(*apex)

    def surface(points: Floats, severity: float) -> Floats:
        x, y = points[:, 0] - apex[0], points[:, 1] - apex[1]
        rho = np.hypot(x, y)
        # Azimuths count from the line to the page's centre: the page lies within a half turn of it, clear of the cut.
        turned = np.arctan2(axis[0] * y - axis[1] * x, axis[0] * x + axis[1] * y) / np.cos(severity)
        along, beside = rho * np.cos(severity) * np.cos(turned), rho * np.cos(severity) * np.sin(turned)
        bent = [axis[0] * along - axis[1] * beside, axis[1] * along + axis[0] * beside, sign * rho * np.sin(severity)]
        return np.stack(bent, axis=-1)

    return surface


def folds(
    rng: np.random.Generator,
    shape: tuple[int, int] = SHAPE,
    page_size_mm: tuple[float, float] = PAGE_SIZE_MM,
    slope_p90_deg: float = 30.0,
    *,
    n_folds: tuple[int, int] = (3, 7),
) -> TrueSheet:
    """Draw parallel folds one after the other, the panels rising and falling in turn: a letter folded and reopened.

    About half the folds are sharp (0.01 mm of paper turn), the others rounded over 1.5 to 5 mm.

    Parameters
    ----------
    rng, shape, page_size_mm
        As for :func:`cylinder`.
    slope_p90_deg : float
        90th percentile of the slope, in [1, 50].
    n_folds : (fewest, most)
        Folds, both included.

    Returns
    -------
    TrueSheet
        Placed as by :func:`cylinder`.
    """
    require(1 <= n_folds[0] <= n_folds[1], "n_folds", "be (fewest, most) with 1 <= fewest <= most", n_folds)
    azimuth = float(rng.uniform(0.0, np.pi))
    reach = _reach(azimuth, page_size_mm)
    n = int(rng.integers(n_folds[0], n_folds[1] + 1))
    room = 2 * reach / (n + 1)
    centres = -reach + room * (np.arange(1, n + 1) + rng.uniform(-0.3, 0.3, n))
    lengths = np.where(rng.random(n) < 0.5, 0.01, rng.uniform(1.5, 5.0, n))
    headings = rng.uniform(0.5, 1.0, n + 1) * (-1.0) ** (np.arange(n + 1) + int(rng.integers(2)))

    def surface(points: Floats, severity: float) -> Floats:
        turns = severity * np.diff(headings)
        bends = [Bend(float(c), float(s), float(a)) for c, s, a in zip(centres, lengths, turns, strict=True)]
        return roll(points, bends, azimuth)

    return _placed(surface, shape, page_size_mm, slope_p90_deg)


def _reach(azimuth: float, page_size_mm: tuple[float, float]) -> float:
    """Return how far the page reaches from its centre along `azimuth` [mm]."""
    width, height = page_size_mm
    return float(width * abs(np.cos(azimuth)) + height * abs(np.sin(azimuth))) / 2


def _placed(
    surface: Surface, shape: tuple[int, int], page_size_mm: tuple[float, float], slope_p90_deg: float
) -> TrueSheet:
    """Bend the page until its slope is the wanted one, level it and lay it on the bed."""
    require(1 <= slope_p90_deg <= 50, "slope_p90_deg", "be in [1, 50]", slope_p90_deg)
    probe = to_world(page_grid_of(_PROBE, page_size_mm), page_size_mm)
    flat = page_grid_of(shape, page_size_mm)

    def excess(severity: float) -> float:
        return float(np.percentile(slopes_deg(_level(surface, severity, probe, probe)), 90)) - slope_p90_deg

    low, high = 0.0, np.radians(slope_p90_deg) / 4
    while excess(high) < 0:
        low, high = high, 1.2 * high
        if high > 1.4:
            raise StepError(f"slope_p90_deg: {slope_p90_deg} is out of this surface's reach; lower `slope_p90_deg`.")
    severity = float(brentq(excess, low, high, xtol=1e-5))
    vertices = _level(surface, severity, probe, to_world(flat, page_size_mm))
    if least_cell(vertices) < LEAST_CELL:
        raise StepError("surface: it has walls or hangs over itself; lower `slope_p90_deg`.")
    return TrueSheet(laid(vertices), flat)


def _level(surface: Surface, severity: float, probe: Floats, points: Floats) -> Floats:
    """Bend flat world points (h, w, 3), turned as the bent probe best fits the flat one."""
    target = probe.reshape(-1, 3)
    bent = surface(target, severity)
    R = best_rotation(bent - bent.mean(axis=0), target)
    return np.asarray(np.einsum("ij,kj->ik", surface(points.reshape(-1, 3), severity), R).reshape(points.shape))

"""Accuracy from balls: probing error and sphere spacing, after VDI/VDE 2634 Part 2.

A ball shows what a plane cannot: its size and its distance from another one change with a wrong scale.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deskew.acquisition.accuracy import DISCARDED_SHARE, retained
from deskew.errors import StepError, require
from deskew.types import Floats

_N_STEPS = 100


@dataclass(frozen=True, slots=True)
class Sphere:
    """A sphere in the world.

    Attributes
    ----------
    centre : (3,) array
        [mm].
    radius_mm : float
        Positive.
    """

    centre: Floats
    radius_mm: float

    def deviations(self, points: Floats) -> Floats:
        """Signed radial distances of points (N, 3) [mm] from the sphere, (N,); positive outside."""
        return np.asarray(np.linalg.norm(points - self.centre, axis=1) - self.radius_mm)


@dataclass(frozen=True, slots=True)
class Probing:
    """What scanning one ball says.

    Attributes
    ----------
    form_mm : float
        Probing error, form: range of the radial deviations from the fitted sphere.
    size_mm : float
        Probing error, size: fitted minus known diameter.
    sphere : Sphere
        The fit.
    n : int
        Points that the fit used.
    """

    form_mm: float
    size_mm: float
    sphere: Sphere
    n: int


def fit_sphere(points: Floats) -> Sphere:
    """Least-squares sphere with a free radius: the sum of the squared radial distances is smallest.

    Gauss-Newton from the algebraic fit (linear in centre and ``r^2 - |c|^2``), which alone is biased towards small
    spheres when only a part of the surface is seen.

    Parameters
    ----------
    points : (N, 3) array
        At least 4 finite points, not all in one plane [mm].

    Raises
    ------
    InputError
        The points are no such array.
    StepError
        The fit does not settle: the points show too little curvature.
    """
    shape = points.shape
    require(points.ndim == 2 and shape[1] == 3 and shape[0] >= 4, "points", "have shape (N, 3) with N >= 4", shape)
    missing = int((~np.isfinite(points)).any(axis=1).sum())
    require(missing == 0, "points", "be finite", f"{missing} points with NaN or infinity")
    middle = points.mean(axis=0)
    local = points - middle
    spread = np.linalg.svd(local, compute_uv=False) ** 2
    require(bool(spread[2] > 1e-12 * max(spread[0], 1e-300)), "points", "curve out of a plane", "points in one plane")
    design = np.column_stack([2 * local, np.ones(len(local))])
    solution = np.linalg.lstsq(design, (local**2).sum(axis=1), rcond=None)[0]
    centre, radius = solution[:3], float(np.sqrt(max(solution[3] + solution[:3] @ solution[:3], 0.0)))
    for _ in range(_N_STEPS):
        away = local - centre
        distance = np.linalg.norm(away, axis=1)
        design = np.column_stack([away / np.maximum(distance, 1e-300)[:, None], np.ones(len(local))])
        step = np.linalg.lstsq(design, distance - radius, rcond=None)[0]
        centre, radius = centre + step[:3], radius + float(step[3])
        if np.abs(step).max() < 1e-10 * abs(radius):
            return Sphere(middle + centre, radius)
    raise StepError("fit_sphere did not settle: the points show too little of a sphere for its radius.")


def probe_sphere(points: Floats, radius_mm: float, share: float = DISCARDED_SHARE) -> Probing:
    """Probing error of one ball, form and size.

    After VDI/VDE 2634-2: least-squares sphere with a free radius, range of the radial deviations, and diameter, after
    discarding 0.3 % of the points. The guideline leaves open which: here those farthest from a first fit, after which
    the sphere is fitted anew. It asks for ten positions of a ball in the volume, and for as much of the ball as can be
    measured; who calls this chooses both.

    Parameters
    ----------
    points : (N, 3) array
        Scanned points of the ball and of nothing else [mm].
    radius_mm : float
        The ball's known radius.
    share : float
        Of the points discarded, in [0, 1).

    Raises
    ------
    InputError, StepError
        As :func:`fit_sphere`.
    """
    require(radius_mm > 0, "radius_mm", "be positive", radius_mm)
    kept = points[retained(fit_sphere(points).deviations(points), share)]
    sphere = fit_sphere(kept)
    return Probing(float(np.ptp(sphere.deviations(kept))), 2 * (sphere.radius_mm - radius_mm), sphere, len(kept))


def spacing_error_mm(first: Sphere, second: Sphere, known_mm: float) -> float:
    """Sphere-spacing error: fitted minus known distance of two balls' centres (VDI/VDE 2634-2)."""
    require(known_mm > 0, "known_mm", "be positive", known_mm)
    return float(np.linalg.norm(second.centre - first.centre)) - known_mm

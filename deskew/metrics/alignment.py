"""Bring two point sets into alignment by least squares: rigidly, or affinely as the paper does (section 4.1).

Affine alignment hides a wrong scale, aspect or shear, and a mirrored result; rigid alignment hides none of them. What
has no scale of its own, such as a picture at any size, can be aligned similarly: that hides a wrong scale alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deskew.errors import StepError, require
from deskew.types import Floats


@dataclass(frozen=True, slots=True)
class Alignment:
    """The map ``x -> matrix x + offset`` of the plane.

    Attributes
    ----------
    matrix : (2, 2) array
        Linear part.
    offset : (2,) array
        In the target's unit.
    """

    matrix: Floats
    offset: Floats

    def apply(self, points: Floats) -> Floats:
        """Move points, (..., 2)."""
        return np.asarray(points @ self.matrix.T + self.offset)


def _require_pairs(source: Floats, target: Floats, least: int) -> None:
    shape = np.shape(source)
    right = len(shape) == 2 and shape[1] == 2 and shape[0] >= least
    require(right, "source", f"have shape (N >= {least}, 2)", shape)
    require(np.shape(target) == shape, "target", f"have the source's shape {shape}", np.shape(target))
    finite = bool(np.isfinite(source).all() and np.isfinite(target).all())
    require(finite, "points", "be finite", "NaN or infinity")


def fit_rigid(source: Floats, target: Floats) -> Alignment:
    """Least-squares rotation and translation, without scale and without reflection (Kabsch).

    Parameters
    ----------
    source, target : (N, 2) arrays, N >= 2
        Corresponding points, same unit.

    Returns
    -------
    Alignment
        Takes `source` to `target`; its matrix has determinant +1.
    """
    _require_pairs(source, target, 2)
    p, q = source - source.mean(axis=0), target - target.mean(axis=0)
    # In the plane Kabsch's rotation is one angle: the one that turns the summed products to face each other.
    angle = np.arctan2((p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]).sum(), (p * q).sum())
    matrix = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return Alignment(matrix, target.mean(axis=0) - matrix @ source.mean(axis=0))


def fit_affine(source: Floats, target: Floats) -> Alignment:
    """Least-squares affine map, as in section 4.1.

    Parameters
    ----------
    source, target : (N, 2) arrays, N >= 3
        Corresponding points; `source` not all on one line.

    Returns
    -------
    Alignment
        Takes `source` to `target`.
    """
    _require_pairs(source, target, 3)
    middle = source.mean(axis=0)
    solution, _, rank, _ = np.linalg.lstsq(source - middle, target - target.mean(axis=0), rcond=1e-9)
    require(int(rank) == 2, "source", "span a plane", "points on one line")
    matrix = solution.T
    return Alignment(matrix, target.mean(axis=0) - matrix @ middle)


def fit_similar(source: Floats, target: Floats) -> Alignment:
    """Least-squares rotation, translation and one scale, without reflection (Umeyama 1991): for what has no scale.

    Parameters
    ----------
    source, target : (N, 2) arrays, N >= 2
        Corresponding points; `source` not all in one place.

    Returns
    -------
    Alignment
        Takes `source` to `target`.
    """
    turn = fit_rigid(source, target).matrix
    p, q = source - source.mean(axis=0), target - target.mean(axis=0)
    spread = float((p**2).sum())
    require(spread > 0, "source", "span a line", "points in one place")
    matrix = turn * (float(((p @ turn.T) * q).sum()) / spread)
    return Alignment(matrix, target.mean(axis=0) - matrix @ source.mean(axis=0))


def require_not_mirrored(source: Floats, target: Floats, what: str) -> None:
    """Refuse a result that is the mirror image of what it is compared with; no rotation can judge it.

    Raises
    ------
    StepError
        If the best affine map from `source` to `target` reflects.
    """
    determinant = float(np.linalg.det(fit_affine(source, target).matrix))
    if determinant <= 0:
        raise StepError(
            f"{what}: the restored page is mirrored (determinant {determinant:.3g} of the map onto the reference); "
            "check the order of the mesh's rows and columns."
        )


def distances(source: Floats, target: Floats) -> Floats:
    """Euclidean distance of each pair, (N,)."""
    return np.asarray(np.linalg.norm(source - target, axis=-1))

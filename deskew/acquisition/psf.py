"""The camera's point spread, measured on the edges of the calibration board's squares.

An edge of ink is a step; the camera's Gaussian blur and the area of its pixels make it an error function of the
distance from the edge. What a correction of ink needs is the spread of a pixel's whole footprint, lens and pixel area
together, ``sigma^2 = sigma_lens^2 + 1/12`` [px^2], and that is just what an edge in the picture shows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.special import ndtr

from deskew.errors import require
from deskew.types import Array, Floats

FEWEST_EDGES = 12
"""Edges below which their median says nothing."""

# Of an edge, the part that is seen: away from the corners along it, and short of the next edge across it.
_ALONG, _ACROSS, _REACH_PX = 0.3, 0.35, 6.0
_LEVEL_PX = 1.5  # from here on a pixel beside the edge shows a level rather than the slope
_FEWEST_SAMPLES = 12  # of either level
_ITERATIONS = 25
_SIGMA_PX = (0.2, 4.0)  # beyond these a fit has failed, or the lens is out of focus
_SETTLED = 1e-4  # largest step of offset, turn and sigma [px] that ends the fit
_OFFSET_MAX_PX = 1.0  # of an edge from the line between its corners
_FLAT = 1e-6  # height over level of no edge at all
_MISFIT_MAX = 0.1  # RMS residual over the edge's height


@dataclass(frozen=True, slots=True)
class _Samples:
    """Pixels around E edges, (E, S) arrays each, padded to one S.

    Attributes
    ----------
    across, along : arrays
        Distance from the line between the edge's corners and, over the edge's length, from its middle [px, 1].
    grey : array
        White - black [grey levels].
    weight : bool array
        Which of them count.
    """

    across: Floats
    along: Floats
    grey: Floats
    weight: npt.NDArray[np.bool_]


def edge_blurs(lit: Floats, corners: Floats, usable: Array | None = None) -> Floats:
    """Fit the blur of every edge between two neighbouring inner corners of a board.

    A lens bends the line between two neighbours by less than a hundredth of a pixel, so corners are all that is needed
    of the board's pose; each edge still has its own offset and turn, which a detector's error may use up.

    Parameters
    ----------
    lit : (height, width) array
        White - black [grey levels].
    corners : (ny, nx, 2) array
        Inner corners of the board (x, y) [px].
    usable : (height, width) bool array, optional
        False where the picture is not to be believed, as where it clips.

    Returns
    -------
    (E,) array
        Standard deviation of the error function through each edge that could be fitted [px].
    """
    require(lit.ndim == 2, "lit", "be (height, width)", lit.shape)
    require(corners.ndim == 3 and corners.shape[2] == 2, "corners", "be (ny, nx, 2)", corners.shape)
    require(bool(np.isfinite(corners).all()), "corners", "be finite [px]", "NaN or infinity")
    good = np.ones(lit.shape, dtype=bool) if usable is None else np.asarray(usable, dtype=bool)
    require(good.shape == lit.shape, "usable", f"have lit's shape {lit.shape}", good.shape)
    starts = np.concatenate([corners[:, :-1].reshape(-1, 2), corners[:-1].reshape(-1, 2)])
    ends = np.concatenate([corners[:, 1:].reshape(-1, 2), corners[1:].reshape(-1, 2)])
    samples = _around(lit, good, starts, ends)
    # Both levels must be seen, not only the slope between them.
    sides = (samples.across < -_LEVEL_PX, samples.across > _LEVEL_PX)
    enough = np.min([(samples.weight & side).sum(axis=1) for side in sides], axis=0) >= _FEWEST_SAMPLES
    if not enough.any():
        return np.empty(0)
    return _fitted(_Samples(*(getattr(samples, name)[enough] for name in _Samples.__slots__)))


def camera_psf(blurs: Floats) -> float | None:
    """Median blur of all edges of all boards [px]; None of fewer than `FEWEST_EDGES`."""
    known = blurs[np.isfinite(blurs)]
    return float(np.median(known)) if len(known) >= FEWEST_EDGES else None


def _around(lit: Floats, usable: npt.NDArray[np.bool_], starts: Floats, ends: Floats) -> _Samples:
    """Whole pixels around each edge; interpolating between them would blur what is to be measured."""
    height, width = lit.shape
    lengths = np.linalg.norm(ends - starts, axis=1)
    tangents = (ends - starts) / np.maximum(lengths, 1e-9)[:, None]
    reach = np.minimum(_ACROSS * lengths, _REACH_PX)
    half = int(np.ceil(np.hypot(_ALONG * lengths, reach).max())) + 1
    steps = np.arange(-half, half + 1)
    offsets = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    middles = (starts + ends) / 2
    pixels = np.rint(middles).astype(int)[:, None] + offsets
    apart = pixels - middles[:, None]
    along = (apart * tangents[:, None]).sum(axis=-1) / np.maximum(lengths, 1e-9)[:, None]
    across = apart[..., 1] * tangents[:, None, 0] - apart[..., 0] * tangents[:, None, 1]
    inside = ((pixels >= 0) & (pixels < (width, height))).all(axis=-1)
    x, y = np.clip(pixels[..., 0], 0, width - 1), np.clip(pixels[..., 1], 0, height - 1)
    near = (np.abs(along) <= _ALONG) & (np.abs(across) <= reach[:, None])
    return _Samples(across, along, lit[y, x].astype(np.float64), inside & near & usable[y, x])


def _fitted(samples: _Samples) -> Floats:
    """Gauss-Newton on all edges at once: two levels, offset, turn and sigma of each; failed fits are left out."""
    w, across, along, grey = samples.weight, samples.across, samples.along, samples.grey
    low, high = (_mean(grey, w & side) for side in (across < -_LEVEL_PX, across > _LEVEL_PX))
    height = np.abs(high - low)
    p = np.stack([low, high, np.zeros_like(low), np.zeros_like(low), np.ones_like(low)], axis=-1)
    misfit = np.full(len(p), np.inf)
    for _ in range(_ITERATIONS):
        low, high, offset, turn, sigma = (column[:, None] for column in p.T)
        z = (across - offset - turn * along) / sigma
        share = ndtr(z)
        slope = (high - low) * np.exp(-0.5 * z * z) / (np.sqrt(2 * np.pi) * sigma)
        residual = np.where(w, grey - low - (high - low) * share, 0.0)
        misfit = np.sqrt((residual**2).sum(axis=1) / w.sum(axis=1))
        J = np.where(w[..., None], np.stack([1 - share, share, -slope, -slope * along, -slope * z], axis=-1), 0.0)
        normal = np.einsum("esi,esj->eij", J, J)
        # A trace of damping: an edge without contrast has no offset and no width.
        normal += 1e-9 * (1.0 + np.trace(normal, axis1=1, axis2=2))[:, None, None] * np.eye(5)
        step = np.linalg.solve(normal, np.einsum("esi,es->ei", J, residual)[..., None])[..., 0]
        step[:, 2:] = np.clip(step[:, 2:], -0.3, 0.3)
        p += step
        p[:, 4] = np.clip(p[:, 4], *_SIGMA_PX)
        if np.abs(step[:, 2:]).max() < _SETTLED:
            break
    sigma = p[:, 4]
    good = (misfit <= _MISFIT_MAX * height) & (np.abs(p[:, 2]) <= _OFFSET_MAX_PX)
    good &= height > _FLAT * np.abs(p[:, :2]).max(axis=1)
    good &= (sigma > _SIGMA_PX[0]) & (sigma < _SIGMA_PX[1])
    return np.asarray(sigma[good])


def _mean(values: Floats, mask: npt.NDArray[np.bool_]) -> Floats:
    """Mean of each row's marked values, 0 of none."""
    return np.asarray(np.where(mask, values, 0.0).sum(axis=1) / np.maximum(mask.sum(axis=1), 1))

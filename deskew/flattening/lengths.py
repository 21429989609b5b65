"""Rest lengths of a triangle mesh: how far apart neighbouring vertices are on the paper, whatever noise the scan has.

Three effects keep the chords of a scanned mesh from being these lengths, and each has its remedy: noise lengthens them
(:mod:`.smoothing` removes it), creases shorten them (:mod:`.creases` unfolds them), and what smoothing leaves of the
one or adds to the other is a bias of the estimate as a whole. The last is measured where the truth is known: the smooth
mesh is given noise anew, with both signs so that what is odd in it cancels, and smoothed again; by what the lengths of
the mesh have changed then, those of the scan are corrected (the parametric bootstrap), and by half as much again, for
a mesh that was smoothed once has less to lose the second time.

References
----------
Efron & Tibshirani, An introduction to the bootstrap, 1993, section 10.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from deskew.errors import require
from deskew.flattening.creases import Rays, crease_lengths, rays_of
from deskew.flattening.directions import noise_directions
from deskew.flattening.hinges import hinges_of
from deskew.flattening.smoothing import smooth
from deskew.types import Array, Floats

_SEED = 20010707
# The bias over what the bootstrap shows of it; it is 1.2 to 2.3 on the sheets that this was chosen on.
_UNDERRATED = 1.5
# Largest correction of one length, as a logarithm: more is an accident of the noise.
_LARGEST_CORRECTION = 0.1
_NOTHING = 1e-200  # [mm], in place of the length between coincident vertices
# Noise below this share of the mean edge changes no length by more than a millionth.
_NEGLIGIBLE = 1e-4


def surface_lengths(vertices: Floats, faces: Array, sigma_mm: float = 0.0) -> tuple[npt.NDArray[np.int64], Floats]:
    """Measure the edges of a scanned mesh on the surface behind it.

    Parameters
    ----------
    vertices : (V, 3) array
        Positions [mm].
    faces : (F, 3) int array
        Triangles, all wound alike, at most two an edge.
    sigma_mm : float
        Standard deviation of the noise [mm], >= 0, as :func:`deskew.flattening.noiselevel.noise_level` finds it.

    Returns
    -------
    edges : (E, 2) int array
        Vertices of each edge once, the smaller first, in order.
    lengths : (E,) array
        Their lengths [mm].

    Raises
    ------
    InputError
        If `sigma_mm` is negative or not finite.
    """
    require(0.0 <= sigma_mm < np.inf, "sigma_mm", "be finite and not negative [mm]", sigma_mm)
    positions = np.ascontiguousarray(vertices, dtype=np.float64)
    directions = noise_directions(positions, faces)
    rays = rays_of(positions, faces, directions)
    a, b = rays.edges.T
    mean = float(np.linalg.norm(positions[a] - positions[b], axis=1).mean())
    if sigma_mm <= _NEGLIGIBLE * mean:
        return rays.edges, crease_lengths(positions, rays)
    return rays.edges, _bootstrapped(positions, faces, rays, sigma_mm)


def _bootstrapped(vertices: Floats, faces: Array, rays: Rays, sigma_mm: float) -> Floats:
    """Lengths (E,) of the smoothed mesh, less their bias [mm]."""
    hinges = hinges_of(vertices, faces, rays.directions)
    parent = smooth(hinges, np.zeros(len(vertices)), sigma_mm)
    lengths = crease_lengths(_moved(vertices, parent, rays), rays)
    noise = np.random.default_rng(_SEED).normal(0.0, sigma_mm, len(vertices))
    found = [smooth(hinges, parent + sign * noise, sigma_mm) for sign in (1.0, -1.0)]
    mean = sum(crease_lengths(_moved(vertices, offsets, rays), rays) for offsets in found) / len(found)
    ratio = np.maximum(lengths, _NOTHING) / np.maximum(mean, _NOTHING)
    correction = np.clip(_UNDERRATED * np.log(ratio), -_LARGEST_CORRECTION, _LARGEST_CORRECTION)
    return np.asarray(lengths * np.exp(correction))


def _moved(vertices: Floats, offsets: Floats, rays: Rays) -> Floats:
    """Vertices (V, 3) moved by offsets (V,) along the directions."""
    return np.asarray(vertices + offsets[:, None] * rays.directions)

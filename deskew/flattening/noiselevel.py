"""The noise level of a scanned mesh from itself.

The Laplacian of the heights, taken twice, vanishes on every smooth sheet up to fourth derivatives, and is a known
combination of the noise of a vertex and its neighbours. Scaled by the norm of its coefficients it has the noise's own
standard deviation at every inner vertex; the median absolute deviation over the mesh overlooks the few percent of
vertices that lie near creases. The cotangent Laplacian is used, because it vanishes on planes for any triangulation.

References
----------
Pinkall & Polthier, Computing discrete minimal surfaces and their conjugates, Exp. Math. 2(1), 1993 (cotangents).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array, csr_array, diags_array

from deskew.flattening.directions import noise_directions
from deskew.flattening.edges import edges_of
from deskew.types import Array, Floats

_GAUSS = 1.4826  # standard deviation of a normal variable over its median absolute deviation
_LEAST_VERTICES = 30  # fewer inner vertices tell nothing
_SHARPEST = 100.0  # largest cotangent that counts: needles, and cells that are seen edge-on


def noise_level(vertices: Floats, faces: Array) -> float:
    """Estimate the standard deviation of white noise on a mesh of a piecewise smooth surface.

    Only noise along the line of sight shows, see :mod:`deskew.flattening.directions`.

    Parameters
    ----------
    vertices : (V, 3) array
        Positions [mm].
    faces : (F, 3) int array
        Triangles, all wound alike.

    Returns
    -------
    float
        Standard deviation [mm]; 0 for a mesh with hardly any inner vertices.
    """
    directions = noise_directions(vertices, faces)
    laplacian, border = _laplacian(vertices, faces, directions)
    twice = (laplacian @ laplacian).tocsr()
    norms = np.sqrt(np.asarray((twice * twice).sum(axis=1)).ravel())
    beside_border = (abs(laplacian) @ border.astype(np.float64)) > 0
    inner = ~border & ~beside_border & (norms > 0)
    if int(inner.sum()) < _LEAST_VERTICES:
        return 0.0
    # The offset cancels in theory; without it digits are lost.
    residuals = np.einsum("ij,ij->i", twice @ (vertices - vertices.mean(axis=0)), directions)[inner] / norms[inner]
    return float(_GAUSS * np.median(np.abs(residuals - np.median(residuals))))


def _laplacian(vertices: Floats, faces: Array, directions: Floats) -> tuple[csr_array, npt.NDArray[np.bool_]]:
    """Cotangent Laplacian (V, V) across the directions, with empty rows at the border; and which vertices lie there."""
    n = len(vertices)
    up = directions[faces].sum(axis=1)
    up /= np.maximum(np.linalg.norm(up, axis=1, keepdims=True), 1e-300)
    rows, columns, values = [], [], []
    for k in range(3):
        a, b, c = (faces[:, (k + shift) % 3].astype(np.int64) for shift in range(3))
        u, v = (vertices[end] - vertices[a] for end in (b, c))
        u, v = (side - np.einsum("fk,fk->f", side, up)[:, None] * up for side in (u, v))
        area = np.abs(np.einsum("fk,fk->f", np.cross(u, v), up))
        cotangent = np.einsum("fk,fk->f", u, v) / np.maximum(area, 1e-200)
        weight = np.clip(cotangent, -_SHARPEST, _SHARPEST) / 2
        rows += [b, c, b, c]
        columns += [c, b, b, c]
        values += [weight, weight, -weight, -weight]
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    edges = edges_of(faces)
    border = np.zeros(n, dtype=np.bool_)
    border[edges.ends[edges.of_face.ravel()[edges.opposite < 0]]] = True
    laplacian = diags_array((~border).astype(np.float64)) @ coo_array(entries, shape=(n, n)).tocsr()
    return csr_array(laplacian), border

"""In which direction a scanner's noise moves the vertices of a mesh.

A scanner measures depth: its noise acts along the line of sight and leaves the other two coordinates alone. Of a height
field that line is an axis, +Z by the project's convention or, for a mesh turned away from it, the mean normal. A mesh
with overhangs was put together from several views; there the smoothed normal of the surface is the best guess.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, diags_array

from deskew.types import Array, Floats

# Share of the area that an axis may see from behind: a vertical cell or two make no overhang.
_SEEN_FROM_BEHIND = 1e-3
# Share of its area that a sheet must show along an axis: seen nearly edge-on every bend is a wall.
_SEEN_AT_ALL = 0.25
# Noise turns the normals of a dense scan by 20 degrees and more; this many averagings over neighbours still it.
_AVERAGINGS = 20


def noise_directions(vertices: Floats, faces: Array) -> Floats:
    """Guess the direction of the noise of each vertex.

    Parameters
    ----------
    vertices : (V, 3) array
        Positions [mm].
    faces : (F, 3) int array
        Triangles, all wound alike.

    Returns
    -------
    (V, 3) array
        Unit vectors: +Z everywhere for a height field over the XY plane, one common vector for a height field over
        another plane, smoothed normals for any other mesh. A height field that stands nearly on edge is none.
    """
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    mean, whole = normals.sum(axis=0), float(np.linalg.norm(normals, axis=1).sum())
    for axis in (np.array([0.0, 0.0, 1.0]), mean / max(float(np.linalg.norm(mean)), 1e-300)):
        seen = np.einsum("fk,k->f", normals, axis)
        front, back = float(seen[seen > 0].sum()), -float(seen[seen < 0].sum())
        if min(front, back) <= _SEEN_FROM_BEHIND * max(front, back) and max(front, back) > _SEEN_AT_ALL * whole:
            return np.broadcast_to(axis, vertices.shape)
    return _smoothed_normals(normals, faces, len(vertices))


def _smoothed_normals(normals: Floats, faces: Array, n_vertices: int) -> Floats:
    """Vertex normals from the faces' area-weighted ones (F, 3), averaged over neighbours: (V, 3)."""
    corners, owners = faces.ravel(), np.repeat(np.arange(len(faces)), 3)
    incident = coo_array((np.ones(corners.size), (corners, owners)), shape=(n_vertices, len(faces))).tocsr()
    joined = (incident @ incident.T).tocsr()  # a vertex counts itself once a face, a neighbour once a shared face
    mean = diags_array(1.0 / np.maximum(joined.sum(axis=1), 1.0)) @ joined
    smoothed = incident @ normals
    for _ in range(_AVERAGINGS):
        smoothed /= np.maximum(np.linalg.norm(smoothed, axis=1, keepdims=True), 1e-300)
        smoothed = mean @ smoothed
    return np.asarray(smoothed / np.maximum(np.linalg.norm(smoothed, axis=1, keepdims=True), 1e-300))

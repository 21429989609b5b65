"""Where the surface inside a grid's quads goes, once the grid lies flat: a dense scan through a coarse mesh and back.

A sample of the surface divides the row of its quad as its arc length divides the whole row's, and likewise the column;
its flat place is bilinear in these two shares. So a crease that runs through a quad is not spread over all of it.
"""

from __future__ import annotations

import numpy as np

from deskew.errors import require
from deskew.flattening.chords import chord_lengths
from deskew.types import Floats


def flat_surface(surface: Floats, flat: Floats, n: int) -> Floats:
    """Lay the surface down between the flattened vertices of the grid.

    Parameters
    ----------
    surface : ((R - 1) n + 1, (C - 1) n + 1, 3) array
        The surface as scanned [mm].
    flat : (R, C, 3) array
        The grid's vertices, flattened [mm].
    n : int
        Steps of the surface between two neighbours of the grid.

    Returns
    -------
    array of the surface's shape
        Flat places [mm]; every n-th one is the grid's own.
    """
    rows, columns = flat.shape[0] - 1, flat.shape[1] - 1
    wanted = (rows * n + 1, columns * n + 1, 3)
    require(surface.shape == wanted, "surface", f"have shape {wanted}", surface.shape)
    lengths = chord_lengths(surface)
    s = _shares(lengths[0, :, :-1], n)
    t = _shares(np.ascontiguousarray(lengths[1, :-1, :].T), n).T
    r = np.minimum(np.arange(wanted[0]) // n, rows - 1)[:, None]
    c = np.minimum(np.arange(wanted[1]) // n, columns - 1)[None, :]
    s, t = s[..., None], t[..., None]
    top = (1 - s) * flat[r, c] + s * flat[r, c + 1]
    bottom = (1 - s) * flat[r + 1, c] + s * flat[r + 1, c + 1]
    return np.asarray((1 - t) * top + t * bottom)


def _shares(steps: Floats, n: int) -> Floats:
    """Share of its quad's row that lies before each sample: (L, q n) steps to (L, q n + 1) shares in [0, 1]."""
    quads = steps.reshape(len(steps), -1, n)
    along = np.cumsum(quads, axis=2)
    shares = np.zeros((len(steps), steps.shape[1] + 1))
    shares[:, :-1].reshape(quads.shape)[:, :, 1:] = along[:, :, :-1] / np.maximum(along[:, :, -1:], 1e-300)
    shares[:, -1] = 1.0
    return shares

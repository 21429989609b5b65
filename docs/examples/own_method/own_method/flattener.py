"""A flattener: a bent grid in, the same grid on the plane z = 0 out."""

import numpy as np

from deskew.types import Flattened, Sheet, Status


def unroll(sheet: Sheet) -> Flattened:
    """Lay every vertex as far along its row and down its column as the chords to it are long together."""
    if sheet.faces is not None:
        raise ValueError("unroll flattens grids, and this is a mesh of triangles")
    bent = sheet.vertices  # (rows, columns, 3), millimetres
    across = np.linalg.norm(np.diff(bent, axis=1, prepend=bent[:, :1]), axis=2).cumsum(axis=1)
    down = np.linalg.norm(np.diff(bent, axis=0, prepend=bent[:1]), axis=2).cumsum(axis=0)
    x, y, _ = bent.mean(axis=(0, 1))
    x = x + across - across.mean(axis=1, keepdims=True)
    y = y - down + down.mean(axis=0, keepdims=True)  # rows run down the page, the world's Y up
    return Flattened(np.stack([x, y, 0 * x], axis=2), Status.AT_REST)

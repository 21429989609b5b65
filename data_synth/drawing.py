"""Pictures on a page, drawn once in fine cells, whose mean over any footprint is exact for what was drawn."""

from __future__ import annotations

from collections.abc import Iterable
from io import BytesIO

import numpy as np
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numba import njit

from deskew.types import Floats

CELLS_PER_MM = 8
_DRAWN_PER_MM = 16
_MM_PER_INCH = 25.4


def drawn(artists: Iterable[Artist], page_size_mm: tuple[float, float], ground: float = 1.0) -> Floats:
    """Draw on a page, anti-aliased at 16 cells a millimetre and averaged down to 8.

    Parameters
    ----------
    artists : iterable of matplotlib artists
        From the back to the front, in page coordinates with v turned over: (u, -v) [mm].
    page_size_mm : (width, height)
        Page [mm].
    ground : float
        Grey of the empty page, 0 black to 1 white.

    Returns
    -------
    (8 height, 8 width) array
        Ink on each cell, 0 where it is white to 1 where it is black.
    """
    width, height = (int(np.ceil(extent * CELLS_PER_MM)) for extent in page_size_mm)
    fine = _DRAWN_PER_MM // CELLS_PER_MM
    drawn_mm = width / CELLS_PER_MM, height / CELLS_PER_MM
    inches = drawn_mm[0] / _MM_PER_INCH, drawn_mm[1] / _MM_PER_INCH
    figure = Figure(figsize=inches, dpi=_DRAWN_PER_MM * _MM_PER_INCH, facecolor=str(ground))
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, drawn_mm[0]), ylim=(-drawn_mm[1], 0))
    axes.axis("off")
    for artist in artists:
        axes.add_artist(artist)
    picture = BytesIO()
    figure.savefig(picture, format="rgba", dpi="figure")
    pixels = np.frombuffer(picture.getvalue(), dtype=np.uint8).reshape(height * fine, width * fine, 4)
    ink = 1.0 - pixels[..., 0] / 255.0
    return np.asarray(ink.reshape(height, fine, width, fine).mean(axis=(1, 3)))


def integral_of(cells: Floats) -> Floats:
    """Integral of cells (h, w) from the corner (0, 0) to each corner of a cell: (h + 1, w + 1) [cells]."""
    integral = np.zeros((cells.shape[0] + 1, cells.shape[1] + 1))
    integral[1:, 1:] = cells.cumsum(axis=0).cumsum(axis=1)
    return integral


def mean_over(integral: Floats, u: Floats, v: Floats, du: Floats, dv: Floats) -> Floats:
    """Mean of what was drawn over footprints of sides `du` x `dv` centred on (u, v) [mm]: (N,); 0 beyond the drawing.

    Between the cells' corners the integral is bilinear.
    """
    planes = (np.ascontiguousarray(values, dtype=np.float64).ravel() for values in (u, v, du, dv))
    return np.asarray(_means(integral, *planes))


@njit(cache=True)
def _until(integral: Floats, u: float, v: float) -> float:
    """Integral from the corner to page point (u, v) [mm], by bilinear interpolation [cells]."""
    rows, columns = integral.shape
    x, y = min(max(u * CELLS_PER_MM, 0.0), columns - 1.0), min(max(v * CELLS_PER_MM, 0.0), rows - 1.0)
    c, r = min(int(x), columns - 2), min(int(y), rows - 2)
    a, b = x - c, y - r
    upper = (1 - a) * integral[r, c] + a * integral[r, c + 1]
    return float((1 - b) * upper + b * ((1 - a) * integral[r + 1, c] + a * integral[r + 1, c + 1]))


@njit(cache=True)
def _means(integral: Floats, u: Floats, v: Floats, du: Floats, dv: Floats) -> Floats:
    """Mean over each footprint, (N,)."""
    mean = np.empty(len(u))
    for i in range(len(u)):
        a, b = max(du[i], 1e-3) / 2, max(dv[i], 1e-3) / 2
        right = _until(integral, u[i] + a, v[i] + b) - _until(integral, u[i] + a, v[i] - b)
        left = _until(integral, u[i] - a, v[i] + b) - _until(integral, u[i] - a, v[i] - b)
        mean[i] = min(max((right - left) / (4 * a * b * CELLS_PER_MM**2), 0.0), 1.0)
    return mean

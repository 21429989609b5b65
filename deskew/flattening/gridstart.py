"""A start for the static solver that cannot be mirrored: the least squares conformal map of a small grid.

Each quad is four triangles, two for either diagonal, whose shapes come from spring lengths alone. A map is conformal on
a triangle if its edges are turned and scaled alike, which is linear in the vertices' places taken as complex numbers;
its square summed over all triangles is a Hermitian form, banded when vertices are numbered along the shorter side.

References
----------
Levy, Petitjean, Ray, Maillot, Least squares conformal maps, ACM TOG 21(3), 2002.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.linalg import solveh_banded

from deskew.errors import StepError
from deskew.types import Floats

Complex = npt.NDArray[np.complex128]


def conformal_start(rest: Floats) -> Floats:
    """Lay a grid out by its spring lengths, as conformally as can be.

    Parameters
    ----------
    rest : (4, R, C) array
        Lengths [mm] by family, as in `Springs`.

    Returns
    -------
    (R, C, 2) array
        Places in the plane [mm], columns towards +x, rows towards -y, of the size that the structural lengths say.

    Raises
    ------
    StepError
        If the lengths determine no map.
    """
    rows, columns = rest.shape[1:]
    if columns > rows:  # the band is as wide as a row
        turned = conformal_start(np.ascontiguousarray(rest[[1, 0, 2, 3]].transpose(0, 2, 1)))
        return np.ascontiguousarray(-turned.transpose(1, 0, 2)[..., ::-1])
    n, width = rows * columns, columns + 2
    band = np.zeros((width, n), dtype=np.complex128)  # band[i - j, j] is the form's entry (i, j), i >= j
    index = np.arange(n).reshape(rows, columns)
    for corners, lengths in _triangles(rest, index):
        _add_triangles(band, corners, lengths)
    return _scaled(_solved(band, n).reshape(rows, columns), rest)


def _triangles(rest: Floats, index: npt.NDArray[np.intp]) -> list[tuple[Floats, Floats]]:
    """Four triangles a quad: corners (Q, 3), counter-clockwise, and the lengths of their opposite sides (Q, 3) [mm]."""
    across, down = rest[0], rest[1]
    falling, rising = rest[2, :-1, :-1], rest[3, :-1, :-1]
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    ab, dc, ad, bc = across[:-1, :-1], across[1:, :-1], down[:-1, :-1], down[:-1, 1:]
    faces = (
        ((a, d, c), (dc, falling, ad)),
        ((a, c, b), (bc, ab, falling)),
        ((a, d, b), (rising, ab, ad)),
        ((b, d, c), (dc, bc, rising)),
    )
    return [tuple(np.stack([part.ravel() for part in parts], axis=-1) for parts in face) for face in faces]  # type: ignore[misc]


def _add_triangles(band: Complex, corners: Floats, lengths: Floats) -> None:
    """Add |sum_j w_j x_j|^2 / (4 area) of triangles laid out by their sides, w_j the side opposite corner j."""
    a, b, c = np.maximum(lengths, 1e-9 * lengths.max()).T  # on a coarse level two vertices may share a place
    x = (b * b + c * c - a * a) / (2 * c)
    height = np.sqrt(np.maximum(b * b - x * x, (1e-3 * b) ** 2))  # three lengths of a noisy sheet need not close
    places = np.stack([np.zeros_like(c), c, x + 1j * height])
    w = np.stack([places[2] - places[1], places[0] - places[2], places[1] - places[0]]) / np.sqrt(2 * c * height)
    for i in range(3):
        for j in range(3):
            k = int(corners[0, i] - corners[0, j])  # the same for every quad of the grid
            if k >= 0:
                band[k, corners[:, j]] += np.conj(w[i]) * w[j]


def _solved(band: Complex, n: int) -> Complex:
    """Minimise the form with the first vertex held at 0 and the last at 1 - 1j."""
    width = len(band)
    last = np.zeros(n, dtype=np.complex128)
    for k in range(1, min(width, n)):
        last[n - 1 - k] = np.conj(band[k, n - 1 - k])
    inner = band[:, 1 : n - 1].copy()
    for k in range(1, width):
        inner[k, max(0, n - 2 - k) :] = 0.0
    inner[0] = inner[0].real * (1.0 + 1e-12)
    try:
        places = solveh_banded(inner, -(1 - 1j) * last[1 : n - 1], lower=True, check_finite=False)
    except np.linalg.LinAlgError as error:
        raise StepError(
            "Static flattening: no start is determined by these lengths; look for vertices in a line."
        ) from error
    return np.concatenate([[0.0], places, [1 - 1j]])


def _scaled(places: Complex, rest: Floats) -> Floats:
    """Give the map the size that the structural lengths ask for."""
    across, down = np.abs(np.diff(places, axis=1)), np.abs(np.diff(places, axis=0))
    wanted = rest[0, :, :-1].sum() + rest[1, :-1, :].sum()
    places = places * (wanted / (across.sum() + down.sum()))
    return np.stack([places.real, places.imag], axis=-1)

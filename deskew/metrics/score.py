"""Score a flattening by any program against the truth: where the vertices are, and what became of lengths and areas."""

from __future__ import annotations

import numpy as np

from deskew.errors import require
from deskew.metrics.strain import flat_error
from deskew.metrics.stretch import stretch_figures
from deskew.metrics.triangles import Triangles, signed_areas, upward
from deskew.types import Floats, Sheet
from deskew.types.arrays import SHORTEST_MM, require_places


def _turning(points: Floats, triangles: Triangles, way: float) -> Floats:
    """Reverse the second axis if that is what makes the triangles turn the given way on the whole."""
    return points * [1.0, -1.0] if signed_areas(points, triangles).sum() * way < 0 else points


def _require_plane(name: str, points: Floats) -> None:
    """Refuse places onto which nothing can be fitted."""
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    wide = len(spread) == 2 and spread[0] > SHORTEST_MM and spread[1] > 1e-9 * spread[0]
    require(bool(wide), name, f"span a plane, and more than {SHORTEST_MM:g} mm", "points on one line or in one place")


def score_flattening(sheet: Sheet, truth: Floats, flat: Floats, *, same_axes: bool = False) -> dict[str, float]:
    """Compare a flattened triangle mesh with its true flat state, and with the surface that it was made of.

    The surface says which way its faces should turn: as they do when it is looked at from above, or from its front if
    it faces neither up nor down (see `deskew.metrics.triangles.upward`). The truth is right by definition, and its axes
    are a convention of its file, where v may run up or down: if its faces turn the other way its second axis is
    reversed. The flattening gets no such grace: it has x to the right and y up, so if its faces turn the other way it
    is mirrored, whatever the truth's axes.

    Parameters
    ----------
    sheet : Sheet
        The bent surface, triangles [mm].
    truth : (V, 2) array
        True flat place of each vertex [mm], its axes of either handedness.
    flat : (V, 2) array
        Flattened place of each vertex [mm].
    same_axes : bool
        The flattening is given in a file of the truth's own kind, so its v may also run as the truth's does.

    Returns
    -------
    dict
        `flat_{mean,max}_mm` and `flat_rigid_{mean,max}_mm` as :func:`deskew.metrics.flat_error`, over the vertices
        that a face uses; the rest as :func:`deskew.metrics.sheet_stretch`, all signed as said above, face by face
        as in the truth.

    Raises
    ------
    InputError
        If the sheet is a grid, or the three do not have the same vertices, all finite and not on one line.
    StepError
        If the flattening is mirrored.
    """
    require(sheet.faces is not None, "sheet", "be a triangle mesh", "a grid")
    faces: Triangles = np.asarray(sheet.faces)
    for name, points in (("truth", truth), ("flat", flat)):
        wanted = (len(sheet.vertices), 2)
        require(points.shape == wanted, name, f"have shape {wanted}", points.shape)
        require_places(name, points)
        _require_plane(name, points[np.unique(faces)])
    way = upward(sheet)
    right = _turning(truth, faces, way)
    if same_axes and right is not truth:
        flat = _turning(flat, faces, way)
    # A face that its file winds the other way than its neighbours is no fold: the truth knows which way it turns.
    wound = np.where((signed_areas(right, faces) * way < 0)[:, None], faces[:, ::-1], faces)
    used = np.unique(faces)
    # flat_error takes page coordinates, whose v runs down.
    figures = flat_error(flat[used], right[used] * [1.0, -1.0])
    return figures | stretch_figures(sheet.vertices, flat * [1.0, way], wound)

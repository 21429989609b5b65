"""A quad mesh over the whole page, at any resolution, from the depth map and the page's outline (section 2.3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage
from scipy.spatial import cKDTree

from deskew import projection
from deskew.acquisition.fill import FilledDepth, fill_depth
from deskew.acquisition.outline import Outline
from deskew.errors import StepError, is_whole, require
from deskew.types import DepthMap, Floats, Pinhole, Sheet

# About how far apart the surface between the mesh's vertices is sampled, for rest lengths along it [px].
SURFACE_STEP_PX = 2.0
# Width over which a depth map rounds a crease: a pixel sees both facets, and so does the interpolation between two.
CREASE_WIDTH_PX = 1.0
# Spacing at which a side's length in space is measured [px]: wide enough for depth noise not to lengthen it unevenly.
SIDE_STEP_PX = 3.0


@dataclass(frozen=True, slots=True)
class PageMesh:
    """The page as a grid, and how much of it was really measured.

    Attributes
    ----------
    sheet : Sheet
        (R, C) grid of world points [mm].
    nodes : (R, C, 2) array
        Where its vertices lie on the undistorted grid [px].
    filled_fraction : float
        Share of the nodes inside the page's rim whose depth was carried over from the surroundings.
    """

    sheet: Sheet
    nodes: Floats
    filled_fraction: float


def page_mesh(
    depth: DepthMap,
    outline: Outline,
    shape: tuple[int, int] = (45, 45),
    *,
    max_hole_px: float = 12.0,
) -> PageMesh:
    """Span a grid over the page and lift it into space by the depth map.

    The grid is a Coons patch: nodes on each side at even lengths in space, those inside blended from the four sides.
    So it reaches the page's outline everywhere, as a grid over the bounding box does not. Where the depth jumps, as
    beside a flap that hides a part of the page, the quads across the jump are cut.

    Parameters
    ----------
    depth : DepthMap
        Measured depth on the undistorted grid.
    outline : Outline
        The page's boundary on the same grid.
    shape : (rows, columns)
        Vertices of the mesh, from 2 x 2 to 1000 x 1000.
    max_hole_px : float
        Depth is carried over the page's rim and over holes up to this distance from measured depth [px].

    Returns
    -------
    PageMesh

    Raises
    ------
    InputError
        If the mesh is smaller than 2 x 2 or larger than 1000 x 1000.
    StepError
        If a hole is too large, the outline is so concave that the grid overlaps itself, or the depth jumps everywhere.
    """
    sound = isinstance(shape, Sequence) and len(shape) == 2 and all(is_whole(n, 2, 1000) for n in shape)
    require(sound, "shape", "be (rows, columns) of at least 2 x 2 vertices, at most 1000 x 1000", shape)
    filled = fill_depth(depth, outline, max_hole_px)
    n, crease_width = _refinement(outline, shape)
    rows, columns = ((size - 1) * n + 1 for size in shape)
    top = _even_nodes(outline.top, filled, depth.camera, columns)
    bottom = _even_nodes(outline.bottom, filled, depth.camera, columns)
    left = _even_nodes(outline.left, filled, depth.camera, rows)
    right = _even_nodes(outline.right, filled, depth.camera, rows)
    fine = coons_grid(top, right, bottom, left)
    nodes = np.ascontiguousarray(fine[::n, ::n])
    _require_unfolded(nodes)
    surface = _lift(fine, filled, depth.camera)
    sheet = Sheet(
        surface[::n, ::n],
        cut=_cut_quads(nodes, filled),
        surface=surface if n > 1 else None,
        crease_width=crease_width,
    )
    return PageMesh(sheet, nodes, _filled_fraction(nodes, filled))


def _refinement(outline: Outline, shape: tuple[int, int]) -> tuple[int, float]:
    """Choose how many steps of the surface go to a quad, a power of 2, and a crease's width in such steps."""
    sides = ((outline.top, shape[1]), (outline.bottom, shape[1]), (outline.left, shape[0]), (outline.right, shape[0]))
    spacing = float(np.mean([np.linalg.norm(np.diff(side, axis=0), axis=1).sum() / (n - 1) for side, n in sides]))
    n = 2 ** max(0, round(np.log2(spacing / SURFACE_STEP_PX)))
    return n, CREASE_WIDTH_PX * n / spacing if n > 1 else 0.0


def page_sheet(
    depth: DepthMap, outline: Outline, shape: tuple[int, int] = (45, 45), *, max_hole_px: float = 12.0
) -> Sheet:
    """Return only the sheet of :func:`page_mesh`, which see."""
    return page_mesh(depth, outline, shape, max_hole_px=max_hole_px).sheet


def coons_grid(top: Floats, right: Floats, bottom: Floats, left: Floats) -> Floats:
    """Blend four sides into a grid: the bilinearly blended Coons patch.

    Parameters
    ----------
    top, bottom : (C, 2) arrays
        Nodes from left to right [px].
    left, right : (R, 2) arrays
        Nodes from top to bottom [px].

    Returns
    -------
    (R, C, 2) array
        The sides' own nodes on its border.
    """
    s = np.linspace(0.0, 1.0, len(top))[None, :, None]
    t = np.linspace(0.0, 1.0, len(left))[:, None, None]
    between_rows = (1 - t) * top + t * bottom
    between_columns = (1 - s) * left[:, None] + s * right[:, None]
    corners = (1 - t) * ((1 - s) * top[0] + s * top[-1]) + t * ((1 - s) * bottom[0] + s * bottom[-1])
    return np.asarray(between_rows + between_columns - corners)


def _lift(pixels: Floats, filled: FilledDepth, camera: Pinhole) -> Floats:
    """World points [mm] of pixels on the page; the inverse depth is bilinear between pixels, but not across a jump."""
    places = [pixels[..., 1], pixels[..., 0]]
    inverse = ndimage.map_coordinates(filled.inverse_z, places, order=1, mode="nearest")
    if filled.jump.any():
        torn = ndimage.map_coordinates(filled.jump.astype(np.float64), places, order=1, mode="nearest") > 0
        nearest = ndimage.map_coordinates(filled.inverse_z, places, order=0, mode="nearest")
        inverse = np.where(torn, nearest, inverse)
    return np.asarray(projection.centre(camera) + projection.rays(camera, pixels) / inverse[..., None])


def _even_nodes(side: Floats, filled: FilledDepth, camera: Pinhole, n: int) -> Floats:
    """Return `n` points on a side of the outline at even arc lengths in space, (n, 2) [px]."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(side, axis=0), axis=1))])
    stations = np.linspace(0.0, along[-1], max(2, round(along[-1] / SIDE_STEP_PX) + 1))
    points = np.stack([np.interp(stations, along, side[:, k]) for k in range(2)], axis=-1)
    pieces = np.linalg.norm(np.diff(_lift(points, filled, camera), axis=0), axis=1)
    length = np.concatenate([[0.0], np.cumsum(pieces)])
    wanted = np.interp(np.linspace(0.0, length[-1], n), length, stations)
    nodes = np.stack([np.interp(wanted, along, side[:, k]) for k in range(2)], axis=-1)
    nodes[0], nodes[-1] = side[0], side[-1]
    return nodes


def _require_unfolded(nodes: Floats) -> None:
    """Each quad's diagonals must cross clockwise in the picture."""
    down, up = nodes[1:, 1:] - nodes[:-1, :-1], nodes[1:, :-1] - nodes[:-1, 1:]
    folded = int((down[..., 0] * up[..., 1] - down[..., 1] * up[..., 0] <= 0).sum())
    if folded:
        raise StepError(
            f"Page mesh: {folded} of {down.shape[0] * down.shape[1]} quads overlap, the outline is too concave for a "
            "grid between its four sides; give a mask of a simpler outline."
        )


def _cut_quads(nodes: Floats, filled: FilledDepth) -> npt.NDArray[np.bool_] | None:
    """Quads that hold a jump, (R - 1, C - 1), each jump's pixels going to the quad with the nearest middle."""
    if not filled.jump.any():
        return None
    rows, columns = nodes.shape[0] - 1, nodes.shape[1] - 1
    middles = (nodes[:-1, :-1] + nodes[:-1, 1:] + nodes[1:, :-1] + nodes[1:, 1:]).reshape(-1, 2) / 4
    y, x = np.nonzero(filled.jump)
    cut = np.zeros(rows * columns, dtype=bool)
    cut[cKDTree(middles).query(np.stack([x, y], axis=-1))[1]] = True
    if cut.all():
        raise StepError("Page mesh: the depth jumps in every quad; use more vertices, or scan the page again.")
    return cut.reshape(rows, columns)


def _filled_fraction(nodes: Floats, filled: FilledDepth) -> float:
    places = [nodes[..., 1], nodes[..., 0]]
    inside = ndimage.map_coordinates(filled.inside.astype(float), places, order=1, mode="nearest") > 1 - 1e-9
    measured = ndimage.map_coordinates(filled.measured.astype(float), places, order=1, mode="nearest") > 1 - 1e-9
    return float((inside & ~measured).sum() / max(1, inside.sum()))

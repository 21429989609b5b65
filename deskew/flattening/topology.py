"""What a triangle mesh must be to lie flat: one orientable piece with a border, without handles; and small repairs.

A mesh lies flat in one piece if it is a disc, holes allowed: V - E + F + (number of border loops) = 2. What is merely
untidy is healed and counted; what cannot lie flat is refused by name.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from deskew.errors import require
from deskew.flattening.edges import Edges, Indices, border_loops, edges_of
from deskew.types import Array, Floats, Sheet
from deskew.types.arrays import SHORTEST_MM

_COINCIDENT = 1e-9  # vertices closer than this share of the mesh's size lie in one place


class Disc(NamedTuple):
    """A mesh that can lie flat, and where it came from.

    Attributes
    ----------
    vertices : (V', 3) array
        Positions [mm]; every one belongs to a face.
    faces : (F', 3) int array
        Faces, consistently oriented.
    edges : Edges
        Edges of `faces`.
    representative : (V,) int array
        Of each vertex of the sheet, the one among `vertices` whose place it takes.
    kept : (F',) int array
        The sheet's faces among `faces`.
    counts : dict
        `healed_vertices`: merged into another, or alone at the place of another that they are joined to, or without a
        face; `healed_faces`: dropped (a corner or a face given twice), turned round, or without area.
    """

    vertices: Floats
    faces: Indices
    edges: Edges
    representative: Indices
    kept: Indices
    counts: dict[str, float]


def disc_of(sheet: Sheet) -> Disc:
    """Heal a triangle mesh and make sure that it can lie flat.

    Healed, with a count: coincident vertices that split the mesh are merged, unless that would close a rolled sheet to
    a tube; faces given twice or with a corner given twice are dropped; inconsistent faces are turned round; faces
    without area and edges without length stay, and the solver bears them; vertices without a face take the place of
    the nearest one that has a face.

    Raises
    ------
    InputError
        If the mesh has edges with more than two faces, vertices at which it only touches itself, several pieces, no
        border, one side only, or handles; with how many of them.
    """
    require(sheet.faces is not None, "faces", "be given for a triangle mesh", None)
    given = np.ascontiguousarray(sheet.faces, dtype=np.int64)
    # What no face uses may lie anywhere, and says nothing of how large the mesh is.
    used = np.zeros(len(sheet.vertices), dtype=np.bool_)
    used[given] = True
    size = float(np.ptp(sheet.vertices[used], axis=0).max())
    require(size > SHORTEST_MM, "vertices", f"not all lie in one place, within {SHORTEST_MM:g} mm", f"{size:g} mm")
    merged = np.arange(len(sheet.vertices))
    disc, complaint = _tidy(sheet.vertices, given, merged, size)
    places = _places(sheet.vertices, size)
    if places is not None:
        welded, why_not = _tidy(sheet.vertices, given, places, size)
        # A rolled sheet whose two ends touch would become a tube: one border loop more.
        if why_not is None and (complaint is not None or _n_loops(welded) <= _n_loops(disc)):
            disc, complaint = welded, None
    if complaint is not None:
        require(False, "faces", *complaint)
    return disc


def _tidy(vertices: Floats, faces: Indices, merged: Indices, size: float) -> tuple[Disc, tuple[str, str] | None]:
    """Drop and turn faces, number the vertices anew; with what is wrong with the result, if anything."""
    joined = merged[faces]
    kept = np.flatnonzero(
        (joined[:, 0] != joined[:, 1]) & (joined[:, 1] != joined[:, 2]) & (joined[:, 2] != joined[:, 0])
    )
    kept = _without_repeats(joined, kept)
    used = np.zeros(len(vertices), dtype=np.bool_)
    used[joined[kept]] = True
    number = np.cumsum(used) - 1
    corners = np.ascontiguousarray(number[joined[kept]])
    representative = _representatives(vertices, merged, used, number)
    places = np.ascontiguousarray(vertices[used])
    counts = {"healed_vertices": float(len(vertices) - len(places)), "healed_faces": float(len(faces) - len(kept))}
    if not len(corners):
        empty = Edges(np.empty((0, 2), np.int64), np.empty((0, 3), np.int64), np.empty(0, np.int64))
        return Disc(places, corners, empty, representative, kept, counts), ("have area", "corners given twice only")
    edges = edges_of(corners)
    complaint = _not_manifold(corners, edges)
    if complaint is None:
        turned, sides, pieces = _orient(corners, edges.opposite)
        if pieces > 1 and (apart := _n_apart(edges.ends, len(places))) > 1:
            complaint = ("be one piece", f"{apart} pieces")
        elif not sides:
            complaint = ("have two sides", "a surface with one side (not orientable)")
        elif turned.any():
            turned = turned if 2 * turned.sum() <= len(turned) else ~turned  # the majority is right
            corners = np.where(turned[:, None], corners[:, ::-1], corners)
            edges = edges_of(corners)
            counts["healed_faces"] += float(turned.sum())
    disc = Disc(places, corners, edges, representative, kept, counts)
    return disc, complaint or _not_disc(disc)


def _places(vertices: Floats, size: float) -> Indices | None:
    """First vertex at the place of each; None if no two share a place."""
    near = _COINCIDENT * size
    along = vertices @ np.array([0.5773, 0.7071, 0.4082])  # equal places have equal shadows, others hardly ever
    ordered = np.sort(along)
    if float(np.diff(ordered).min()) > near:
        return None
    order = np.argsort(along)
    gap = np.diff(along[order]) <= near
    suspects = order[np.append(gap, False) | np.append(False, gap)]
    pairs = cKDTree(vertices[suspects]).query_pairs(near, output_type="ndarray")
    if not len(pairs):
        return None
    first = np.arange(len(vertices))
    _merge(first, suspects[pairs])
    return first


def _representatives(vertices: Floats, merged: Indices, used: Array, number: Indices) -> Indices:
    """Of each vertex the new number of the one whose place it takes, the nearest one for a vertex without a face."""
    representative = number[merged]
    alone = np.flatnonzero(~used[merged])
    if alone.size and used.any():
        representative[alone] = cKDTree(vertices[used]).query(vertices[alone])[1]
    return np.asarray(representative)


def _without_repeats(faces: Indices, kept: Indices) -> Indices:
    """Of faces with the same three corners, the first."""
    corners = faces[kept]
    n = int(faces.max()) + 1
    low, high = corners.min(axis=1), corners.max(axis=1)
    # A hash that collides on more than repeats only costs the exact comparison below.
    keys = (low * n + high) * 3 + corners.sum(axis=1) * 1_000_003
    ordered = np.sort(keys)
    if bool((ordered[1:] != ordered[:-1]).all()):
        return kept
    first = np.unique(np.sort(corners, axis=1), axis=0, return_index=True)[1]
    return np.asarray(kept[np.sort(first)])


def _not_manifold(faces: Indices, edges: Edges) -> tuple[str, str] | None:
    """Say what keeps a mesh from being a surface everywhere."""
    faces_at = np.bincount(edges.of_face.ravel())
    crowded = int((faces_at > 2).sum())
    if crowded:
        return "have at most two faces at an edge", f"{crowded} non-manifold edges"
    return None


def _not_disc(disc: Disc) -> tuple[str, str] | None:
    """Say what keeps an oriented mesh of one piece from being a disc with holes."""
    if not (disc.edges.opposite < 0).any():
        return "have a border", "a closed surface"
    touching = int((_fans(disc.faces, disc.edges.opposite, len(disc.vertices)) > 1).sum())
    if touching:
        return "have one fan of faces at a vertex", f"{touching} non-manifold vertices (bow ties)"
    loops = _n_loops(disc)
    euler = len(disc.vertices) - len(disc.edges.ends) + len(disc.faces)
    if euler + loops != 2:
        return "lie flat as a disc with holes", f"{(2 - euler - loops) // 2} handles"
    return None


def _n_loops(disc: Disc) -> int:
    """Count the loops that the border consists of."""
    return len(border_loops(disc.faces, disc.edges))


def _n_apart(ends: Indices, n_vertices: int) -> int:
    """Count the pieces that do not even touch at a vertex."""
    ones = np.ones(len(ends), dtype=np.int8)
    joined = coo_array((ones, (ends[:, 0], ends[:, 1])), shape=(n_vertices, n_vertices))
    return int(connected_components(joined, directed=False, return_labels=False))


@njit(cache=True)
def _orient(faces: Indices, opposite: Indices) -> tuple[Array, bool, int]:
    """Faces to turn so that neighbours agree, whether that is possible, and the number of pieces."""
    seen = np.zeros(len(faces), dtype=np.bool_)
    turned = np.zeros(len(faces), dtype=np.bool_)
    queue = np.empty(len(faces), dtype=np.int64)
    two_sided, pieces = True, 0
    for seed in range(len(faces)):
        if seen[seed]:
            continue
        pieces += 1
        seen[seed] = True
        queue[0] = seed
        head, tail = 0, 1
        while head < tail:
            face = queue[head]
            head += 1
            for k in range(3):
                other = opposite[3 * face + k]
                if other < 0:
                    continue
                same_way = faces[face, k] == faces[other // 3, other % 3]
                turn = turned[face] != same_way
                if not seen[other // 3]:
                    seen[other // 3] = True
                    turned[other // 3] = turn
                    queue[tail] = other // 3
                    tail += 1
                elif turned[other // 3] != turn:
                    two_sided = False
    return turned, two_sided, pieces


@njit(cache=True)
def _fans(faces: Indices, opposite: Indices, n_vertices: int) -> Indices:
    """Count the fans of faces at each vertex of an oriented mesh."""
    fans = np.zeros(n_vertices, dtype=np.int64)
    seen = np.zeros(3 * len(faces), dtype=np.bool_)
    for corner in range(3 * len(faces)):
        if seen[corner]:
            continue
        fans[faces[corner // 3, corner % 3]] += 1
        seen[corner] = True
        half = opposite[corner - corner % 3 + (corner + 2) % 3]
        while half >= 0 and not seen[half]:
            seen[half] = True
            half = opposite[half - half % 3 + (half + 2) % 3]
        half = corner
        while opposite[half] >= 0:
            other = opposite[half]
            half = other - other % 3 + (other + 1) % 3
            if seen[half]:
                break
            seen[half] = True
    return fans


@njit(cache=True)
def _merge(first: Indices, pairs: Indices) -> None:
    """Let the vertices that pairs join all name the smallest of them."""
    for i in range(len(pairs)):
        a, b = pairs[i, 0], pairs[i, 1]
        while first[a] != a:
            a = first[a]
        while first[b] != b:
            b = first[b]
        first[max(a, b)] = min(a, b)
    for i in range(len(first)):
        root = i
        while first[root] != root:
            root = first[root]
        first[i] = root

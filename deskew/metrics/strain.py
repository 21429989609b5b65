"""What flattening did to a sheet's lengths, and how far its vertices are from where they truly lie flat.

The two are different things: lengths kept faithfully to a noisy scan give a small strain and a wrong sheet.
"""

from __future__ import annotations

import numpy as np

from deskew.errors import require
from deskew.metrics.alignment import distances, fit_affine, fit_rigid, require_not_mirrored
from deskew.metrics.triangles import quad_triangles, sheet_edges, sheet_triangles, signed_areas, upward
from deskew.types import Flattened, Floats, Sheet


def sheet_strain(sheet: Sheet, flattened: Flattened) -> dict[str, float]:
    """Change of the sheet's edge lengths, and its folds.

    Parameters
    ----------
    sheet : Sheet
        As scanned.
    flattened : Flattened
        The same vertices flattened.

    Returns
    -------
    dict
        `strain_rms`: root mean square of ``L' / L - 1`` over all edges (for a grid: structural and shear springs).
        `length_change`: relative change of all edges' summed length. `flips`: triangles that turn the other way
        than the sheet as scanned. `folded_quads`: of a grid, quads not convex or turned over.
    """
    shape = sheet.vertices.shape
    require(flattened.vertices.shape == shape, "flattened", f"have the sheet's shape {shape}", flattened.vertices.shape)
    before, after = sheet.vertices.reshape(-1, 3), flattened.vertices.reshape(-1, 3)
    require(bool(np.isfinite(after).all()), "flattened", "have finite vertices", "NaN or infinity")
    i, j = sheet_edges(sheet).T
    old, new = np.linalg.norm(before[i] - before[j], axis=1), np.linalg.norm(after[i] - after[j], axis=1)
    require(float(old.min()) > 0, "sheet", "have no two joined vertices in one place", f"{int((old == 0).sum())} pairs")
    triangles = sheet_triangles(sheet)
    # The sheet as scanned says which way is up, so a sheet turned over entirely is all flips.
    up = upward(sheet)
    figures = {
        "strain_rms": float(np.sqrt(((new / old - 1.0) ** 2).mean())),
        "length_change": float(new.sum() / old.sum() - 1.0),
        "flips": float((up * signed_areas(after, triangles) <= 0).sum()),
    }
    if sheet.faces is None:
        areas = up * signed_areas(after, quad_triangles(sheet))
        figures["folded_quads"] = float((areas <= 0).any(axis=1).sum())
    return figures


def flat_error(vertices: Floats, true_uv: Floats) -> dict[str, float]:
    """Distance of flattened vertices from their true places on the flat page.

    Parameters
    ----------
    vertices : (..., 2 or 3) array
        Flattened positions in the world [mm]; only X and Y count.
    true_uv : (..., 2) array
        True page coordinates (u, v) [mm] of the same vertices; NaN rows (off the page) are left out.

    Returns
    -------
    dict
        `flat_{mean,max}_mm` after an affine and `flat_rigid_{mean,max}_mm` after a rigid alignment.

    Raises
    ------
    StepError
        If the result is mirrored.
    """
    require(
        vertices.shape[:-1] == true_uv.shape[:-1] and true_uv.shape[-1] == 2,
        "true_uv",
        f"have shape {(*vertices.shape[:-1], 2)}",
        true_uv.shape,
    )
    places, truth = vertices[..., :2].reshape(-1, 2), true_uv.reshape(-1, 2) * np.array([1.0, -1.0])
    known = np.isfinite(truth).all(axis=1)
    places, truth = places[known], truth[known]
    require_not_mirrored(places, truth, "Flat error")
    affine = distances(fit_affine(places, truth).apply(places), truth)
    rigid = distances(fit_rigid(places, truth).apply(places), truth)
    return {
        "flat_mean_mm": float(affine.mean()),
        "flat_max_mm": float(affine.max()),
        "flat_rigid_mean_mm": float(rigid.mean()),
        "flat_rigid_max_mm": float(rigid.max()),
    }

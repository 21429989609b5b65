"""Checkerboard corners of the restored image against those of the flat control (section 4.1)."""

from __future__ import annotations

import numpy as np

from deskew import projection
from deskew.errors import StepError, require
from deskew.metrics.alignment import distances, fit_affine, fit_rigid, require_not_mirrored
from deskew.types import Floats, Pinhole

# An affine map of the plane is determined by 3 pairs; with fewer than this many its residuals say nothing.
PAIRS_MIN = 6


def corner_distance(restored: Floats, control: Floats, camera: Pinhole) -> dict[str, float]:
    """Distances between corresponding corners, aligned affinely as in the paper and rigidly beside it.

    Affine figures: the restored points are brought onto the control's by a least-squares affine map in the image; both
    are then back-projected onto Z = 0 for the millimetres. Rigid figures: both are back-projected as they are and
    aligned by a rotation and a translation on Z = 0.

    Parameters
    ----------
    restored, control : (N, 2) arrays
        Corners in undistorted views of the same camera [px], row by row the same corner; a NaN row is a corner that was
        not found. N is the number of corners the page has.
    camera : Pinhole
        The ideal camera of the views.

    Returns
    -------
    dict
        `corner_{mean,rms,max}_{px,mm}`, `corner_rigid_{mean,max}_mm`, `corners_missing`, `corners_expected`.
        Lost corners flatter the distances: never print one without the other.

    Raises
    ------
    StepError
        If too few corners were found to align them, or the restored page is mirrored.
    """
    shape = np.shape(restored)
    require(len(shape) == 2 and shape[1] == 2, "restored", "have shape (N, 2)", shape)
    require(np.shape(control) == shape, "control", f"have the restored corners' shape {shape}", np.shape(control))
    require(not camera.distortion.any(), "camera", "be ideal: the views are undistorted", camera.distortion.tolist())
    found = np.isfinite(restored).all(axis=1) & np.isfinite(control).all(axis=1)
    if int(found.sum()) < PAIRS_MIN:
        raise StepError(
            f"Corner distance: {int(found.sum())} of {shape[0]} corners found in both images, at least {PAIRS_MIN} "
            "needed; look at the restored image."
        )
    moved, fixed = restored[found], control[found]
    require_not_mirrored(moved, fixed, "Corner distance")
    aligned = fit_affine(moved, fixed).apply(moved)
    bed, fixed_bed = projection.onto_bed(camera, moved), projection.onto_bed(camera, fixed)
    figures = {
        **_summary(distances(aligned, fixed), "px"),
        **_summary(distances(projection.onto_bed(camera, aligned), fixed_bed), "mm"),
    }
    rigid = distances(fit_rigid(bed, fixed_bed).apply(bed), fixed_bed)
    figures["corner_rigid_mean_mm"] = float(rigid.mean())
    figures["corner_rigid_max_mm"] = float(rigid.max())
    figures["corners_missing"] = float((~found).sum())
    figures["corners_expected"] = float(shape[0])
    return figures


def _summary(values: Floats, unit: str) -> dict[str, float]:
    return {
        f"corner_mean_{unit}": float(values.mean()),
        f"corner_rms_{unit}": float(np.sqrt((values**2).mean())),
        f"corner_max_{unit}": float(values.max()),
    }

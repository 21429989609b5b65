"""How well a page was restored: figures against the control or against truth, named as in the result tables."""

from deskew.metrics.alignment import Alignment, fit_affine, fit_rigid
from deskew.metrics.corners import corner_distance
from deskew.metrics.coverage import page_coverage
from deskew.metrics.dense import dense_error
from deskew.metrics.depth import depth_error
from deskew.metrics.strain import flat_error, sheet_strain

__all__ = [
    "Alignment",
    "corner_distance",
    "dense_error",
    "depth_error",
    "fit_affine",
    "fit_rigid",
    "flat_error",
    "page_coverage",
    "sheet_strain",
]

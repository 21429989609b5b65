"""How well a page was restored: figures against the control or against truth, named as in the result tables."""

from deskew.metrics.alignment import Alignment, fit_affine, fit_rigid
from deskew.metrics.corners import corner_distance
from deskew.metrics.coverage import page_coverage
from deskew.metrics.dense import dense_error
from deskew.metrics.depth import depth_error
from deskew.metrics.difference import image_difference, laid_onto
from deskew.metrics.regions import region_error
from deskew.metrics.score import score_flattening
from deskew.metrics.strain import flat_error, sheet_strain
from deskew.metrics.stretch import sheet_stretch

__all__ = [
    "Alignment",
    "corner_distance",
    "dense_error",
    "depth_error",
    "fit_affine",
    "fit_rigid",
    "flat_error",
    "image_difference",
    "laid_onto",
    "page_coverage",
    "region_error",
    "score_flattening",
    "sheet_strain",
    "sheet_stretch",
]
